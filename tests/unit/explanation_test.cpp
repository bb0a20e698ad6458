// Which cells are asked about so that a store's answer is explained, and what is said of it. The
// worker is a fake that hides what the test says it hides.
#include "coordinator/cli/explanation.hpp"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "coordinator/cli/explain_text.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kObjects = 5;
constexpr ObjectId kSeen{0}, kHiddenAtRoot{1}, kHiddenLow{2}, kHiddenMerged{3};

VisibleSet only(std::initializer_list<std::uint32_t> ids) {
  VisibleSet set = VisibleSet::all(kObjects);
  for (std::uint32_t i = 0; i < kObjects; ++i)
    if (std::find(ids.begin(), ids.end(), i) == ids.end()) set.remove(ObjectId{i});
  return set;
}

// A root 8 m long and its halves; the high one was split once more and merged again. Object 4 only
// occludes.
class Explained : public testing::Test {
 protected:
  void SetUp() override {
    sample_.header.up = UpAxis::kY;
    sample_.names = {"house", "shed", "barn", "byre", "hedge"};
    for (std::uint32_t i = 0; i < kObjects; ++i)
      sample_.objects.push_back({.name = sample_.names[i],
                                 .box = {{20, 0, 0}, {21, 1, 3}},
                                 .triangle_count = 12,
                                 .occludee = i != 4});
    StoreNode node;
    node.cell = Cell::aligned({{0, 0, 1}, {8, 2, 2}});
    node.seen = VisibleSet::none(kObjects);
    node.leaf = false;
    node.visible = only({0, 2, 3});
    sample_.nodes.push_back(node);
    const auto [low, high] = split(node.cell, 0);
    for (int half = 0; half < 2; ++half) {
      StoreNode child = node;
      child.key = node.key.child(half);
      child.cell = half == 0 ? low : high;
      child.leaf = true;
      child.visible = half == 0 ? only({0, 3}) : only({0, 2});
      sample_.nodes.push_back(child);
    }
    ASSERT_TRUE(sample_.write(folder_.file("s.pvs")));
    store_ = StoreReader::open(folder_.file("s.pvs")).value();
  }

  Result<Explanation> explain(std::uint32_t cell, ObjectId object) {
    return explain_in_store(
        *store_, {.budget_triangles = 10, .min_cell_m = 1}, cell, object,
        [this](const std::vector<ExplainQuestion>& questions) { return answers(questions); });
  }
  Result<std::vector<ExplainFinding>> answers(const std::vector<ExplainQuestion>& questions) {
    std::vector<ExplainFinding> findings;
    for (const ExplainQuestion& question : questions) {
      asked_.push_back(question);
      ExplainFinding finding{.visible = question.parent};
      if (hides_.count(question.key.path) != 0) {
        finding.verdict = Verdict::kHidden;
        finding.visible.remove(question.object);
        finding.lines_checked = 512;
        finding.parts = {{.box = {{20, 0, 0}, {21, 1, 3}},
                          .plane = {.away = {0, 1, 0}, .distance_m = 12.5, .resolution_px = 256},
                          .pixels = 400,
                          .covered = 1,
                          .by_lines = by_lines_,
                          .blockers = {{{ObjectId{0}}, 0.75}, {{ObjectId{2}, ObjectId{4}}, 0.25}}}};
        if (by_lines_) finding.method = Method::kSweep;
      } else if (seen_) {
        finding.verdict = Verdict::kSeen;
        finding.method = Method::kAimedRays;
        finding.line = {{1, 1, 1.5}, {20, 1, 1.5}};
        finding.passed = {{ObjectId{4}, 0.125, {9, 1, 1.5}}};
      }
      findings.push_back(std::move(finding));
    }
    return findings;
  }
  std::string text(const Explanation& e) {
    return text_of(e, UpAxis::kY, store_->objects().value());
  }

  TempFolder folder_;
  SampleStore sample_;
  std::unique_ptr<StoreReader> store_;
  std::set<std::uint64_t> hides_;  // paths of the cells whose evaluation hides the object
  bool seen_ = false;
  bool by_lines_ = false;
  std::vector<ExplainQuestion> asked_;
};

TEST_F(Explained, WhatTheRootHidesIsAskedOfTheRoot) {
  hides_ = {1};
  const auto e = explain(2, kHiddenAtRoot);
  ASSERT_TRUE(e.ok());
  ASSERT_EQ(asked_.size(), 1u);
  EXPECT_EQ(asked_[0].key.path, 1u);
  EXPECT_EQ(asked_[0].parent, only({0, 1, 2, 3}));  // every occludee
  EXPECT_TRUE(e->agrees);
  EXPECT_FALSE(e->visible);
  EXPECT_EQ(e->node.index, 0u);
  EXPECT_EQ(e->asked.index, 2u);
  EXPECT_NE(
      text(*e).find("shed is hidden from cell 2.\nThe proof is that of cell 0, 1 level above"),
      std::string::npos)
      << text(*e);
  EXPECT_NE(text(*e).find("  75.0 %  house\n  25.0 %  barn and hedge, joined\n"),
            std::string::npos);
  // Along y inside is along -z of a y-up file.
  EXPECT_NE(text(*e).find("the cell's -z face, on a plane 12.5 m before it"), std::string::npos);
}

TEST_F(Explained, WhatTheLeafHidesIsAskedOfTheLeafAgainstWhatItsParentLeft) {
  hides_ = {2};
  const auto e = explain(1, kHiddenLow);
  ASSERT_TRUE(e.ok());
  ASSERT_EQ(asked_.size(), 2u);
  EXPECT_EQ(asked_[0].key.path, 1u);
  EXPECT_EQ(asked_[1].key.path, 2u);
  EXPECT_EQ(asked_[1].parent, only({0, 1, 2, 3}));  // the root hides nothing here
  EXPECT_EQ(asked_[1].cell, sample_.nodes[1].cell);
  EXPECT_EQ(e->node.index, 1u);
}

TEST_F(Explained, WhatAMergedLeafHidesIsAskedOfItsHalves) {
  hides_ = {6, 14, 15};  // the low half of the high half, and both quarters of its high half
  const auto e = explain(2, kHiddenMerged);
  ASSERT_TRUE(e.ok());
  EXPECT_TRUE(e->agrees);
  ASSERT_EQ(e->pieces.size(), 3u);
  EXPECT_EQ(e->pieces[0].key.path, 6u);
  EXPECT_EQ(e->pieces[1].key.path, 14u);
  EXPECT_EQ(e->pieces[2].key.path, 15u);
  EXPECT_EQ(e->pieces[0].cell.lo.x, 4);
  EXPECT_EQ(e->pieces[0].cell.hi.x, 6);
  EXPECT_EQ(e->pieces[2].cell.hi.x, 8);
  EXPECT_EQ(asked_.size(), 6u);  // the root, the leaf, its halves, the high one's halves
  EXPECT_NE(text(*e).find("merged of smaller ones"), std::string::npos);
  EXPECT_NE(text(*e).find("Part 3 of the cell"), std::string::npos);
}

// The set of an inner node is the union of its leaves', and holds less than its own evaluation
// left.
TEST_F(Explained, WhatAllLeavesOfAnInnerCellHideIsAskedOfItsParts) {
  hides_ = {2, 6, 14, 15};
  const auto e = explain(0, kHiddenAtRoot);
  ASSERT_TRUE(e.ok());
  EXPECT_FALSE(e->visible);
  EXPECT_TRUE(e->agrees);
  EXPECT_EQ(e->node.index, 0u);
  ASSERT_EQ(e->pieces.size(), 4u) << "the low half, and what the high one was merged of";
  EXPECT_EQ(e->pieces[0].key.path, 2u);
  EXPECT_EQ(e->pieces[1].key.path, 6u);
  EXPECT_EQ(e->pieces[3].key.path, 15u);
  EXPECT_EQ(asked_[1].parent, only({0, 1, 2, 3})) << "what the root's own evaluation left";
  EXPECT_NE(text(*e).find("The cell was split: its parts have proofs of their own"),
            std::string::npos)
      << text(*e);
}

TEST_F(Explained, WhatALeafOfAnInnerCellMaySeeIsExplainedByTheInnerCell) {
  hides_ = {2};
  seen_ = true;
  const auto e = explain(0, kHiddenLow);  // in the high leaf's set alone
  ASSERT_TRUE(e.ok());
  EXPECT_TRUE(e->visible);
  EXPECT_TRUE(e->agrees);
  EXPECT_EQ(asked_.size(), 1u);
  EXPECT_EQ(e->pieces[0].finding.verdict, Verdict::kSeen);
}

TEST_F(Explained, ACertificateWithoutProjectionsNamesWhoBlocksItsLines) {
  hides_ = {1};
  by_lines_ = true;
  const std::string said = text(*explain(2, kHiddenAtRoot));
  EXPECT_NE(said.find("touch 400 pixels of a map (sweep).\n"
                      "They are all covered. Of lines from the cell to it, these block all, "
                      "whoever is met first:\n  75.0 %  house\n"),
            std::string::npos)
      << said;
}

TEST_F(Explained, WhatNoEvaluationHidesIsADisagreement) {
  const auto e = explain(2, kHiddenMerged);
  ASSERT_TRUE(e.ok());
  EXPECT_FALSE(e->agrees);
  EXPECT_EQ(e->pieces.size(), 1u);
  EXPECT_NE(text(*e).find("The store says hidden, this evaluation does not"), std::string::npos);
  hides_ = {2};
  EXPECT_FALSE(explain(1, kSeen)->agrees);
}

TEST_F(Explained, ASeenObjectHasItsLineInTheFilesCoordinates) {
  seen_ = true;
  const auto e = explain(1, kSeen);
  ASSERT_TRUE(e.ok());
  EXPECT_TRUE(e->agrees && e->visible);
  EXPECT_EQ(text(*e),
            "house is seen from cell 1.\n"
            "A line of sight runs 19.0 m from (1,1.5,-1) to (20,1.5,-1), found by aimed-rays.\n"
            "It passes\n"
            "  0.125 m from hedge, at (9,1.5,-1)\n");
  const auto json = nlohmann::json::parse(json_of(*e, UpAxis::kY, store_->objects().value()));
  EXPECT_EQ(json.at("object").at("name"), "house");
  EXPECT_EQ(json.at("pieces").at(0).at("verdict"), "seen");
  EXPECT_EQ(json.at("pieces").at(0).at("line").at("eye"), nlohmann::json({1, 1.5, -1}));
  EXPECT_EQ(json.at("pieces").at(0).at("passed").at(0).at("clearance"), 0.125);
}

TEST_F(Explained, ACertificateThatLinesRefuteIsCalledWrong) {
  hides_ = {1};
  auto e = explain(0, kHiddenAtRoot);
  ASSERT_TRUE(e.ok());
  EXPECT_EQ(text(*e).find("WRONG"), std::string::npos);
  e->pieces[0].finding.unblocked = {{{1, 1, 1.5}, {20, 1, 1.5}}};
  EXPECT_NE(text(*e).find("WRONG: of 512 lines drawn to check it, 1 meet"), std::string::npos);
}

TEST_F(Explained, NamesAreFoundOrTheirLikesAreNamed) {
  EXPECT_EQ(object_named(*store_, "barn").value(), ObjectId{2});
  EXPECT_EQ(object_named(*store_, "#3").value(), ObjectId{3});
  const auto error = [&](const std::string& name) {
    const auto found = object_named(*store_, name);
    EXPECT_FALSE(found.ok()) << name;
    return found.ok() ? std::string() : found.error().text;
  };
  EXPECT_NE(error("bran").find("no object is called bran; did you mean barn, "), std::string::npos);
  EXPECT_NE(error("#5").find("no object is called #5"), std::string::npos);
  EXPECT_NE(error("#2x").find("no object is called #2x"), std::string::npos);
  EXPECT_NE(error("hedge").find("hedge only occludes"), std::string::npos);
}

}  // namespace
}  // namespace pvsfarm
