// The journal keeps what it committed, in order, and refuses what is not its own.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "coordinator/journal/journal.hpp"
#include "coordinator/journal/row_bytes.hpp"
#include "coordinator/merger/merger.hpp"

namespace pvsfarm {
namespace {

class JournalTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "journal-XXXXXX";
    folder_ = mkdtemp(pattern.data());
    path_ = folder_ + "/out.pvs.journal";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static JournalBinding bake(const std::string& name) {
    return {DigestBuilder().add(name).finish(), name};
  }
  static ResultRow row(const CellKey& key, std::uint32_t hidden) {
    VisibleSet set = VisibleSet::all(64);
    set.remove_range(hidden, 64 - hidden);
    VisibleSet seen = VisibleSet::none(64);
    if (hidden < 60) {
      seen = VisibleSet::all(64);
      seen.remove_range(0, hidden + 4);
    }
    CellStatistics statistics{.cpu_ms = 0.5 + hidden, .planes = hidden, .box_tests = 7};
    statistics.contradictions = hidden;
    statistics.methods[2] = {.seen_objects = 60 - hidden, .work = 1ull << 40, .cpu_ms = 0.25};
    return {key, encode(set), encode(seen), 1000ull + hidden, statistics};
  }
  static ResultRow row_with_hints(const CellKey& key, std::uint32_t hidden) {
    ResultRow out = row(key, hidden);
    out.hints = unknown_hints(64 - hidden);
    return out;
  }
  std::vector<ResultRow> rows(const Journal& journal) {
    std::vector<ResultRow> out;
    const Status status = journal.for_each([&](ResultRow r) {
      out.push_back(std::move(r));
      return Status();
    });
    EXPECT_TRUE(status.ok());
    return out;
  }

  std::string folder_, path_;
};

}  // namespace

TEST(RowBytes, no_byte_can_move_from_one_set_to_the_other) {
  const std::byte a{1}, b{2};
  const ResultRow left{.key = {0, 1}, .hidden = {a, b}},
      right{.key = {0, 1}, .hidden = {a}, .seen = {b}};
  EXPECT_NE(delta_digest(left), delta_digest(right));
}

TEST(RowBytes, statistics_cut_short_or_followed_by_more_are_refused) {
  CellStatistics statistics{.cpu_ms = 3.5, .planes = 4'000'000'000};
  statistics.methods[4] = {.hidden_triangles = ~0ull, .cpu_ms = 1e300};
  statistics.rounds = {{.method = Method::kImproved, .work = 7, .cpu_ms = 2}};
  std::vector<std::byte> bytes = encode(statistics);
  CellStatistics back;
  ASSERT_TRUE(decode_statistics(bytes, back));
  EXPECT_EQ(back.planes, 4'000'000'000u);
  EXPECT_TRUE(back.methods == statistics.methods);
  EXPECT_EQ(back.rounds, statistics.rounds);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_statistics(std::span(bytes).first(size), back)) << size;
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(decode_statistics(bytes, back));
  bytes.assign(bytes.size() - 1, std::byte{0xff});  // not a number, and numbers without an end
  EXPECT_FALSE(decode_statistics(bytes, back));
}

TEST_F(JournalTest, a_row_is_read_back_and_replaced_before_and_after_its_commit) {
  const auto journal = Journal::open(path_, bake("a")).value();
  const CellKey key{3, 1};
  EXPECT_FALSE(journal->read(key).value().has_value());
  ASSERT_TRUE(journal->append(row(key, 8)).ok());
  ASSERT_TRUE(journal->replace(row(key, 9)).ok());
  EXPECT_EQ(journal->row_count(), 1u);
  EXPECT_EQ(journal->read(key).value()->hidden, row(key, 9).hidden);
  ASSERT_TRUE(journal->commit().ok());
  EXPECT_EQ(rows(*journal)[0].hidden, row(key, 9).hidden);
  for (const std::uint32_t hidden : {10u, 11u}) {
    ASSERT_TRUE(journal->replace(row(key, hidden)).ok());
    EXPECT_EQ(journal->row_count(), 1u);
    EXPECT_EQ(journal->read(key).value()->hidden, row(key, hidden).hidden);
    EXPECT_EQ(journal->find(key).value(), delta_digest(row(key, hidden)));
  }
  EXPECT_EQ(journal->uncommitted(), 1u);
  ASSERT_TRUE(journal->commit().ok());
  EXPECT_EQ(journal->row_count(), 1u);
  const std::vector<ResultRow> all = rows(*journal);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].hidden, row(key, 11).hidden);
  EXPECT_EQ(all[0].statistics.planes, 11u);
}

TEST_F(JournalTest, rows_come_back_in_canonical_order) {
  const std::vector<CellKey> keys{{0, 1}, {0, 2}, {0, 4}, {0, 5}, {0, 3}, {1, 1}, {300, 1}};
  {
    auto journal = Journal::open(path_, bake("a")).value();
    for (std::size_t i = keys.size(); i-- > 0;) {
      const auto make = i % 2 == 0 ? row : row_with_hints;
      ASSERT_TRUE(journal->append(make(keys[i], static_cast<std::uint32_t>(i))).ok());
    }
    ASSERT_TRUE(journal->commit().ok());
  }
  const auto journal = Journal::open(path_, bake("a")).value();
  EXPECT_EQ(journal->row_count(), keys.size());
  const std::vector<ResultRow> back = rows(*journal);
  ASSERT_EQ(back.size(), keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    EXPECT_EQ(back[i].key, keys[i]);
    const ResultRow written = row(keys[i], static_cast<std::uint32_t>(i));
    EXPECT_EQ(back[i].hidden, written.hidden);
    EXPECT_EQ(back[i].seen, written.seen);
    EXPECT_EQ(back[i].hints.size(), i % 2 == 0 ? 0 : 2 * (64 - i));
    EXPECT_EQ(back[i].point_triangles, written.point_triangles);
    EXPECT_EQ(back[i].statistics.cpu_ms, 0.5 + static_cast<double>(i));
    EXPECT_EQ(back[i].statistics.box_tests, 7u);
    EXPECT_EQ(back[i].statistics.contradictions, i);
    EXPECT_TRUE(back[i].statistics.methods == written.statistics.methods);
  }
}

TEST_F(JournalTest, what_was_not_committed_is_gone) {
  {
    auto journal = Journal::open(path_, bake("a")).value();
    ASSERT_TRUE(journal->append(row({0, 1}, 1)).ok());
    ASSERT_TRUE(journal->commit().ok());
    ASSERT_TRUE(journal->append(row({1, 1}, 2)).ok());
    EXPECT_EQ(journal->uncommitted(), 1u);
    EXPECT_TRUE(journal->find({1, 1}).value().has_value());
  }
  const auto journal = Journal::open(path_, bake("a")).value();
  EXPECT_TRUE(journal->find({0, 1}).value().has_value());
  EXPECT_FALSE(journal->find({1, 1}).value().has_value());
}

TEST_F(JournalTest, another_bakes_journal_is_refused_untouched) {
  {
    auto journal = Journal::open(path_, bake("a")).value();
    ASSERT_TRUE(journal->append(row({0, 1}, 1)).ok());
    ASSERT_TRUE(journal->commit().ok());
  }
  const auto refused = Journal::open(path_, bake("b"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(refused.error().text.find("--fresh"), std::string::npos);
  EXPECT_EQ(Journal::open(path_, bake("a")).value()->row_count(), 1u);
  ASSERT_TRUE(Journal::discard(path_).ok());
  EXPECT_EQ(Journal::open(path_, bake("b")).value()->row_count(), 0u);
}

TEST_F(JournalTest, a_second_coordinator_is_told_that_the_output_is_in_use) {
  const auto journal = Journal::open(path_, bake("a")).value();
  const auto second = Journal::open(path_, bake("a"));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::kIo);
  EXPECT_NE(second.error().text.find("in use"), std::string::npos);
}

TEST_F(JournalTest, a_file_that_is_no_journal_is_refused_untouched) {
  const std::string text =
      "my precious notes, longer than a header of an SQLite database is: " + std::string(200, 'x');
  std::ofstream(path_) << text;
  const auto refused = Journal::open(path_, bake("a"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  std::ifstream in(path_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), text);
}

TEST_F(JournalTest, a_truncated_journal_never_gives_wrong_rows) {
  {
    auto journal = Journal::open(path_, bake("a")).value();
    for (std::uint32_t i = 0; i < 500; ++i) ASSERT_TRUE(journal->append(row({i, 1}, i % 60)).ok());
    ASSERT_TRUE(journal->commit().ok());
  }
  const auto size = std::filesystem::file_size(path_);
  std::filesystem::resize_file(path_, size / 2 / 4096 * 4096);
  const auto opened = Journal::open(path_, bake("a"));
  if (!opened.ok()) return;
  const Status read = (*opened)->for_each([](const ResultRow&) { return Status(); });
  EXPECT_FALSE(read.ok());
}

TEST_F(JournalTest, a_folder_that_is_missing_is_an_io_error_naming_it) {
  const auto refused = Journal::open(folder_ + "/no/such/out.pvs.journal", bake("a"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kIo);
  EXPECT_NE(refused.error().text.find("/no/such/"), std::string::npos);
}

TEST_F(JournalTest, a_removed_journal_leaves_nothing_behind) {
  auto journal = Journal::open(path_, bake("a")).value();
  ASSERT_TRUE(journal->append(row({0, 1}, 1)).ok());
  ASSERT_TRUE(journal->commit().ok());
  EXPECT_TRUE(journal->remove().ok());
  journal.reset();
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

// A crash may leave it, where its journal was discarded.
TEST_F(JournalTest, what_a_discarded_journal_left_behind_is_not_read_as_the_next_ones) {
  const std::string wal = path_ + "-wal", kept = folder_ + "/kept";
  {
    auto journal = Journal::open(path_, bake("a")).value();
    ASSERT_TRUE(journal->append(row({0, 1}, 1)).ok());
    ASSERT_TRUE(journal->commit().ok());
    std::filesystem::copy(wal, kept);
  }
  ASSERT_GT(std::filesystem::file_size(kept), 0u);
  std::filesystem::remove(path_);
  std::filesystem::rename(kept, wal);
  const auto journal = Journal::open(path_, bake("b"));
  ASSERT_TRUE(journal.ok()) << journal.error().text;
  EXPECT_EQ((*journal)->row_count(), 0u);
}

TEST_F(JournalTest, a_journal_that_another_process_has_is_not_discarded) {
  auto journal = Journal::open(path_, bake("a")).value();
  ASSERT_TRUE(journal->append(row({0, 1}, 1)).ok());
  ASSERT_TRUE(journal->commit().ok());
  const Status discarded = Journal::discard(path_);
  ASSERT_FALSE(discarded.ok());
  EXPECT_NE(discarded.error().text.find("in use"), std::string::npos);
  journal.reset();
  EXPECT_EQ(Journal::open(path_, bake("a")).value()->row_count(), 1u);
}

TEST_F(JournalTest, the_kernel_is_remembered) {
  {
    auto journal = Journal::open(path_, bake("a")).value();
    EXPECT_EQ(journal->kernel().value(), "");
    ASSERT_TRUE(journal->set_kernel("algorithm 1, Mesa 22.3.6").ok());
    EXPECT_EQ(journal->kernel().value(), "algorithm 1, Mesa 22.3.6");
    ASSERT_TRUE(journal->commit().ok());
  }
  EXPECT_EQ(Journal::open(path_, bake("a")).value()->kernel().value(), "algorithm 1, Mesa 22.3.6");
}

TEST_F(JournalTest, the_merger_merges_once_and_tells_copies_from_contradictions) {
  Tree tree({VisibleSet::all(64), std::vector<std::uint32_t>(64, 1)},
            {Cell::aligned({{0, 0, 0}, {1, 1, 1}})}, {});
  auto journal = Journal::open(path_, bake("a")).value();
  Merger merger(tree, *journal);
  ResultRow foreign = row({0, 1}, 3);
  foreign.hidden = encode(VisibleSet::all(65));
  EXPECT_FALSE(merger.apply(foreign).ok());
  ResultRow two_minds = row({0, 1}, 3);
  two_minds.seen = encode(VisibleSet::all(64));  // three of them are hidden
  EXPECT_EQ(merger.apply(two_minds).error().kind, ErrorKind::kInvalidInput);
  for (const std::size_t count : {0, 60, 62}) {
    ResultRow misfit = row_with_hints({0, 1}, 3);
    misfit.hints.resize(2 * count + 1);
    EXPECT_EQ(merger.apply(misfit).error().kind, ErrorKind::kInvalidInput) << count;
  }
  ResultRow blind = row({0, 1}, 3);
  blind.seen.clear();
  EXPECT_EQ(merger.apply(blind).error().kind, ErrorKind::kInvalidInput);
  EXPECT_EQ(merger.apply(row({0, 1}, 3)).value().outcome, MergeOutcome::kMerged);
  EXPECT_EQ(merger.apply(row({0, 1}, 3)).value().outcome, MergeOutcome::kDuplicate);
  EXPECT_EQ(merger.apply(row({0, 1}, 4)).value().outcome, MergeOutcome::kMismatch);
  ResultRow slower = row({0, 1}, 3);
  slower.statistics = {};
  EXPECT_EQ(merger.apply(slower).value().outcome, MergeOutcome::kDuplicate);
  ResultRow seeing_less = row({0, 1}, 3);
  seeing_less.seen = encode(VisibleSet::none(64));
  EXPECT_EQ(merger.apply(seeing_less).value().outcome, MergeOutcome::kMismatch);
  ResultRow other_point = row({0, 1}, 3);
  other_point.point_triangles += 1;
  EXPECT_EQ(merger.apply(other_point).value().outcome, MergeOutcome::kMismatch);
  EXPECT_EQ(merger.apply(row_with_hints({0, 1}, 3)).value().outcome, MergeOutcome::kMismatch);
  EXPECT_EQ(merger.apply(row({0, 2}, 3)).value().outcome, MergeOutcome::kStale);
  EXPECT_EQ(merger.apply(row({9, 1}, 3)).value().outcome, MergeOutcome::kStale);
  EXPECT_EQ(journal->row_count(), 1u);
}

// Whether a cell is split depends on what a witness saw: on the row, and on nothing that is lost.
TEST_F(JournalTest, a_resumed_hierarchy_is_split_where_the_first_one_was) {
  const auto make_tree = [] {
    return Tree({VisibleSet::all(64), std::vector<std::uint32_t>(64, 10)},
                {Cell::aligned({{0, 0, 0}, {16, 16, 1}})},
                {.budget_triangles = 300, .min_cell_m = 1});
  };
  const auto row_of = [](const CellKey& key, const Tree& tree) {
    VisibleSet hidden = VisibleSet::none(64), seen = tree.decoded_parent(key);
    const std::uint64_t points = key.path % 3 == 0 ? 640 : key.path % 3 == 1 ? 299 : 0;
    return ResultRow{key, encode(hidden), encode(seen), points, {}};
  };
  Tree tree = make_tree();
  std::map<LeafReason, int> reasons;
  for (int cells = 0; cells < 25 && tree.open_count() > 0; ++cells) {
    auto journal = Journal::open(path_, bake("a")).value();
    Tree resumed = make_tree();
    Merger merger(resumed, *journal);
    ASSERT_TRUE(journal
                    ->for_each([&](const ResultRow& row) {
                      const auto answer = merger.replay(row);
                      return answer.ok() ? Status() : Status(answer.error());
                    })
                    .ok());
    ASSERT_EQ(resumed.open_cells(), tree.open_cells());
    const CellKey next = tree.open_cells()[tree.open_count() / 2];
    ASSERT_TRUE(merger.apply(row_of(next, resumed)).ok());
    ASSERT_TRUE(journal->commit().ok());
    const ResultRow row = row_of(next, tree);
    ++reasons[tree.merge(decode_row(row, 64).value()).value().reason];
  }
  EXPECT_GT(reasons[LeafReason::kNone], 3);
  EXPECT_GT(reasons[LeafReason::kPointOverBudget], 3);
}

}  // namespace pvsfarm
