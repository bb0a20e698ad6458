#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "common/scene/scene_build.hpp"
#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {
namespace {

SceneSource five_boxes() {
  SceneSource source;
  for (int i = 0; i < 5; ++i) {
    const Vec3 lo(7.0 * i, 3.0 * (i % 2), 0);
    source.objects.push_back(box_object("box" + std::to_string(i), {lo, lo + Vec3(2, 1, 3 + i)}));
  }
  source.objects[3].occluder = false;
  return source;
}

std::vector<std::byte> bundle_of_five_boxes() { return build_bundle(five_boxes()).value(); }

}  // namespace

TEST(SceneBundle, a_scene_comes_back_as_it_went_in) {
  const SceneSource source = five_boxes();
  const auto scene = build_scene(source).value();
  ASSERT_EQ(scene->object_count(), 5u);
  std::uint32_t files_seen = 0;
  for (std::uint32_t i = 0; i < 5; ++i) {
    const ObjectRecord& object = scene->object(ObjectId{i});
    const SourceObject& from = source.objects[object.file_index];
    files_seen |= 1u << object.file_index;
    EXPECT_EQ(scene->name(ObjectId{i}), from.name);
    EXPECT_EQ(object.occluder, from.occluder);
    ASSERT_EQ(scene->triangles(ObjectId{i}).size(), 12u);
    for (std::size_t t = 0; t < 12; ++t)
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(scene->vertices()[scene->triangles(ObjectId{i})[t].vertex[k]],
                  from.vertices[from.triangles[t][k]]);
  }
  EXPECT_EQ(files_seen, 31u);
  EXPECT_EQ(scene->ground(), 0);
  EXPECT_EQ(scene->bounds().hi, Vec3(30, 4, 7));
}

TEST(SceneBundle, the_same_source_gives_the_same_bytes) {
  EXPECT_EQ(bundle_of_five_boxes(), bundle_of_five_boxes());
  SceneSource moved = five_boxes();
  moved.objects[0].vertices[0].x = std::nextafter(moved.objects[0].vertices[0].x, -1);
  EXPECT_NE(build_bundle(moved).value(), bundle_of_five_boxes());
}

TEST(SceneBundle, every_truncation_is_refused) {
  const std::vector<std::byte> whole = bundle_of_five_boxes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto scene = Scene::from_bytes({whole.begin(), whole.begin() + static_cast<long>(size)});
    ASSERT_FALSE(scene.ok()) << size;
    ASSERT_EQ(scene.error().kind, ErrorKind::kInvalidInput) << size;
  }
}

TEST(SceneBundle, every_flipped_bit_is_refused) {
  const std::vector<std::byte> whole = bundle_of_five_boxes();
  for (std::size_t at = 0; at < whole.size(); at += at < 512 ? 1 : 37) {
    std::vector<std::byte> damaged = whole;
    damaged[at] ^= std::byte{0x10};
    EXPECT_FALSE(Scene::from_bytes(std::move(damaged)).ok()) << at;
  }
}

// Damage behind a checksum that fits: refused, or harmless to every accessor.
TEST(SceneBundle, forged_records_are_refused_or_harmless) {
  constexpr std::size_t kPreambleBytes = 64, kChecksumAt = 24;
  const std::vector<std::byte> whole = bundle_of_five_boxes();
  Random random(3);
  int refused = 0;
  for (int k = 0; k < 4000; ++k) {
    std::vector<std::byte> forged = whole;
    const std::size_t at = kPreambleBytes + random.below(whole.size() - kPreambleBytes);
    forged[at] = static_cast<std::byte>(random.below(3) ? random.below(256) : 255);
    const Digest checksum = digest_of(std::span(forged).subspan(kPreambleBytes));
    std::memcpy(forged.data() + kChecksumAt, checksum.bytes.data(), checksum.bytes.size());
    const auto scene = Scene::from_bytes(std::move(forged));
    if (!scene.ok()) {
      EXPECT_EQ(scene.error().kind, ErrorKind::kInvalidInput);
      ++refused;
      continue;
    }
    double sum = 0;
    for (std::uint32_t i = 0; i < (*scene)->object_count(); ++i) {
      for (const char c : (*scene)->name(ObjectId{i})) sum += c;
      for (const Triangle& t : (*scene)->triangles(ObjectId{i}))
        for (const std::uint32_t v : t.vertex) sum += (*scene)->vertices()[v].x;
    }
    for (const Occluder& o : (*scene)->occluders()) {
      for (const Vec3& p : (*scene)->points(o)) sum += p.x;
      for (const ObjectId id : (*scene)->owners(o)) sum += (*scene)->object(id).box.lo.x;
    }
    EXPECT_TRUE(std::isfinite(sum));
  }
  EXPECT_GT(refused, 2000);
}

TEST(SceneBundle, a_mapped_file_is_the_scene_and_a_missing_one_an_io_error) {
  const std::string path = testing::TempDir() + "five_boxes." + std::to_string(::getpid());
  const std::vector<std::byte> bytes = bundle_of_five_boxes();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
  const auto scene = Scene::map(path);
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  EXPECT_EQ((*scene)->digest(), digest_of(bytes));
  EXPECT_EQ((*scene)->object_count(), 5u);
  std::ofstream(path, std::ios::trunc).close();
  EXPECT_EQ(Scene::map(path).error().kind, ErrorKind::kInvalidInput);
  ::unlink(path.c_str());
  const auto missing = Scene::map(path);
  EXPECT_EQ(missing.error().kind, ErrorKind::kIo);
  EXPECT_NE(missing.error().text.find(path), std::string::npos);
}

TEST(SceneBuild, bad_input_is_refused_and_names_the_object) {
  SceneSource source = five_boxes();
  source.objects[2].vertices[4].y = std::nan("");
  const auto nan = build_scene(source);
  ASSERT_FALSE(nan.ok());
  EXPECT_EQ(nan.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(nan.error().text.find("box2"), std::string::npos);

  source = five_boxes();
  source.objects[1].triangles[0][2] = 8;
  EXPECT_FALSE(build_scene(source).ok());
  source = five_boxes();
  for (SourceObject& object : source.objects) object.occludee = false;
  EXPECT_FALSE(build_scene(source).ok());
  EXPECT_FALSE(build_scene({}).ok());
}

TEST(SceneBuild, hierarchy_leaves_hold_at_most_four_objects_and_every_object_once) {
  SceneSource source;
  for (int i = 0; i < 300; ++i) {  // many at the same place: the middle is the fall-back
    const Vec3 lo(i < 100 ? 0.0 : i, (i * 7) % 13, 0);
    source.objects.push_back(box_object("b", {lo, lo + Vec3(1)}));
  }
  const auto scene = build_scene(source).value();
  std::vector<int> covered(300);
  for (const BvhNode& node : scene->bvh()) {
    if (node.child != 0) continue;
    EXPECT_LE(node.count, 4u);
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      ++covered[i];
      EXPECT_TRUE(node.box.contains(scene->object(ObjectId{i}).box.lo));
      EXPECT_TRUE(node.box.contains(scene->object(ObjectId{i}).box.hi));
    }
  }
  EXPECT_EQ(covered, std::vector<int>(300, 1));
}

}  // namespace pvsfarm
