// `pvsfarm audit` on a small city: what is right passes, what is planted or damaged is found.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/pvs/store_reader.hpp"
#include "common/pvs/store_writer.hpp"
#include "tests/farm/process.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kPvsfarm = PVSFARM_BIN_DIR "/pvsfarm";

double apparent_size(const Box& box, const Vec3& eye) {
  const Vec3 half = box.size() * 0.5, away = (box.lo + box.hi) * 0.5 - eye;
  return dot(half, half) / dot(away, away);
}

class AuditCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string pattern = testing::TempDir() + "audit-XXXXXX";
    folder_ = mkdtemp(pattern.data());
    for (const auto& [seed, name] : {std::pair{"1", "/city.obj"}, std::pair{"2", "/other.obj"}})
      run({"generate", "city", "--blocks", "1", "--cell-size", "8", "--seed", seed, "-o",
           folder_ + name},
          0);
    run({"bake", folder_ + "/city.obj", "--cells", folder_ + "/city.cells.json", "--tags",
         folder_ + "/city.tags.json", "--planes", "2", "--resolution", "128", "-o",
         folder_ + "/city.pvs"},
        0);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::vector<std::string> audit_command(const std::vector<std::string>& more,
                                                const std::string& store = "/city.pvs",
                                                const std::string& scene = "/city.obj") {
    std::vector<std::string> command{kPvsfarm,        "audit",  folder_ + store,
                                     folder_ + scene, "--tags", folder_ + "/city.tags.json"};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  // What it prints, on stdout; on stderr where it prints nothing there.
  static std::string run(std::vector<std::string> words, int code) {
    if (words[0] != kPvsfarm) words.insert(words.begin(), kPvsfarm);
    Process process(words, folder_ + "/log");
    EXPECT_EQ(process.wait(), code) << process.err();
    return process.out().empty() ? process.err() : process.out();
  }

  // The report of an audit with as much time as `enough` of it takes: a machine may have other
  // work.
  static Json audited(std::vector<std::string> more, const std::string& store,
                      const std::function<bool(const Json&)>& enough) {
    more.insert(more.end(), {"--json", "--seconds", "3"});
    Json report;
    for (const char* seconds : {"3", "12", "48"}) {
      more.back() = seconds;
      Process process(audit_command(more, store), folder_ + "/log");
      const int code = process.wait();
      EXPECT_TRUE(code == 0 || code == 7) << process.err();
      if (code != 0 && code != 7) break;
      report = Json::parse(process.out());
      EXPECT_EQ(code == 7, !report["violations"].empty());
      if (enough(report)) break;
    }
    return report;
  }

  // A copy that lacks, in one cell, the object of the certified ones that looks largest from there.
  struct Damage {
    std::uint32_t cell = 0;
    std::string object;
  };
  static Damage write_damaged(const std::string& name) {
    auto store = StoreReader::open(folder_ + "/city.pvs").value();
    const auto objects = store->objects().value();
    auto writer = StoreWriter::create(folder_ + name, store->header(), objects).value();
    Damage damage{.cell = store->node_count() / 2, .object = ""};
    for (std::uint32_t i = 0; i < store->node_count(); ++i) {
      const StoredNode node = store->node(i).value();
      StoredSets sets = store->sets(i).value();
      if (i == damage.cell) {
        std::optional<ObjectId> largest;
        const auto size = [&](ObjectId id) {
          return apparent_size(objects[index_of(id)].box, node.cell.center());
        };
        sets.seen.for_each([&](ObjectId id) {
          if (!largest || size(id) > size(*largest)) largest = id;
        });
        damage.object = objects[index_of(largest.value())].name;
        sets.visible.remove(*largest);
        sets.seen.remove(*largest);
      }
      EXPECT_TRUE(writer
                      ->add({.key = node.key,
                             .root_id = node.root_id,
                             .leaf = node.leaf,
                             .reason = node.reason,
                             .quarantined = node.quarantined,
                             .cell = node.cell,
                             .visible = sets.visible,
                             .seen = sets.seen})
                      .ok());
    }
    EXPECT_TRUE(writer->finish().ok());
    return damage;
  }

  static std::string folder_;
};
std::string AuditCommand::folder_;

}  // namespace

TEST_F(AuditCommand, a_store_as_it_was_baked_passes) {
  const Json report = audited({}, "/city.pvs", [](const Json& so_far) {
    return so_far["leaves_reached"] == so_far["leaves"] && so_far["passes"] >= 1;
  });
  EXPECT_TRUE(report["violations"].empty());
  EXPECT_EQ(report["leaves_reached"], report["leaves"]);
  EXPECT_GE(report["passes"], 1);
  EXPECT_EQ(report["given_up"], 0);
  EXPECT_GT(report["rays"], 10'000);
  EXPECT_EQ(report["tightest"].size(), 5u);
  EXPECT_LE(report["tightest"][0]["gap"], report["loosest"][4]["gap"]);
}

TEST_F(AuditCommand, every_planted_object_is_found_and_named) {
  const Json report = audited({"--plant", "3"}, "/city.pvs",
                              [](const Json& so_far) { return so_far["violations"].size() == 3; });
  ASSERT_EQ(report["planted"].size(), 3u);
  for (const Json& planted : report["planted"]) {
    EXPECT_TRUE(planted["found"]);
    const bool told = std::any_of(
        report["violations"].begin(), report["violations"].end(), [&](const Json& violation) {
          return violation["cell"] == planted["cell"] && violation["object"] == planted["object"];
        });
    EXPECT_TRUE(told) << planted;
  }
  // Nothing else is wrong.
  EXPECT_EQ(report["violations"].size(), 3u);
}

TEST_F(AuditCommand, one_object_missing_from_one_cell_is_found) {
  const Damage damage = write_damaged("/damaged.pvs");
  const Json report =
      audited({}, "/damaged.pvs", [](const Json& so_far) { return !so_far["violations"].empty(); });
  ASSERT_EQ(report["violations"].size(), 1u);
  const Json& violation = report["violations"][0];
  EXPECT_EQ(violation["cell"], damage.cell);
  EXPECT_EQ(violation["object"], damage.object);
  // The eye is in that cell.
  auto store = StoreReader::open(folder_ + "/damaged.pvs").value();
  const Cell cell = store->node(damage.cell)->cell;
  for (int a = 0; a < 3; ++a) {
    EXPECT_GE(violation["eye"][static_cast<std::size_t>(a)], cell.lo[a] - 1e-6);
    EXPECT_LE(violation["eye"][static_cast<std::size_t>(a)], cell.hi[a] + 1e-6);
  }
  // For people, the same in a line.
  const std::string text = run(audit_command({"--seconds", "9"}, "/damaged.pvs"), 7);
  EXPECT_NE(text.find("VIOLATION: cell " + std::to_string(damage.cell) + " (root "),
            std::string::npos)
      << text;
  EXPECT_NE(text.find(damage.object), std::string::npos);
}

TEST_F(AuditCommand, another_scene_is_refused) {
  const std::string text = run(audit_command({"--seconds", "5"}, "/city.pvs", "/other.obj"), 3);
  EXPECT_NE(text.find("not the scene of"), std::string::npos) << text;
}

TEST_F(AuditCommand, ctrl_c_reports_what_was_done_so_far) {
  Process audit(audit_command({"--seconds", "90", "--json"}), folder_ + "/long");
  std::this_thread::sleep_for(std::chrono::seconds(2));
  audit.send(SIGINT);
  ASSERT_EQ(audit.wait(20), 130) << audit.err();
  const Json report = Json::parse(audit.out());
  EXPECT_TRUE(report["interrupted"]);
  EXPECT_TRUE(report["violations"].empty());
}

}  // namespace pvsfarm
