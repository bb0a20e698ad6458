// Slices of solids: which pixels of a plane they cover, and that every covered pixel keeps its
// promise, for rays from all over the cell to all over the pixel.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/random.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/visibility/slice_cover.hpp"

namespace pvsfarm {
namespace {

constexpr int kSide = 64;
const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

struct Setup {
  double distance = 9;
  Cell cell = kCell;
  double near_m = 0;
  Face face = {0, 1};
  double ground = -50;  // the scene's: height of an occludee far away
};

// The slices of some objects with a plane. Points are named by their height and by how far they are
// to the side, along the map's other axis; on planes above or below by x and y of the map.
class Sliced {
 public:
  explicit Sliced(const std::vector<SourceObject>& objects, const Setup& setup = {})
      : setup_(setup), frame_(setup.cell) {
    source_.objects = objects;
    for (const double at : {-200.0, 200.0})  // the corners of all there is to be seen
      source_.objects.push_back(
          box_object("far", {{at, at, setup.ground}, {at + 1, at + 1, setup.ground + 250}},
                     Role::kOnlyOccluded));
    const Result<std::shared_ptr<const Scene>> scene = build_scene(source_);
    SliceCover cover(**scene);
    cover.begin(setup.cell, frame_, setup.near_m);
    solids_ = cover.usable_solids();
    map_.reset(square_plane(frame_, setup.face, setup.distance, 0.8, kSide));
    map_.build_pyramids();
    work_ = cover.draw(map_);
  }
  explicit Sliced(const SourceObject& object, const Setup& setup = {})
      : Sliced(std::vector<SourceObject>{object}, setup) {}

  std::size_t solids() const { return solids_; }
  SliceWork work() const { return work_; }
  bool covers(double aside, double height) const {
    const bool turned = setup_.face.axis == 1;
    const ProjectionPlane& plane = map_.plane();
    const double x = turned ? height : aside, y = turned ? aside : height;
    EXPECT_LT(std::max(std::abs(x), std::abs(y)), -plane.x0) << "beyond the map";
    return depth(static_cast<int>((x - plane.x0) / plane.px),
                 static_cast<int>((y - plane.y0) / plane.py)) < kUncovered;
  }
  int count() const {
    return static_cast<int>(std::count_if(map_.base(), map_.base() + kSide * kSide,
                                          [](float z) { return z < kUncovered; }));
  }

  // Rays from the cell to covered pixels, as far as they lie above ground, that meet nothing.
  int broken_promises(int rays_a_pixel = 40) const {
    const RayOracle oracle(source_);
    Random random(7);
    int broken = 0;
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        if (!(depth(i, j) < kUncovered)) continue;
        EXPECT_EQ(depth(i, j), 0);
        for (int r = 0; r < rays_a_pixel; ++r) {
          const Vec3 eye = sample_cell(setup_.cell, random);
          const Vec3 end = on_plane(i + random.between(0, 1), j + random.between(0, 1));
          if (end.z < setup_.ground) continue;
          broken += oracle.clear_by({eye, eye + (end - eye) * (1 + 1e-9)}, 1e-9) ? 1 : 0;
        }
      }
    return broken;
  }

 private:
  float depth(int i, int j) const { return map_.base()[j * kSide + i]; }
  Vec3 on_plane(double i, double j) const {
    const ProjectionPlane& plane = map_.plane();
    Vec3 local;
    local[setup_.face.axis] = setup_.face.sign * (plane.hw + plane.distance);
    local[setup_.face.u()] = plane.x0 + plane.px * i;
    local[setup_.face.v()] = plane.y0 + plane.py * j;
    Vec3 world = setup_.cell.center();
    for (int a = 0; a < 3; ++a) world += setup_.cell.axes[a] * local[a];
    return world;
  }

  Setup setup_;
  SceneSource source_;
  CellFrame frame_;
  OcclusionMap map_;
  std::size_t solids_ = 0;
  SliceWork work_;
};

TEST(Slice, of_a_block_covers_what_lies_wholly_in_it) {
  const Sliced block(fine_box({{8, -4, -5}, {12, 5, 6}}));
  EXPECT_TRUE(block.covers(0, 0));
  EXPECT_TRUE(block.covers(-3.6, -4.6));
  EXPECT_TRUE(block.covers(4.6, 5.6));
  EXPECT_FALSE(block.covers(-4.4, 0));
  EXPECT_FALSE(block.covers(0, 6.4));
  EXPECT_FALSE(block.covers(0, -6));
  EXPECT_EQ(block.broken_promises(), 0);
}

TEST(Slice, on_any_of_the_six_planes) {
  for (const Face face : kFaces) {
    const Sliced around(fine_box({{-12, -12, -12}, {-8, 12, 12}}), {.face = face});
    Box box{{-4, -4, -4}, {5, 5, 5}};
    box.lo[face.axis] = face.sign > 0 ? 9 : -11;
    box.hi[face.axis] = face.sign > 0 ? 11 : -9;
    const Sliced block(fine_box(box), {.face = face});
    EXPECT_TRUE(block.covers(0, 0));
    EXPECT_TRUE(block.covers(4.6, 4.6));
    EXPECT_TRUE(block.covers(-3.6, -3.6));
    EXPECT_FALSE(block.covers(-4.4, 0));
    EXPECT_FALSE(block.covers(0, -4.4));
    EXPECT_FALSE(block.covers(5.4, 0));
    EXPECT_FALSE(block.covers(0, 5.4));
    EXPECT_EQ(block.broken_promises(), 0);
    EXPECT_EQ(around.broken_promises(), 0);
  }
}

TEST(Slice, of_a_torus_leaves_its_hole_open) {
  const Sliced ring(torus(10, 4, 1.5));
  EXPECT_FALSE(ring.covers(0, 0));
  EXPECT_FALSE(ring.covers(1.8, 0));
  EXPECT_TRUE(ring.covers(4, 0));
  EXPECT_TRUE(ring.covers(0, -4));
  EXPECT_FALSE(ring.covers(6, 0));
  EXPECT_EQ(ring.broken_promises(), 0);
}

TEST(Slice, of_a_corner_house_covers_both_wings_and_not_the_yard) {
  const std::vector<Vec2> corner{{-6, -6}, {6, -6}, {6, -2}, {-2, -2}, {-2, 6}, {-6, 6}};
  SourceObject house;
  house.name = "house";
  append(house, extruded(corner, 8, 12));
  const Sliced slice(house);
  EXPECT_TRUE(slice.covers(-4, 4));
  EXPECT_TRUE(slice.covers(4, -4));
  EXPECT_TRUE(slice.covers(-2.4, -2.4));
  EXPECT_FALSE(slice.covers(1, 1));
  EXPECT_EQ(slice.broken_promises(), 0);
}

// Even and odd would open the middle.
TEST(Slice, of_a_star_that_winds_twice_around_its_middle_covers_it) {
  std::vector<Vec2> star;
  const auto tip = [](int i) {
    return 6.0 * Vec2(std::cos(4 * M_PI * i / 5 + 0.1), std::sin(4 * M_PI * i / 5 + 0.1));
  };
  constexpr int kSteps = 16;  // with few points it would pass for convex, and be no surface
  for (int k = 0; k < 5 * kSteps; ++k)
    star.push_back(tip(k / kSteps) +
                   (tip(k / kSteps + 1) - tip(k / kSteps)) * (1.0 * (k % kSteps) / kSteps));
  const Sliced slice(extruded(star, 8, 12));
  EXPECT_TRUE(slice.covers(0, 0));
  EXPECT_TRUE(slice.covers(4, 0.4));
  EXPECT_FALSE(slice.covers(-3.4, -0.6));
  EXPECT_EQ(slice.broken_promises(), 0);
}

TEST(Slice, of_nested_solids_covers_as_that_of_the_outer_one) {
  const SourceObject outer = fine_box({{8, -5, -5}, {12, 5, 5}});
  SourceObject hollow = fine_box({{9, -2, -2}, {11, 2, 2}});
  turn_inside_out(hollow);
  const int alone = Sliced(outer).count();
  EXPECT_EQ(Sliced({outer, fine_box({{9, -2, -2}, {11, 2, 2}})}).count(), alone);
  const Sliced shell({outer, hollow});
  EXPECT_EQ(shell.count(), alone);
  EXPECT_EQ(shell.broken_promises(), 0);
}

TEST(Slice, of_a_solid_that_touches_the_plane_keeps_its_promises) {
  for (const Box& box :
       {Box{{10, -5, -5}, {12, 5, 5}}, Box{{8, -5, -5}, {10, 5, 5}},
        Box{{8, -5, -5}, {10 + 1e-15, 5, 5}}, Box{{10 - 1e-15, -5, -5}, {12, 5, 5}}})
    EXPECT_EQ(Sliced(fine_box(box)).broken_promises(), 0);
  // Of a solid that only reaches the plane no ray to it meets anything.
  EXPECT_EQ(Sliced(fine_box({{10, -5, -5}, {12, 5, 5}})).count(), 0);
  EXPECT_EQ(Sliced(fine_box({{10.001, -5, -5}, {12, 5, 5}})).count(), 0);
}

TEST(Slice, of_a_box_without_one_side_covers_nothing) {
  for (const int missing : {kLowX, kHighX, kLowY, kHighY, kHighZ, kLowZ}) {
    const Sliced open(fine_box({{8, -5, -5}, {12, 5, 5}}, 6, kAllSides & ~missing));
    EXPECT_EQ(open.solids(), 0u);
    EXPECT_EQ(open.count(), 0);
  }
}

TEST(Slice, of_a_solid_torn_by_a_hair_covers_nothing) {
  SourceObject torn = fine_box({{8, -5, -5}, {12, 5, 5}}, 6, kAllSides & ~kHighY);
  SourceObject side = fine_box({{8, -5, -5}, {12, 5, 5}}, 6, kHighY);
  for (Vec3& p : side.vertices) p.y += 1e-6;
  append(torn, side);
  EXPECT_EQ(Sliced(torn).count(), 0);
}

TEST(Slice, what_dangles_from_a_solid_neither_covers_nor_spoils) {
  SourceObject house = fine_box({{8, -4, -4}, {12, 4, 4}});
  const int alone = Sliced(house).count();
  const Vec3 fin[] = {{8, 4, 4}, {12, 4, 4}, {12, 4, 7}, {8, 4, 7}};
  append(house, polygon_object("fin", fin));
  const Sliced with_fin(house);
  EXPECT_EQ(with_fin.count(), alone);
  EXPECT_EQ(with_fin.broken_promises(), 0);
}

TEST(Slice, without_a_floor_covers_where_the_ground_is_below_all) {
  const SourceObject house = fine_box({{8, -4, -3}, {12, 4, 5}}, 6, kAllSides & ~kLowZ);
  const Sliced standing(house, {.ground = -3});
  EXPECT_TRUE(standing.covers(0, 0));
  EXPECT_TRUE(standing.covers(-3.6, -2.9));
  EXPECT_FALSE(standing.covers(4.4, 0));
  EXPECT_EQ(standing.broken_promises(), 0);
  const Sliced turned(fine_box({{-4, 8, -3}, {4, 12, 5}}, 6, kAllSides & ~kLowZ),
                      {.face = {1, 1}, .ground = -3});
  EXPECT_TRUE(turned.covers(0, 0));
  EXPECT_TRUE(turned.covers(-3.6, -2.9));
  EXPECT_FALSE(turned.covers(0, 5.4));
  EXPECT_EQ(turned.broken_promises(), 0);

  // It hovers, or the cell reaches below the ground, or the plane lies below it.
  EXPECT_EQ(Sliced(house, {.ground = -3.001}).count(), 0);
  EXPECT_EQ(
      Sliced(house, {.cell = Cell::aligned({{-1, -1, -3.1}, {1, 1, 1}}), .ground = -3}).count(), 0);
  const SourceObject pit = fine_box({{-4, -4, -12}, {4, 4, -8}}, 6, kAllSides & ~kHighZ);
  EXPECT_EQ(Sliced(pit, {.face = {2, -1}, .ground = -3}).count(), 0);
}

TEST(Slice, of_a_hill_that_ends_where_all_objects_do_covers_what_is_in_the_earth) {
  SourceObject hills;
  hills.name = "hills";
  constexpr int kN = 40;
  const auto height = [](double x, double y) {
    return 8 * std::exp(-(x - 10) * (x - 10) / 9 - y * y / 40) - 4;
  };
  add_sheet(hills, kN, [&](int i, int j) {
    const auto at = [](int k) { return k == 0 ? -200.0 : k == kN ? 201.0 : -18.0 + k; };
    return Vec3(at(i), at(j), height(at(i), at(j)));
  });
  for (const Face face : {Face{0, 1}, Face{1, 1}, Face{0, -1}}) {
    const Sliced slice(hills, {.face = face});
    EXPECT_EQ(slice.solids(), 1u);
    EXPECT_TRUE(slice.covers(0, -5));
    EXPECT_EQ(slice.covers(0, 2), face.axis == 0 && face.sign > 0);
    EXPECT_FALSE(slice.covers(0, 5));
    EXPECT_EQ(slice.broken_promises(), 0);
  }
  EXPECT_EQ(Sliced(hills, {.face = {2, 1}}).count(), 0);
  // From below, it is the air that is out of sight.
  const Sliced below(hills, {.cell = Cell::aligned({{-1, -1, -9}, {1, 1, -7}})});
  EXPECT_TRUE(below.covers(7.5, -0.5 + 8));
  EXPECT_FALSE(below.covers(0, -0.5 + 8));
  // A sheet that ends within what may be seen hides nothing of it.
  for (Vec3& p : hills.vertices) p.x = std::min(p.x, 199.0);
  EXPECT_EQ(Sliced(hills).solids(), 0u);
}

TEST(Slice, of_a_room_around_the_cell_covers_what_is_outside_of_it) {
  const SourceObject room = fine_box({{-5, -4, -4}, {7, 4, 4}});
  const Sliced within(room, {.distance = 4});
  EXPECT_FALSE(within.covers(0, 0));
  const Sliced beyond(room, {.distance = 9});
  EXPECT_TRUE(beyond.covers(0, 0));
  EXPECT_EQ(beyond.count(), kSide * kSide);
  EXPECT_EQ(beyond.broken_promises(), 0);
  const Sliced high(fine_box({{-5, -2, -2}, {12, 2, 2}}), {.distance = 9});
  EXPECT_FALSE(high.covers(0, 0));
  EXPECT_TRUE(high.covers(4, 0));
  EXPECT_TRUE(high.covers(0, -4));
  EXPECT_EQ(high.broken_promises(), 0);
}

TEST(Slice, of_a_solid_that_the_cell_meets_or_touches_is_ignored) {
  const SourceObject block = fine_box({{8, -4, -4}, {12, 4, 4}});
  for (const double reach : {8.0 + 1e-9, 9.0, 13.0})
    EXPECT_EQ(Sliced(block, {.cell = Cell::aligned({{-1, -1, -1}, {reach, 1, 1}}), .face = {1, 1}})
                  .solids(),
              0u);
  EXPECT_EQ(Sliced(block, {.cell = Cell::aligned({{-1, -1, -1}, {7.9, 1, 1}})}).solids(), 1u);
  // Exactly at a wall, which only its own border meets.
  const Sliced touching(fine_box({{1, -9, -9}, {12, 9, 9}}));
  EXPECT_EQ(touching.solids(), 1u);
  EXPECT_TRUE(touching.covers(0, 0));
}

TEST(Slice, leaves_out_what_comes_nearer_than_the_near_clip) {
  const SourceObject block = fine_box({{2, -8, -8}, {12, 8, 8}});
  EXPECT_GT(Sliced(block, {.near_m = 0.9}).count(), 0);
  EXPECT_EQ(Sliced(block, {.near_m = 1.1}).count(), 0);
}

TEST(Slice, of_one_sided_solids_covers_where_their_fronts_are_met_first) {
  for (const Face face : kFaces) {
    Box box{{-4, -4, -4}, {5, 5, 5}};
    box.lo[face.axis] = face.sign > 0 ? 9 : -11;
    box.hi[face.axis] = face.sign > 0 ? 11 : -9;
    SourceObject solid = fine_box(box);
    solid.two_sided = false;
    EXPECT_TRUE(Sliced(solid, {.face = face}).covers(0, 0));
    turn_inside_out(solid);
    EXPECT_EQ(Sliced(solid, {.face = face}).count(), 0);

    // A room is seen from within: its fronts look in.
    SourceObject room = fine_box({{-7, -7, -7}, {7, 7, 7}});
    room.two_sided = false;
    EXPECT_EQ(Sliced(room, {.face = face}).count(), 0);
    turn_inside_out(room);
    EXPECT_EQ(Sliced(room, {.face = face}).count(), kSide * kSide);
  }
}

TEST(Slice, from_a_turned_cell_keeps_its_promises) {
  Random random(5);
  int covered = 0;
  for (int k = 0; k < 12; ++k) {
    const double a = random.between(0, 6), b = k % 2 == 0 ? 0.0 : random.between(0, 6);
    const Vec3 u(std::cos(a), std::sin(a), 0), up(0, 0, 1), side = cross(up, u);
    const Vec3 v = side * std::cos(b) + up * std::sin(b);
    const Cell cell{
        .origin = {0.1, 0.2, 0}, .axes = {u, v, cross(u, v)}, .lo = {-1, -1, -1}, .hi = {1, 1, 1}};
    for (const Face face : kFaces) {
      const Sliced slice({torus(10, 4, 1.5), fine_box({{-13, -7, -4}, {-6, 7, 5}}),
                          fine_box({{-6, 6, -4}, {4, 13, 9}}, 6, kAllSides & ~kLowZ)},
                         {.cell = cell, .face = face, .ground = -4});
      covered += slice.count();
      EXPECT_EQ(slice.broken_promises(10), 0);
    }
  }
  EXPECT_GT(covered, 2000);
}

}  // namespace
}  // namespace pvsfarm
