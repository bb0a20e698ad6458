// The cases of cases.json through methods that work on exact geometry: strong occlusion, shields
// and hoops. What is seen is never hidden; what only a shortcut hides, the shortcut hides.
#include <gtest/gtest.h>

#include <set>

#include "tests/adversarial/case_file.hpp"
#include "tests/adversarial/reference/hoop_reference.hpp"
#include "tests/adversarial/reference/shield_reference.hpp"

namespace pvsfarm::reference {
namespace {

IntPoint grid(const Vec3& p) {
  const ExactPoint e = exact(p);
  return {{e.v[0], e.v[1], e.v[2]}};
}
IntBox grid(const Box& box) { return {grid(box.lo), grid(box.hi)}; }

std::string name_of(const testing::TestParamInfo<VisibilityCase>& test) { return test.param.id; }
class SeenCase : public testing::TestWithParam<VisibilityCase> {};
class HiddenCase : public testing::TestWithParam<VisibilityCase> {};
INSTANTIATE_TEST_SUITE_P(References, SeenCase, testing::ValuesIn(cases_that(Must::kVisible)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(References, HiddenCase, testing::ValuesIn(cases_that(Must::kHidden)),
                         name_of);

VisibilityCase case_named(const std::string& id) {
  for (const VisibilityCase& c : all_cases())
    if (c.id == id) return c;
  throw std::out_of_range(id);
}

// Cohen-Or 1998: every segment between vertices is blocked, all by one convex occluder, or each by
// whichever does.
bool hidden_by_one(const VisibilityCase& c) {
  for (const ExactPolygon& polygon : exact_matter(c))
    if (hides(polygon, c.cell, c.occludee)) return true;
  return false;
}
bool hidden_by_any(const VisibilityCase& c) {
  const auto matter = exact_matter(c);
  for (int k = 0; k < 64; ++k)
    if (sight(matter, exact(c.cell.corner(k / 8)), exact(c.occludee.corner(k % 8))) !=
        Sight::kBlocked)
      return false;
  return true;
}

TEST_P(SeenCase, is_not_hidden_by_strong_occlusion) { EXPECT_FALSE(hidden_by_one(GetParam())); }

TEST(StrongOcclusion, by_a_different_occluder_for_each_ray_hides_what_is_seen) {
  for (const char* id : {"strong_occlusion_union", "two_walls_one_object", "fig9"}) {
    const VisibilityCase c = case_named(id);
    ASSERT_EQ(c.must, Must::kVisible);
    EXPECT_TRUE(hidden_by_any(c)) << id;
  }
}

// A polygon as fans of triangles; rectangles across z are cut where others of their height end, so
// that neighbours share whole edges.
std::vector<std::vector<Vec3>> with_shared_edges(const std::vector<std::vector<Vec3>>& polygons) {
  const auto is_plate = [](const std::vector<Vec3>& p) {
    std::set<double> x, y, z;
    for (const Vec3& v : p) x.insert(v.x), y.insert(v.y), z.insert(v.z);
    return p.size() == 4 && x.size() == 2 && y.size() == 2 && z.size() == 1;
  };
  std::vector<std::vector<Vec3>> pieces;
  for (const auto& polygon : polygons) {
    if (!is_plate(polygon)) {
      pieces.push_back(polygon);
      continue;
    }
    Box box;
    for (const Vec3& v : polygon) box.add(v);
    std::set<double> cuts[2];
    for (const auto& other : polygons)
      for (const Vec3& v : other)
        for (int axis = 0; axis < 2; ++axis)
          if (is_plate(other) && v.z == box.lo.z && v[axis] >= box.lo[axis] &&
              v[axis] <= box.hi[axis])
            cuts[axis].insert(v[axis]);
    for (auto x = cuts[0].begin(); std::next(x) != cuts[0].end(); ++x)
      for (auto y = cuts[1].begin(); std::next(y) != cuts[1].end(); ++y) {
        const double x1 = *std::next(x), y1 = *std::next(y), z = box.lo.z;
        pieces.push_back({{*x, *y, z}, {x1, *y, z}, {x1, y1, z}, {*x, y1, z}});
      }
  }
  return pieces;
}

TriangleMesh mesh_of(const VisibilityCase& c) {
  TriangleMesh mesh;
  const auto vertex = [&](const Vec3& p) {
    const IntPoint at = grid(p);
    for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
      if (mesh.vertices[k] == at) return static_cast<int>(k);
    mesh.vertices.push_back(at);
    return static_cast<int>(mesh.vertices.size()) - 1;
  };
  for (const auto& polygon : with_shared_edges(occluder_polygons(c)))
    for (std::size_t k = 2; k < polygon.size(); ++k)
      mesh.triangles.push_back({vertex(polygon[0]), vertex(polygon[k - 1]), vertex(polygon[k])});
  return mesh;
}

// Of all the matter as one surface, from several rays.
bool hidden_by_flood(const VisibilityCase& c) {
  bool hidden = false;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    hidden |= flood(mesh_of(c), grid(c.cell), grid(c.occludee), random) == ShieldAnswer::kHidden;
  }
  return hidden;
}

TEST_P(SeenCase, is_not_hidden_by_a_shield) { EXPECT_FALSE(hidden_by_flood(GetParam())); }
TEST_P(HiddenCase, is_hidden_by_a_shield) { EXPECT_TRUE(hidden_by_flood(GetParam())); }

TEST(Shield, with_a_hole_beside_the_tube_is_accepted_by_the_flood_and_not_by_the_walk) {
  const VisibilityCase c = case_named("shield_hole_outside_R");
  EXPECT_TRUE(hidden_by_flood(c));
  EXPECT_NE(walk_and_invade(mesh_of(c), grid(c.cell).corners(), grid(c.occludee).corners(),
                            Invasion::kAllParts),
            ShieldAnswer::kHidden);
}

// The theorem is sufficient only: two flaps that overlap do hide, and neither has its border
// outside.
TEST(Shield, of_two_flaps_is_not_decided) {
  EXPECT_FALSE(hidden_by_flood(case_named("shield_flaps")));
}

// With `axis` renamed to z, upwards or downwards.
IntPoint turned(const IntPoint& p, int axis, int sign) {
  return {{p[(axis + 1) % 3], p[(axis + 2) % 3], sign * p[axis]}};
}
IntBox turned(const IntBox& box, int axis, int sign) {
  IntBox t{turned(box.lo, axis, sign), turned(box.hi, axis, sign)};
  if (sign < 0) std::swap(t.lo[2], t.hi[2]);
  return t;
}

// Every convex polygon of the matter as a hoop, in each of the six directions.
bool hidden_by_hoop(const VisibilityCase& c, Rear rear) {
  for (const auto& polygon : occluder_polygons(c))
    for (int k = 0; k < 12; ++k) {
      const int axis = k % 3, sign = k % 6 < 3 ? 1 : -1;
      const IntBox cell = turned(grid(c.cell), axis, sign);
      const IntBox occludee = turned(grid(c.occludee), axis, sign);
      Loop loop;
      for (const Vec3& p : polygon) loop.push_back(turned(grid(p), axis, sign));
      if (k < 6) std::reverse(loop.begin(), loop.end());
      std::int64_t nearest = loop[0][2], farthest = loop[0][2];
      for (const IntPoint& p : loop) {
        nearest = std::min(nearest, p[2]);
        farthest = std::max(farthest, p[2]);
      }
      if (nearest <= cell.hi[2] || !seen_convex(cell, loop)) continue;
      bool inside = true;
      for (const HalfSpace& h : shadow(cell, loop, farthest, rear))
        inside &= place(occludee, h) == Place::kInside;
      if (inside) return true;
    }
  return false;
}

TEST_P(SeenCase, is_not_hidden_by_a_hoop) {
  EXPECT_FALSE(hidden_by_hoop(GetParam(), Rear::kClosed));
}
TEST_P(HiddenCase, is_hidden_by_a_hoop) { EXPECT_TRUE(hidden_by_hoop(GetParam(), Rear::kClosed)); }

TEST(Hoop, without_a_rear_hides_what_stands_before_it_or_in_it) {
  for (const char* id : {"hoop_front_region", "in_front", "coplanar_decal"}) {
    const VisibilityCase c = case_named(id);
    ASSERT_EQ(c.must, Must::kVisible);
    EXPECT_TRUE(hidden_by_hoop(c, Rear::kOpen)) << id;
  }
}

}  // namespace
}  // namespace pvsfarm::reference
