// What a store calls seen, proved once more: every seen set is computed anew from the store's own
// settings, its witnesses are taken out of the evaluator, and an independent ray caster tries to
// block them.
//
// PVSFARM_SCENES=FOLDER  where the real scenes are, as for bake_test
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/cells/cell_source.hpp"
#include "common/pvs/store_reader.hpp"
#include "common/scene/import.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/service/bake_identity.hpp"
#include "tests/golden/run_program.hpp"
#include "tests/scenes/real_scenes.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm {

void PrintTo(const NamedScene& scene, std::ostream* out) { *out << scene.name; }

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRoots = 6;
constexpr std::size_t kWitnesses = 1'000;  // of a scene, unless its cells see fewer

struct Files {
  std::string scene, tags, cells, occluders;  // "": none
};

// `count` cells of the file, spread over it, as a file of their own.
void write_some_cells(const std::string& from, std::size_t count, const std::string& to) {
  const nlohmann::json all = nlohmann::json::parse(std::ifstream(from));
  nlohmann::json some = all;
  some["cells"] = nlohmann::json::array();
  const std::size_t size = all["cells"].size();
  for (std::size_t i = 0; i < std::min(count, size); ++i)
    some["cells"].push_back(all["cells"][(2 * i + 1) * size / (2 * std::min(count, size))]);
  std::ofstream(to) << some.dump();
}

Files files_of(const NamedScene& named, const TempFolder& folder) {
  if (named.folder.empty()) {
    const ProgramRun made = run_pvsfarm(folder, "generate " + named.name + " -o scene.obj" +
                                                    (named.name == "city" ? " --blocks 5" : ""));
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return {folder.file("scene.obj"), folder.file("scene.tags.json"),
            folder.file("scene.cells.json"), ""};
  }
  const fs::path from = fs::absolute(named.folder);
  const fs::path occluders = from / "blockers.obj";
  return {from / "scene.obj", from / "tags.json", from / "cells.json",
          fs::exists(occluders) ? occluders.string() : ""};
}

// Evaluates stored cells again, and counts what the rays say.
class Judge {
 public:
  Judge(const Files& files, StoreReader& store)
      : store_(store),
        source_(import_scene({files.scene, {}, files.tags, files.occluders}).value().source),
        oracle_(source_),
        scene_(build_scene(source_).value()),
        evaluator_(scene_, settings_from_json(store.header().settings_json).value().evaluator) {}

  void judge(std::uint32_t index) {
    const StoredNode node = store_.node(index).value();
    const StoredSets stored = store_.sets(index).value();
    ASSERT_TRUE(stored.seen.subset_of(stored.visible)) << "cell " << index;
    if (node.leaf && node.reason == LeafReason::kMerged) return;  // of cells that are not stored
    if (!node.leaf) return;                                       // the unions of its leaves'
    VisibleSet parent = all_occludees(*scene_);
    for (const StoredNode& ancestor : ancestors_of(node))
      parent.remove_all(evaluator_.evaluate(ancestor.key, ancestor.cell, parent).hidden);
    const CellDelta delta = evaluator_.evaluate(node.key, node.cell, parent);
    parent.remove_all(delta.hidden);
    EXPECT_EQ(delta.statistics.contradictions, 0u);
    ASSERT_EQ(parent, stored.visible) << "cell " << index;
    ASSERT_EQ(delta.seen, stored.seen) << "cell " << index;
    check_witnesses(node, stored.seen);
  }

  std::size_t witnesses() const { return witnesses_; }
  const Scene& scene() const { return *scene_; }

 private:
  // From the root on.
  std::vector<StoredNode> ancestors_of(const StoredNode& node) {
    std::vector<StoredNode> list;
    for (std::int64_t i = node.parent; i >= 0; i = list.back().parent)
      list.push_back(store_.node(static_cast<std::uint32_t>(i)).value());
    std::reverse(list.begin(), list.end());
    return list;
  }

  void check_witnesses(const StoredNode& node, const VisibleSet& seen) {
    // Both judges keep about 1e-9 of the scene's extent clear, each by a formula of its own: a
    // witness that clears the product's margin may come a little nearer than the other's.
    const double margin = oracle_.margin_for(node.cell.bounds()) / 4;
    std::uint32_t of_the_set = 0;
    for (const Witness& witness : evaluator_.witnesses()) {
      if (!seen.contains(witness.object)) continue;
      ++of_the_set;
      ++witnesses_;
      const std::uint32_t position = scene_->object(witness.object).file_index;
      EXPECT_TRUE(node.cell.bounds().contains(witness.eye));
      EXPECT_LT(distance_to(scene_->object(witness.object).box, witness.point), margin);
      const auto blocker = oracle_.blocker_before({witness.eye, witness.point}, margin, position,
                                                  source_.objects[position]);
      EXPECT_FALSE(blocker.has_value())
          << "cell " << node.index << ": "
          << to_string(Violation{position, {witness.eye, witness.point}}) << ", but "
          << source_.objects[blocker->object].name << " comes within " << margin;
    }
    EXPECT_EQ(of_the_set, seen.count());
  }
  static double distance_to(const Box& box, const Vec3& p) {
    double largest = 0;
    for (int a = 0; a < 3; ++a) largest = std::max({largest, box.lo[a] - p[a], p[a] - box.hi[a]});
    return largest;
  }

  StoreReader& store_;
  SceneSource source_;
  RayOracle oracle_;
  std::shared_ptr<const Scene> scene_;
  Evaluator evaluator_;
  std::size_t witnesses_ = 0;
};

class StoredWitnesses : public testing::TestWithParam<NamedScene> {};

TEST_P(StoredWitnesses, are_unblocked_and_make_up_the_stored_seen_sets) {
  const TempFolder folder;
  const Files files = files_of(GetParam(), folder);
  write_some_cells(files.cells, kRoots, folder.file("some.json"));
  std::string arguments =
      "bake '" + files.scene + "' --tags '" + files.tags + "' --cells some.json -o x.pvs";
  if (GetParam().folder.empty()) arguments += " --budget 3000 --min-cell 2";  // with splits
  if (!files.occluders.empty()) arguments += " --occluders '" + files.occluders + "'";
  const ProgramRun bake = run_pvsfarm(folder, arguments);
  ASSERT_EQ(bake.exit_code, 0) << bake.err;

  const auto store = StoreReader::open(folder.file("x.pvs"));
  ASSERT_TRUE(store.ok()) << store.error().text;
  Judge judge(files, **store);
  ASSERT_EQ(judge.scene().digest(), (*store)->header().scene_digest);
  std::uint32_t judged = 0;
  for (; judged < (*store)->node_count() && judge.witnesses() < kWitnesses; ++judged) {
    judge.judge(judged);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(judge.witnesses(), 0u);
  std::cout << GetParam().name << ": " << judge.witnesses() << " witnesses of " << judged << " of "
            << (*store)->node_count() << " cells are unblocked\n";
}

std::vector<NamedScene> scenes() {
  std::vector<NamedScene> all = scenes_on_disk();
  for (const char* name : {"city", "rooms"}) all.push_back({name, ""});
  return all;
}
std::string name_of(const testing::TestParamInfo<NamedScene>& test) { return test.param.name; }
INSTANTIATE_TEST_SUITE_P(Scenes, StoredWitnesses, testing::ValuesIn(scenes()), name_of);

}  // namespace
}  // namespace pvsfarm
