// Stores for tests, and a folder for them.
#pragma once

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/random.hpp"
#include "common/pvs/store_writer.hpp"

namespace pvsfarm {

class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "pvsfarm_XXXXXX").string();
    PVS_CHECK(::mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

// All that goes into a store, so that a test can compare what comes out.
struct SampleStore {
  StoreHeader header;
  std::vector<std::string> names;
  std::vector<StoreObject> objects;
  std::vector<StoreNode> nodes;

  Status write(const std::string& path) const {
    auto writer = StoreWriter::create(path, header, objects);
    if (!writer) return writer.error();
    for (const StoreNode& node : nodes)
      if (Status status = (*writer)->add(node); !status) return status;
    return (*writer)->finish();
  }
};

inline VisibleSet random_subset(const VisibleSet& of, double kept, Random& random) {
  VisibleSet set = of;
  of.for_each([&](ObjectId id) {
    if (random.unit() >= kept) set.remove(id);
  });
  return set;
}

struct SampleShape {
  std::uint32_t objects = 150;
  std::uint32_t roots = 5;
  int max_depth = 3;
  double kept = 0.6;  // of the parent's set
  bool with_seen = true;
  double turned = 0.3;  // share of roots
};

// What is in either, of two subsets of `all`.
inline VisibleSet union_within(const VisibleSet& all, const VisibleSet& a, const VisibleSet& b) {
  VisibleSet neither = all, either = all;
  neither.remove_all(a);
  neither.remove_all(b);
  either.remove_all(neither);
  return either;
}

// An inner node's sets are the unions of its leaves'.
inline void add_subtree(SampleStore& store, const StoreNode& node, int levels, Random& random,
                        const SampleShape& shape) {
  const std::size_t at = store.nodes.size();
  store.nodes.push_back(node);
  const int axis = node.cell.longest_axis();
  store.nodes[at].leaf =
      levels == 0 || node.quarantined || random.unit() < 0.3 || !can_split(node.cell, axis);
  if (store.nodes[at].leaf) return;
  const auto [low, high] = split(node.cell, axis);
  std::size_t child_at[2];
  for (const int half : {0, 1}) {
    StoreNode child = node;
    child.key = node.key.child(half);
    child.cell = half == 0 ? low : high;
    child.quarantined = random.unit() < 0.05;
    child.reason = static_cast<LeafReason>(1 + random.below(5));
    if (!child.quarantined) child.visible = random_subset(node.visible, shape.kept, random);
    child.seen = VisibleSet::none(shape.objects);
    if (shape.with_seen) child.seen = random_subset(child.visible, 0.8, random);
    child_at[half] = store.nodes.size();
    add_subtree(store, child, levels - 1, random, shape);
  }
  const StoreNode &a = store.nodes[child_at[0]], &b = store.nodes[child_at[1]];
  store.nodes[at].visible = union_within(node.visible, a.visible, b.visible);
  store.nodes[at].seen = union_within(node.visible, a.seen, b.seen);
}

inline SampleStore random_store(std::uint64_t seed, const SampleShape& shape = {}) {
  Random random(seed);
  SampleStore store;
  store.header.up = random.below(2) == 0 ? UpAxis::kZ : UpAxis::kY;
  store.header.scene_digest.bytes[0] = static_cast<std::uint8_t>(random.below(256));
  store.header.bake_digest.bytes[31] = static_cast<std::uint8_t>(random.below(256));
  store.header.settings_json = R"({"raster":"direct"})" + std::string(random.below(9), ' ');
  const auto coordinate = [&] { return random.between(-100, 100); };
  for (std::uint32_t i = 0; i < shape.objects; ++i)
    store.names.push_back("object " + std::to_string(i) + std::string(random.below(4), '_'));
  for (std::uint32_t i = 0; i < shape.objects; ++i) {
    Box box;
    for (int k = 0; k < 2; ++k) box.add(Vec3{coordinate(), coordinate(), coordinate()});
    store.objects.push_back({.name = store.names[i],
                             .box = box,
                             .triangle_count = static_cast<std::uint32_t>(random.below(1000)),
                             .file_index = shape.objects - 1 - i,
                             .occluder = random.below(2) == 0,
                             .occludee = random.below(9) != 0,
                             .dynamic = random.below(5) == 0});
  }
  for (std::uint32_t root = 0; root < shape.roots; ++root) {
    StoreNode node;
    node.key = {root, 1};
    node.root_id = static_cast<std::int64_t>(random.below(1000)) * 1000 + root - 500000;
    node.cell.lo = {coordinate(), coordinate(), coordinate()};
    node.cell.hi = node.cell.lo + Vec3{random.between(0.1, 9), random.between(0.1, 9), 1.5};
    if (random.unit() < shape.turned) {
      const double angle = random.between(0, 3), c = std::cos(angle), s = std::sin(angle);
      node.cell.origin = {coordinate(), coordinate(), coordinate()};
      node.cell.axes = {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}};
    }
    node.visible = random_subset(VisibleSet::all(shape.objects), shape.kept, random);
    node.seen = VisibleSet::none(shape.objects);
    add_subtree(store, node, shape.max_depth, random, shape);
  }
  return store;
}

}  // namespace pvsfarm
