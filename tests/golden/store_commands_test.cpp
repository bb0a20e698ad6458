// The commands that read stores, word for word. PVSFARM_UPDATE_GOLDEN=1 writes the expected files
// anew; look at the difference before you commit it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/golden/run_program.hpp"

namespace pvsfarm {
namespace {

VisibleSet set_of(std::initializer_list<std::uint32_t> ids) {
  VisibleSet set = VisibleSet::all(5);
  for (std::uint32_t id = 0; id < 5; ++id)
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) set.remove(ObjectId{id});
  return set;
}

// A street: root 7 is 8 x 4 m and split twice, -9 stands beside it, turned by a 3-4-5 triangle.
SampleStore tiny_store(UpAxis up) {
  SampleStore store;
  store.header.up = up;
  store.header.settings_json = R"({"raster":"direct","resolution_px":256})";
  store.header.scene_digest.bytes.fill(0x5c);
  store.header.bake_digest.bytes.fill(0xba);
  store.names = {"house", "tower", "tree \"ash\"", "car", "wall"};
  const std::uint32_t triangles[] = {12, 12, 1000, 300, 2};
  for (std::uint32_t i = 0; i < 5; ++i)
    store.objects.push_back({.name = store.names[i],
                             .box = {{10.0 * i, -1, 0}, {10.0 * i + 5, 2.5, 0.1 + i}},
                             .triangle_count = triangles[i],
                             .file_index = 4 - i});
  StoreNode node{.key = {0, 1},
                 .root_id = 7,
                 .leaf = false,
                 .cell = Cell::aligned({{0, 0, 1.5}, {8, 4, 1.9}}),
                 .visible = set_of({0, 1, 2, 3}),
                 .seen = set_of({})};
  const auto [low, high] = split(node.cell, 0);
  const auto [high_low, high_high] = split(high, 0);
  store.nodes.push_back(node);
  const auto add_child = [&](CellKey key, const Cell& cell, bool leaf, const VisibleSet& visible,
                             const VisibleSet& seen) {
    store.nodes.push_back(
        {.key = key, .root_id = 7, .leaf = leaf, .cell = cell, .visible = visible, .seen = seen});
  };
  const CellKey high_key = node.key.child(1);
  add_child(node.key.child(0), low, true, set_of({0, 1}), set_of({0}));
  add_child(high_key, high, false, set_of({0, 2, 3}), set_of({}));
  add_child(high_key.child(0), high_low, true, set_of({3}), set_of({3}));
  add_child(high_key.child(1), high_high, true, set_of({0, 2, 3}), set_of({}));
  store.nodes.back().quarantined = true;
  store.nodes[1].reason = LeafReason::kBudgetMet;
  store.nodes[3].reason = LeafReason::kNothingToGain;
  store.nodes.push_back({.key = {1, 1},
                         .root_id = -9,
                         .cell = {.origin = {20, 0, 0},
                                  .axes = {Vec3{0.6, 0.8, 0}, Vec3{-0.8, 0.6, 0}, Vec3{0, 0, 1}},
                                  .lo = {-1, -2, 1.5},
                                  .hi = {1, 2, 1.75}},
                         .visible = set_of({4}),
                         .seen = set_of({4})});
  return store;
}

class StoreCommands : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(tiny_store(UpAxis::kZ).write(folder_.file("tiny.pvs")).ok());
    ASSERT_TRUE(tiny_store(UpAxis::kY).write(folder_.file("tiny_y.pvs")).ok());
  }

  ProgramRun run(const std::string& arguments) { return run_pvsfarm(folder_, arguments); }

  void expect_golden(const std::string& arguments, const std::string& name) {
    const ProgramRun ran = run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
    const std::string path = PVSFARM_GOLDEN_FOLDER "/" + name;
    if (std::getenv("PVSFARM_UPDATE_GOLDEN") != nullptr) {
      ASSERT_TRUE(write_file(path, ran.out).ok());
    }
    const auto expected = read_file(path);
    ASSERT_TRUE(expected.ok()) << expected.error().text;
    EXPECT_EQ(ran.out, *expected);
  }

  // One line on stderr that names the file, nothing on stdout.
  void expect_failure(const std::string& arguments, int exit_code, const std::string& part) {
    const ProgramRun ran = run(arguments);
    EXPECT_EQ(ran.exit_code, exit_code) << arguments;
    EXPECT_EQ(ran.out, "") << arguments;
    EXPECT_EQ(ran.err.rfind("pvsfarm: ", 0), 0u) << ran.err;
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_NE(ran.err.find(part), std::string::npos) << ran.err;
  }

  TempFolder folder_;
};

TEST_F(StoreCommands, inspect) { expect_golden("inspect tiny.pvs", "inspect.txt"); }
TEST_F(StoreCommands, inspect_json) { expect_golden("inspect tiny.pvs --json", "inspect.json"); }
TEST_F(StoreCommands, query) { expect_golden("query tiny.pvs --at 1,1,1.6", "query.txt"); }
TEST_F(StoreCommands, query_on_a_border) {
  expect_golden("query tiny.pvs --at 4 4 1.9", "query_border.txt");
}
TEST_F(StoreCommands, query_of_a_turned_cell) {
  expect_golden("query tiny.pvs --at 20,0,1.6 --json", "query_turned.json");
}
TEST_F(StoreCommands, export_of_leaves) { expect_golden("export tiny.pvs", "export.jsonl"); }
TEST_F(StoreCommands, export_of_all_cells_y_up) {
  expect_golden("export tiny_y.pvs --all", "export_all_y.jsonl");
}
TEST_F(StoreCommands, validate) { expect_golden("validate tiny.pvs", "validate.txt"); }

TEST_F(StoreCommands, inspect_draws_a_picture_whole_or_not_at_all) {
  const ProgramRun ran = run("inspect tiny.pvs --picture a.png --cell 1");
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_EQ(ran.out, run("inspect tiny.pvs").out);
  EXPECT_EQ(read_file(folder_.file("a.png"))->substr(0, 4), "\x89PNG");
  EXPECT_EQ(run("inspect tiny.pvs --picture b.png").exit_code, 0);
  EXPECT_NE(*read_file(folder_.file("a.png")), *read_file(folder_.file("b.png")));
  expect_failure("inspect tiny.pvs --picture c.png --cell 6", 1, "has 6 cells, the first is 0");
  expect_failure("inspect tiny.pvs --cell 1", 1, "--picture");
  EXPECT_EQ(run("inspect tiny.pvs --picture gap.png --color gap").exit_code, 0);
  EXPECT_NE(*read_file(folder_.file("gap.png")), *read_file(folder_.file("b.png")));
  expect_failure("inspect tiny.pvs --color gap", 1, "--picture");
  expect_failure("inspect tiny.pvs --picture no/c.png", 2, "no/c.png");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("c.png")));
}

TEST_F(StoreCommands, query_takes_coordinates_of_a_y_up_file) {
  // (1, 1, 1.6) of the z-up store is (1, 1.6, -1) where y is up.
  const ProgramRun z = run("query tiny.pvs --at 1,1,1.6 --json");
  const ProgramRun y = run("query tiny_y.pvs --at 1,1.6,-1 --json");
  ASSERT_EQ(y.exit_code, 0) << y.err;
  EXPECT_EQ(nlohmann::json::parse(y.out)["cell"], nlohmann::json::parse(z.out)["cell"]);
  EXPECT_EQ(nlohmann::json::parse(y.out)["center"], (nlohmann::json{2.0, 1.7, -2.0}));
}

TEST_F(StoreCommands, export_takes_times_from_the_file_beside_the_store) {
  ASSERT_TRUE(write_file(folder_.file("tiny.pvs.stats"), "{\"cell\":3,\"ms\":1.7}\n").ok());
  const ProgramRun ran = run("export tiny.pvs | grep '\"cell\":3,' ");
  EXPECT_NE(ran.out.find("\"ms\":1.7}"), std::string::npos) << ran.out;
  ASSERT_TRUE(write_file(folder_.file("tiny.pvs.stats"), "{\"cell\":99,\"ms\":1.7}\n").ok());
  expect_failure("export tiny.pvs -o x.jsonl", 3, "tiny.pvs.stats: line 1");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("x.jsonl")));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("x.jsonl.partial")));
}

TEST_F(StoreCommands, export_to_a_file_is_what_stdout_gets) {
  const ProgramRun ran = run("export tiny.pvs");
  EXPECT_EQ(run("export tiny.pvs -o x.jsonl").exit_code, 0);
  EXPECT_EQ(*read_file(folder_.file("x.jsonl")), ran.out);
}

TEST_F(StoreCommands, diff_of_a_store_with_itself) {
  EXPECT_EQ(run("diff tiny.pvs tiny.pvs").out, "identical\n");
}

TEST_F(StoreCommands, diff_names_cells_and_objects) {
  SampleStore other = tiny_store(UpAxis::kZ);
  other.names[4] = "gate";
  other.objects[4].name = other.names[4];
  other.nodes[1].visible = set_of({1, 2});
  other.nodes[1].seen = set_of({1});
  other.nodes[4].seen = set_of({0, 2});
  other.nodes[5].root_id = 11;
  ASSERT_TRUE(other.write(folder_.file("other.pvs")).ok());
  expect_golden("diff tiny.pvs other.pvs", "diff.txt");
  expect_golden("diff tiny.pvs other.pvs --json", "diff.json");
}

TEST_F(StoreCommands, diff_matches_objects_by_name_whatever_their_ids) {
  SampleStore other = tiny_store(UpAxis::kZ);
  std::swap(other.objects[0].name, other.objects[1].name);
  for (StoreNode& node : other.nodes) {
    for (VisibleSet* set : {&node.visible, &node.seen}) {
      std::vector<std::uint64_t> words(set->words().begin(), set->words().end());
      words[0] = (words[0] & ~3ull) | (words[0] & 1) << 1 | (words[0] >> 1 & 1);
      *set = VisibleSet::from_words(5, words);
    }
  }
  ASSERT_TRUE(other.write(folder_.file("other.pvs")).ok());
  EXPECT_EQ(run("diff tiny.pvs other.pvs").out, "same objects, cells and sets; other bytes\n");
}

TEST_F(StoreCommands, wrong_use_is_one_line_and_the_right_exit_code) {
  ASSERT_TRUE(write_file(folder_.file("text"), "not a store at all").ok());
  ASSERT_TRUE(write_file(folder_.file("empty"), "").ok());
  for (const std::string command : {"inspect", "export", "validate", "query --at 1,1,1"}) {
    expect_failure(command + " missing.pvs", 2, "missing.pvs");
    expect_failure(command + " .", 2, ".: cannot be read");
    expect_failure(command + " text", 3, "text: is no .pvs store");
    expect_failure(command + " empty", 3, "empty: is no .pvs store");
    expect_failure(command, 1, "required");
  }
  expect_failure("diff tiny.pvs missing.pvs", 2, "missing.pvs");
  expect_failure("diff tiny.pvs", 1, "required");
  expect_failure("query tiny.pvs", 1, "--at");
  expect_failure("query tiny.pvs --at 1,2", 1, "--at");
  expect_failure("query tiny.pvs --at 1,2,x", 1, "--at");
  expect_failure("query tiny.pvs --at 100,2,-3", 3, "no cell holds 100,2,-3");
  expect_failure("query tiny.pvs --at nan,2,3", 3, "no cell holds");
  expect_failure("export tiny.pvs -o no/folder/x", 2, "no/folder/x");
  expect_failure("export tiny.pvs -o .", 2, "is no plain file");
  expect_failure("inspect tiny.pvs >/dev/full", 2, "standard output");
  expect_failure("inpsect tiny.pvs", 1, "no such command: inpsect");
}

TEST_F(StoreCommands, another_version_of_the_format_is_not_supported) {
  std::string bytes = *read_file(folder_.file("tiny.pvs"));
  ++bytes[8];
  ASSERT_TRUE(write_file(folder_.file("new.pvs"), bytes).ok());
  expect_failure("inspect new.pvs", 5, "version");
}

TEST_F(StoreCommands, validate_names_the_damage_and_its_offset) {
  const std::string bytes = *read_file(folder_.file("tiny.pvs"));
  ASSERT_TRUE(write_file(folder_.file("cut.pvs"), bytes.substr(0, bytes.size() - 9)).ok());
  expect_failure("validate cut.pvs", 3,
                 "truncated: its end is missing at byte " + std::to_string(bytes.size() - 9));
  std::string damaged = bytes;
  damaged[bytes.find("house")] ^= 1;
  ASSERT_TRUE(write_file(folder_.file("damaged.pvs"), damaged).ok());
  expect_failure("validate damaged.pvs", 3,
                 "damaged: the names of objects at byte " + std::to_string(bytes.find("house")));
}

TEST_F(StoreCommands, settings_come_from_flag_then_environment_then_file) {
  ASSERT_TRUE(write_file(folder_.file("set.toml"), "[inspect]\njson = true\n").ok());
  EXPECT_EQ(run("inspect tiny.pvs --config set.toml").out[0], '{');
  EXPECT_EQ(run("inspect tiny.pvs").out[0], 't');
  ::setenv("PVSFARM_JSON", "false", 1);
  EXPECT_EQ(run("inspect tiny.pvs --config set.toml").out[0], 't');
  EXPECT_EQ(run("inspect tiny.pvs --config set.toml --json").out[0], '{');
  ::unsetenv("PVSFARM_JSON");
  ASSERT_TRUE(write_file(folder_.file("set.toml"), "[inspect]\njsno = true\n").ok());
  expect_failure("inspect tiny.pvs --config set.toml", 1, "jsno");
  expect_failure("inspect tiny.pvs --config none.toml", 2, "none.toml");
}

}  // namespace
}  // namespace pvsfarm
