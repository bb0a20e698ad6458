// Journals that are foreign, cut short, or of another bake: refused with the way out, and not a
// byte of them is changed. What a shortened log still holds is right.
#include <filesystem>
#include <map>

#include "coordinator/journal/journal.hpp"
#include "tests/farm/durable_farm.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;  // by name

Files files_in(const std::string& folder) {
  Files files;
  for (const auto& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] = read_file(entry.path().string()).value();
  return files;
}

class JournalRefusals : public DurableFarm {
 protected:
  void SetUp() override {
    DurableFarm::SetUp();
    journal_ = out_ + ".journal";
  }
  // A bake that was stopped half way.
  void half_a_bake() const {
    InstantWorkers workers(endpoint(), work(1));
    const auto coordinator = coordinate();
    ASSERT_TRUE(wait_until(60, [&] { return workers.figures().acknowledged > cells_ / 4; }));
    coordinator->send(SIGINT);
    ASSERT_EQ(coordinator->wait(60), 130) << coordinator->err();
  }
  // The way out that it names; "" if it was not refused so.
  std::string refusal(std::vector<std::string> words) const {
    const Files before = files_in(fs::path(out_).parent_path().string());
    Process refused(words, folder_ + "/refused");
    EXPECT_EQ(refused.wait(60), 3) << refused.err();
    EXPECT_TRUE(before == files_in(fs::path(out_).parent_path().string()));
    const std::string said = refused.err();
    const std::size_t at = said.find("--fresh");
    return at == std::string::npos ? "" : said.substr(said.find(": ") + 2);
  }
  static ResultRow row(std::uint32_t number) {
    return {.key = {number, 1}, .hidden = std::vector<std::byte>(number % 500), .seen = {}};
  }

  std::string journal_;
};

}  // namespace

TEST_F(JournalRefusals, what_is_not_this_bakes_is_refused_in_plain_words) {
  half_a_bake();
  const std::string good = read_file(journal_).value();
  const std::vector<std::string> same = command(out_, endpoint());
  std::vector<std::string> other_scene = same;
  other_scene[2] = folder_ + "/other.obj";
  std::string obj = read_file(suite_ + "/city.obj").value();
  obj.replace(obj.find("\nv ") + 3, 1, "1");
  ASSERT_TRUE(write_file(other_scene[2], obj).ok());
  int refused = 0;
  const auto expect = [&](const std::vector<std::string>& words, const std::string& text) {
    const std::string said = refusal(words);
    EXPECT_NE(said.find(text), std::string::npos) << said;
    ++refused;
  };
  expect(command(out_, endpoint(), {"--planes", "1"}), "of another bake (its settings");
  expect(other_scene, "of another bake (another scene");
  const auto with = [&](const std::string& bytes) {
    EXPECT_TRUE(write_file(journal_, bytes).ok());
    return same;
  };
  expect(with("notes of mine\n"), "not a journal of pvsfarm");
  expect(with(""), "not a journal of pvsfarm");
  expect(with(good.substr(0, good.size() / 2)), "cut short");
  std::string foreign = good;
  foreign.replace(68, 4, "GPKG");
  expect(with(foreign), "another program");

  // Beside it one can bake all the same; and with the right one go on.
  std::vector<std::string> passing = command(out_, endpoint(), {"--no-resume"});
  {
    InstantWorkers workers(endpoint(), work(0));
    Process coordinator(passing, folder_ + "/passing");
    EXPECT_EQ(coordinator.wait(60), 0) << coordinator.err();
  }
  EXPECT_TRUE(read_file(journal_).value() == foreign);
  EXPECT_TRUE(read_file(out_).value() == golden_);
  EXPECT_FALSE(fs::exists(out_ + ".passing"));
  ASSERT_TRUE(write_file(journal_, good).ok());
  InstantWorkers workers(endpoint(), work(0));
  const auto last = coordinate();
  EXPECT_EQ(last->wait(60), 0) << last->err();
  EXPECT_LT(workers.figures().acknowledged, cells_);
  EXPECT_TRUE(golden());
  record({.row = 27,
          .what = "journals of another scene, other settings, other programs, or cut short",
          .asked = "refused, nothing overwritten",
          .reached = std::to_string(refused) + " of 6 refused, nothing overwritten",
          .held = !HasFailure()});
}

TEST_F(JournalRefusals, cut_at_any_length_it_is_refused_untouched) {
  const JournalBinding bake{digest_of({}), "test"};
  {
    auto journal = Journal::open(journal_, bake).value();
    for (std::uint32_t i = 0; i < 300; ++i) ASSERT_TRUE(journal->append(row(i)).ok());
    ASSERT_TRUE(journal->commit().ok());
  }
  const std::string good = read_file(journal_).value();
  ASSERT_GT(good.size(), 40'000u);
  std::size_t cuts = 0, refused = 0;
  for (std::size_t size = 0; size < good.size(); size += full_counts() ? 61 : 977) {
    ASSERT_TRUE(write_file(journal_, good.substr(0, size)).ok());
    const auto opened = Journal::open(journal_, bake);
    ++cuts;
    refused += !opened && opened.error().kind == ErrorKind::kInvalidInput ? 1 : 0;
    EXPECT_EQ(read_file(journal_).value().size(), size);
    EXPECT_FALSE(fs::exists(journal_ + "-wal"));
  }
  EXPECT_EQ(refused, cuts);
  record({.row = 27,
          .what = "journals cut short at some length",
          .asked = "refused, nothing overwritten",
          .reached = std::to_string(refused) + " of " + std::to_string(cuts),
          .held = refused == cuts && !HasFailure()});
}

TEST_F(JournalRefusals, a_log_cut_at_any_length_gives_right_rows_or_none) {
  const JournalBinding bake{digest_of({}), "test"};
  std::string main, log;
  {
    auto journal = Journal::open(journal_, bake).value();
    for (std::uint32_t i = 0; i < 100; ++i) {
      ASSERT_TRUE(journal->append(row(i)).ok());
      if (i % 10 != 9) continue;
      ASSERT_TRUE(journal->commit().ok());
    }
    main = read_file(journal_).value();
    log = read_file(journal_ + "-wal").value();
  }
  ASSERT_GT(log.size(), 20'000u);
  for (std::size_t size = 0; size < log.size(); size += full_counts() ? 211 : 2099) {
    fs::remove(journal_ + "-wal");
    ASSERT_TRUE(write_file(journal_, main).ok());
    ASSERT_TRUE(write_file(journal_ + "-wal", log.substr(0, size)).ok());
    const auto journal = Journal::open(journal_, bake);
    ASSERT_TRUE(journal.ok()) << journal.error().text;
    std::uint32_t next = 0;
    const Status read = (*journal)->for_each([&](const ResultRow& found) {
      EXPECT_EQ(delta_digest(found), delta_digest(row(next)));
      ++next;
      return Status();
    });
    EXPECT_TRUE(read.ok());
    EXPECT_EQ(next % 10, 0u);  // whole commits
  }
}

}  // namespace pvsfarm
