// Which cells of a store are audited, in which order, how hard, and what is suspected.
#include "coordinator/audit/store_audit.hpp"

#include <gtest/gtest.h>

#include <set>

#include "coordinator/audit/neighbours.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kObjects = 40;
constexpr int kSide = 4;

VisibleSet without(std::initializer_list<std::uint32_t> gone) {
  VisibleSet set = VisibleSet::all(kObjects);
  for (const std::uint32_t id : gone) set.remove(ObjectId{id});
  return set;
}

VisibleSet only(std::initializer_list<std::uint32_t> kept) {
  VisibleSet set = VisibleSet::none(kObjects), rest = without(kept);
  VisibleSet all = VisibleSet::all(kObjects);
  all.remove_all(rest);
  return all;
}

// 4 x 4 cells, each ten metres a side, with gaps of two metres as walls leave them. All of them see
// all objects but 0 and 1; the sixth also lacks object 5, which all others certainly see.
class AuditedStore : public testing::Test {
 protected:
  void SetUp() override {
    for (std::uint32_t i = 0; i < kObjects; ++i) names_.push_back("object " + std::to_string(i));
    std::vector<StoreObject> objects(kObjects);
    for (std::uint32_t i = 0; i < kObjects; ++i)
      objects[i] = {.name = names_[i], .box = {{0, 0, 0}, {1, 1, 1}}, .triangle_count = 10};
    auto writer = StoreWriter::create(folder_.file("a.pvs"), {}, objects).value();
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
      const Vec3 corner{12.0 * (i % kSide), 12.0 * static_cast<double>(i / kSide), 0};
      StoreNode node{.key = {i, 1}, .root_id = i};
      node.cell = Cell::aligned({corner, corner + Vec3{10, 10, 2}});
      node.visible = i == 5 ? without({0, 1, 5}) : without({0, 1});
      node.seen = i == 5 ? only({7}) : only({5, 7});
      ASSERT_TRUE(writer->add(node).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
    store_ = StoreReader::open(folder_.file("a.pvs")).value();
    audit_ = StoreAudit::make(*store_, 1).value();
  }

  AuditQuestion question(std::uint32_t number) {
    return std::get<AuditQuestion>(audit_->question(number).value());
  }
  AuditFinding finding_for(std::uint32_t number, VisibleSet seen) {
    return {.key = question(number).key, .rays = 100, .seen = std::move(seen), .violations = {}};
  }

  TempFolder folder_;
  std::vector<std::string> names_;
  std::unique_ptr<StoreReader> store_;
  std::unique_ptr<StoreAudit> audit_;
};

}  // namespace

TEST_F(AuditedStore, neighbours_are_found_across_the_gaps_that_walls_leave) {
  const auto around = neighbours_of(*store_, store_->node(5).value()).value();
  for (const std::uint32_t beside : {1u, 4u, 6u, 9u})
    EXPECT_EQ(std::count(around.begin(), around.end(), beside), 1) << beside;
  EXPECT_EQ(std::count(around.begin(), around.end(), 5u), 0);
  EXPECT_EQ(neighbours_of(*store_, store_->node(0).value())->size(), 2u);
}

TEST_F(AuditedStore, every_pass_asks_about_every_cell_with_more_rays_and_another_seed) {
  constexpr std::uint32_t kCells = kSide * kSide;
  std::set<std::uint64_t> seeds;
  std::uint64_t rays_before = 0;
  for (std::uint32_t pass = 0; pass < 3; ++pass) {
    std::set<std::uint32_t> roots;
    std::uint64_t rays = 0;
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const AuditQuestion asked = question(pass * kCells + i);
      roots.insert(asked.key.root);
      seeds.insert(asked.seed);
      rays += asked.rays;
    }
    EXPECT_EQ(roots.size(), kCells);
    EXPECT_GE(rays, 3 * rays_before);
    rays_before = rays;
  }
  EXPECT_EQ(seeds.size(), 3 * kCells);
}

TEST_F(AuditedStore, what_the_cells_around_certainly_see_is_suspected_first) {
  constexpr std::uint32_t kCells = kSide * kSide;
  for (std::uint32_t i = 0; i < 2 * kCells; ++i) {
    const AuditQuestion asked = question(i);
    EXPECT_EQ(asked.suspects, asked.key.root == 5 ? only({5}) : only({})) << i;
  }
  for (std::uint32_t cell = 0; cell < kCells; ++cell) audit_->plant(cell, ObjectId{9});
  audit_->plant(3, ObjectId{5});
  for (std::uint32_t i = 0; i < kCells; ++i) {
    const AuditQuestion asked = question(i);
    EXPECT_FALSE(asked.visible.contains(ObjectId{9}));
    if (asked.key.root == 3) {
      EXPECT_EQ(asked.suspects, only({5}));
    }
  }
}

TEST_F(AuditedStore, an_object_seen_outside_a_set_is_a_violation_told_once) {
  const SightLine line{{1, 2, 3}, {4, 5, 6}};
  for (const std::uint32_t number : {0u, 16u}) {  // the same cell in both passes
    AuditFinding finding = finding_for(number, only({0}));
    finding.violations.push_back({ObjectId{0}, line});
    audit_->answered(number, std::move(finding));
  }
  ASSERT_EQ(question(0).key, question(16).key);
  const auto violations = audit_->violations();
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].cell, question(0).key.root);
  EXPECT_EQ(violations[0].line.eye, line.eye);
  EXPECT_EQ(audit_->figures().leaves_reached, 1u);
  EXPECT_EQ(audit_->figures().questions, 2u);
}

TEST_F(AuditedStore, gaps_count_what_the_audit_saw_beside_what_was_certified) {
  // The first cell's audit sees ten objects, of which object 1 is in no set.
  VisibleSet seen = VisibleSet::none(kObjects);
  seen = only({1, 7, 8, 9, 10, 11, 12, 13, 14, 15});
  audit_->answered(0, finding_for(0, seen));
  const auto gaps = audit_->gaps().value();
  ASSERT_EQ(gaps.size(), 1u);
  const bool lacks_five = question(0).key.root == 5;
  EXPECT_EQ(gaps[0].triangles, lacks_five ? 370u : 380u);
  EXPECT_EQ(gaps[0].seen_triangles, lacks_five ? 90u : 100u);
  EXPECT_EQ(audit_->newly_seen(), 8u);
}

}  // namespace pvsfarm
