// Location of points against a walk over all cells.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>

#include "common/pvs/pvs_reader.h"
#include "common/pvs/store_reader.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {
namespace {

// How far the point is outside of the cell along the cell's axes, in long double; <= 0 inside.
double outside_m(const Cell& cell, const Vec3& p) {
  long double worst = -1e30L;
  for (int a = 0; a < 3; ++a) {
    long double t = 0;
    for (int b = 0; b < 3; ++b)
      t += (static_cast<long double>(p[b]) - cell.origin[b]) * cell.axes[a][b];
    worst = std::max({worst, cell.lo[a] - t, t - cell.hi[a]});
  }
  return static_cast<double>(worst);
}

bool is_aligned(const Cell& cell) { return cell.axes == Cell{}.axes && cell.origin == Vec3(0); }

std::vector<std::uint32_t> found(const pvs_store& store, UpAxis up, const Vec3& point,
                                 std::uint32_t capacity) {
  const Vec3 in_file = file_from_internal(up, point);
  const double p[3] = {in_file.x, in_file.y, in_file.z};
  std::vector<std::uint32_t> cells(capacity);
  std::uint32_t count = 0;
  PVS_CHECK_EQ(pvs_find(&store, p, cells.data(), capacity, &count), PVS_OK);
  cells.resize(std::min(count, capacity));
  return cells;
}

void expect_all_leaves_that_hold(const Vec3& p, const SampleStore& store, StoreReader& reader) {
  const auto cells = found(reader.raw(), store.header.up, p, 1000);
  RC_ASSERT(std::is_sorted(cells.begin(), cells.end()));
  for (std::uint32_t i = 0; i < store.nodes.size(); ++i) {
    const StoreNode& node = store.nodes[i];
    const double outside = outside_m(node.cell, p);
    // Rounding decides only on the very face of a turned cell.
    if (!is_aligned(node.cell) && std::abs(outside) < 1e-11) continue;
    const bool held = std::binary_search(cells.begin(), cells.end(), i);
    RC_ASSERT(held == (node.leaf && outside <= 0));
  }
  const auto lowest = found(reader.raw(), store.header.up, p, 1);
  RC_ASSERT(lowest == std::vector(cells.begin(), cells.begin() + (cells.empty() ? 0 : 1)));
}

TEST(StoreFind, agrees_with_a_walk_over_all_cells) {
  const TempFolder folder;
  EXPECT_TRUE(rc::check("find(p) == all leaves that hold p", [&](std::uint64_t seed) {
    const SampleStore store = random_store(
        seed, {.objects = 10, .roots = *rc::gen::inRange<std::uint32_t>(1, 60), .max_depth = 4});
    RC_ASSERT(store.write(folder.file("a.pvs")).ok());
    auto reader = StoreReader::open(folder.file("a.pvs"));
    RC_ASSERT(reader.ok());
    Random random(seed);
    for (int trial = 0; trial < 60; ++trial) {
      const Cell& cell = store.nodes[random.below(store.nodes.size())].cell;
      Vec3 t;  // corners and faces half of the time: there cells meet
      for (int a = 0; a < 3; ++a) {
        const std::uint64_t where = random.below(4);
        t[a] = where == 0   ? cell.lo[a]
               : where == 1 ? cell.hi[a]
                            : random.between(cell.lo[a] - 1, cell.hi[a] + 1);
      }
      expect_all_leaves_that_hold(cell.point(t), store, **reader);
    }
  }));
}

TEST(StoreFind, no_point_falls_between_turned_cells_that_share_a_face) {
  const TempFolder folder;
  Random random(11);
  SampleStore store;
  StoreNode node{.visible = VisibleSet::none(0), .seen = VisibleSet::none(0)};
  const double angle = 0.7, c = std::cos(angle), s = std::sin(angle);
  node.cell = {.origin = {12345.678, -987.654, 3.21},
               .axes = {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}},
               .lo = {0, 0, 0},
               .hi = {0.1, 4, 2}};
  for (std::uint32_t i = 0; i < 200; ++i) {
    node.key = {i, 1};
    store.nodes.push_back(node);
    node.cell.lo.x = node.cell.hi.x;
    node.cell.hi.x += 0.1;
  }
  ASSERT_TRUE(store.write(folder.file("a.pvs")).ok());
  auto reader = StoreReader::open(folder.file("a.pvs"));
  ASSERT_TRUE(reader.ok());
  for (int trial = 0; trial < 20000; ++trial) {
    const Cell& cell = store.nodes[random.below(store.nodes.size())].cell;
    const Vec3 p = cell.point({cell.hi.x, random.between(0, 4), random.between(0, 2)});
    ASSERT_FALSE((*reader)->leaves_at(p)->empty());
  }
}

TEST(StoreFind, a_store_without_cells_holds_no_point) {
  const TempFolder folder;
  ASSERT_TRUE(SampleStore{}.write(folder.file("a.pvs")).ok());
  auto reader = StoreReader::open(folder.file("a.pvs"));
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE((*reader)->leaves_at({0, 0, 0})->empty());
}

}  // namespace
}  // namespace pvsfarm
