#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {
namespace {

const Box kHouse{{10, 20, 0}, {18, 32, 9}};

SourceObject house() { return box_object("house", kHouse); }

std::vector<Occluder> solids(const SourceObject& object) { return solids_of(*scene_of({object})); }

// A thin ground so that `ground()` is `height` whatever stands on it.
SourceObject ground_at(double height) {
  SourceObject ground = box_object("ground", {{-90, -90, height}, {90, 90, height}});
  ground.occluder = false;
  return ground;
}

}  // namespace

TEST(OccluderSolids, box_is_a_solid_at_its_exact_corners) {
  const auto scene = scene_of({house()});
  ASSERT_EQ(solids_of(*scene).size(), 1u);
  const Occluder box = solids_of(*scene)[0];
  EXPECT_TRUE(box.is_box && box.is_prism);
  EXPECT_EQ(box.base_points, 4u);
  EXPECT_EQ(box.flatness, 0);
  for (int k = 0; k < 8; ++k) EXPECT_EQ(scene->points(box)[k], kHouse.corner(k));
  ASSERT_EQ(scene->owners(box).size(), 1u);
  EXPECT_EQ(scene->owners(box)[0], ObjectId{0});
}

TEST(OccluderSolids, faces_of_a_box_are_six_rectangles_that_name_it) {
  const auto scene = scene_of({house()});
  const std::vector<Occluder> faces = polygons_of(*scene);
  ASSERT_EQ(faces.size(), 6u);
  for (const Occluder& face : faces) {
    EXPECT_EQ(face.point_count, 4u);
    EXPECT_EQ(face.flatness, 0);
    ASSERT_GE(face.face_of, 0);
    EXPECT_TRUE(scene->occluders()[static_cast<std::size_t>(face.face_of)].is_box);
    // Counter-clockwise seen from outside.
    const auto p = scene->points(face);
    EXPECT_GT(dot(cross(p[1] - p[0], p[2] - p[0]), face.box.center() - kHouse.center()), 0);
  }
}

TEST(OccluderSolids, tessellated_box_is_the_same_solid) {
  SourceObject object = house();
  object.vertices.push_back(Vec3(14, 26, 9));  // the middle of the roof
  object.triangles.erase(object.triangles.begin() + 2, object.triangles.begin() + 4);
  for (const auto& [a, b] : {std::pair(4, 5), std::pair(5, 7), std::pair(7, 6), std::pair(6, 4)})
    object.triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), 8});
  const auto scene = scene_of({object});
  ASSERT_EQ(solids_of(*scene).size(), 1u);
  EXPECT_TRUE(solids_of(*scene)[0].is_box);
  EXPECT_EQ(polygons_of(*scene).size(), 6u);
}

TEST(OccluderSolids, box_without_lid_is_no_solid) {
  SourceObject open = house();
  open.triangles.erase(open.triangles.begin() + 2, open.triangles.begin() + 4);
  EXPECT_TRUE(solids(open).empty());
  EXPECT_EQ(polygons_of(*scene_of({open})).size(), 5u);
}

TEST(OccluderSolids, cracked_box_is_no_solid) {
  SourceObject cracked = house();
  cracked.vertices.push_back(cracked.vertices[7] + Vec3(1e-6, 0, 0));
  cracked.triangles[11][1] = 8;  // one triangle no longer meets its neighbours
  EXPECT_TRUE(solids(cracked).empty());
}

TEST(OccluderSolids, dented_box_is_no_solid) {
  SourceObject dented = house();
  dented.vertices[7] -= Vec3(3, 4, 4);
  EXPECT_TRUE(solids(dented).empty());
}

TEST(OccluderSolids, turned_box_shrinks_a_little_and_stays_inside) {
  const auto scene = scene_of({turned(house(), 0.3, {500, -300, 2})});
  ASSERT_EQ(solids_of(*scene).size(), 1u);
  const Occluder solid = solids_of(*scene)[0];
  EXPECT_FALSE(solid.is_box);
  EXPECT_TRUE(solid.is_prism);
  EXPECT_EQ(solid.base_points, 4u);
  EXPECT_GT(solid.flatness, 0);
  EXPECT_LT(solid.flatness, 1e-2);
  const Box matter = scene->object(ObjectId{0}).box;
  EXPECT_TRUE(matter.contains(solid.box.lo) && matter.contains(solid.box.hi));
  EXPECT_EQ(solid.box.lo.z, matter.lo.z);
}

TEST(OccluderSolids, inward_one_sided_cube_is_no_solid_and_not_closed) {
  SourceObject room = house();
  for (auto& t : room.triangles) std::swap(t[1], t[2]);
  EXPECT_EQ(solids(room).size(), 1u);  // two-sided: winding means nothing
  room.two_sided = false;
  const auto scene = scene_of({room});
  EXPECT_TRUE(solids_of(*scene).empty());
  for (const Occluder& face : polygons_of(*scene)) {
    EXPECT_TRUE(face.one_sided);
    EXPECT_FALSE(face.closed);
  }
}

TEST(OccluderSolids, outward_one_sided_cube_is_a_solid_with_closed_faces) {
  SourceObject box = house();
  box.two_sided = false;
  const auto scene = scene_of({box});
  EXPECT_EQ(solids_of(*scene).size(), 1u);
  for (const Occluder& face : polygons_of(*scene)) EXPECT_TRUE(face.one_sided && face.closed);
}

TEST(OccluderSolids, randomly_wound_two_sided_box_is_a_solid) {
  SourceObject box = house();
  for (const std::size_t t : {1u, 4u, 5u, 10u}) std::swap(box.triangles[t][0], box.triangles[t][1]);
  EXPECT_EQ(solids(box).size(), 1u);
  box.two_sided = false;
  EXPECT_TRUE(solids(box).empty());
}

// Case 52: a box with base 0 reaches into the earth, one with base 0.01 does not.
TEST(OccluderSolids, base_on_the_ground_is_extended_and_a_centimetre_above_is_not) {
  for (const double turn : {0.0, 0.4}) {
    const auto scene =
        scene_of({ground_at(0), turned(box_object("on", {{0, 0, 0}, {4, 6, 9}}), turn, {}),
                  turned(box_object("above", {{20, 0, 0.01}, {24, 6, 9}}), turn, {})});
    int on = 0, above = 0;
    for (const Occluder& solid : solids_of(*scene)) {
      (solid.box.lo.z == 0 ? on : above) += 1;
      EXPECT_EQ(solid.base_points, solid.box.lo.z == 0 ? 4u : 0u);
      EXPECT_TRUE(solid.is_prism);
    }
    EXPECT_EQ(on, 1);
    EXPECT_EQ(above, 1);
  }
}

TEST(OccluderSolids, overhang_and_tilted_base_are_not_extended) {
  const std::vector<Vec2> ring = regular_ring(6, 5, {30, 40});
  const auto base_points = [](const SourceObject& object) {
    const auto found = solids_of(*scene_of({ground_at(0), object}));
    return found.size() == 1 ? static_cast<int>(found[0].base_points) : -1;
  };
  EXPECT_EQ(base_points(prism_object("straight", ring, 0, 8)), 6);
  EXPECT_EQ(base_points(prism_object("tapered", ring, 0, 8, 0.7)), 6);
  EXPECT_EQ(base_points(prism_object("funnel", ring, 0, 8, 1.2)), 0);
  SourceObject tilted = prism_object("tilted", {{0, 0}, {4, 0}, {4, 5}}, 0, 8);
  tilted.vertices[1].z = -0.5;
  EXPECT_EQ(base_points(tilted), 0);
}

TEST(OccluderSolids, taper_is_no_prism_and_a_round_tower_keeps_few_points) {
  const std::vector<Vec2> ring = regular_ring(64, 5, {30, 40});
  const auto tower = solids(prism_object("tower", ring, 0, 30));
  ASSERT_EQ(tower.size(), 1u);
  EXPECT_TRUE(tower[0].is_prism);
  EXPECT_LE(tower[0].point_count + tower[0].base_points, 32u);
  EXPECT_GE(tower[0].base_points, 8u);
  const auto cone = solids(prism_object("cone", regular_ring(5, 5, {30, 40}), 0, 30, 0.5));
  ASSERT_EQ(cone.size(), 1u);
  EXPECT_FALSE(cone[0].is_prism);
}

TEST(OccluderSolids, two_boxes_in_one_object_are_two_solids_even_when_they_share_an_edge) {
  const SourceObject pair =
      joined(box_object("pair", {{0, 0, 0}, {4, 4, 4}}), box_object("", {{4, 4, 0}, {9, 9, 4}}));
  EXPECT_EQ(solids(pair).size(), 2u);
}

TEST(OccluderSolids, building_with_wings_is_cut_into_convex_prisms) {
  for (const double turn : {0.0, 0.7}) {
    SourceObject building =
        turned(block_object("l", {{0, 0}, {1, 0}, {2, 0}, {0, 1}, {0, 2}}, 0, 6), turn, {50, 7, 0});
    building.two_sided = false;
    const auto scene = scene_of({building});
    double area = 0;
    for (const Occluder& solid : solids_of(*scene)) {
      EXPECT_TRUE(solid.is_prism && !solid.closed);
      ASSERT_EQ(solid.base_points * 2, solid.point_count);
      const auto p = scene->points(solid).first(solid.base_points);
      for (std::size_t i = 0; i < p.size(); ++i)
        area += cross(p[i] - p[0], p[(i + 1) % p.size()] - p[0]).z / 2;
    }
    EXPECT_NEAR(area, 5, 1e-3);
    for (const Occluder& face : polygons_of(*scene)) EXPECT_TRUE(face.closed && face.face_of < 0);
  }
}

TEST(OccluderSolids, slanted_wall_keeps_a_winged_building_from_being_cut) {
  SourceObject building = block_object("l", {{0, 0}, {1, 0}, {0, 1}}, 0, 6);
  for (Vec3& p : building.vertices)
    if (p == Vec3(2, 0, 6)) p.x += 1e-6;
  EXPECT_TRUE(solids(building).empty());
}

TEST(OccluderSolids, dynamic_and_untagged_objects_never_occlude) {
  SourceObject car = house(), leaf = house();
  car.dynamic = true;
  leaf.occluder = false;
  EXPECT_TRUE(scene_of({car, leaf})->occluders().empty());
}

TEST(OccluderFaces, coplanar_l_becomes_two_convex_pieces_that_tile_it) {
  SourceObject wall;
  wall.name = "l";
  wall.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 0, 2}, {2, 0, 2}, {2, 0, 6}, {0, 0, 6}, {0, 0, 2}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 6}, {6, 3, 4}, {6, 4, 5}};
  const auto scene = scene_of({wall});
  const std::vector<Occluder> pieces = polygons_of(*scene);
  ASSERT_EQ(pieces.size(), 2u);
  double area = 0;
  for (const Occluder& piece : pieces) {
    EXPECT_EQ(piece.point_count, 4u);
    EXPECT_EQ(piece.face_of, -1);
    const auto p = scene->points(piece);
    area += 0.5 * length(cross(p[1] - p[0], p[2] - p[0])) +
            0.5 * length(cross(p[2] - p[0], p[3] - p[0]));
  }
  EXPECT_NEAR(area, 16, 1e-12);
}

TEST(OccluderFaces, tessellated_wall_becomes_one_rectangle) {
  SourceObject wall;
  wall.name = "wall";
  for (int j = 0; j <= 6; ++j)
    for (int i = 0; i <= 9; ++i) wall.vertices.emplace_back(i, 2.5, j);
  for (std::uint32_t j = 0; j < 6; ++j)
    for (std::uint32_t i = 0; i < 9; ++i) {
      const std::uint32_t k = j * 10 + i;
      if ((i + j) % 2) {
        wall.triangles.push_back({k, k + 1, k + 11});
        wall.triangles.push_back({k, k + 11, k + 10});
      } else {
        wall.triangles.push_back({k, k + 1, k + 10});
        wall.triangles.push_back({k + 1, k + 11, k + 10});
      }
    }
  const auto pieces = polygons_of(*scene_of({wall}));
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].point_count, 4u);
}

TEST(OccluderFaces, window_is_never_covered_by_a_merged_face) {
  SourceObject wall;  // a ring of eight triangles around a hole
  wall.name = "window";
  wall.vertices = {{0, 0, 0}, {6, 0, 0}, {6, 0, 6}, {0, 0, 6},
                   {2, 0, 2}, {4, 0, 2}, {4, 0, 4}, {2, 0, 4}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    wall.triangles.push_back({i, j, 4 + j});
    wall.triangles.push_back({i, 4 + j, 4 + i});
  }
  const auto scene = scene_of({wall});
  double area = 0;
  for (const Occluder& piece : polygons_of(*scene)) {
    const auto p = scene->points(piece);
    Vec3 sum(0.0);
    for (std::size_t i = 0; i < p.size(); ++i) sum += cross(p[i], p[(i + 1) % p.size()]);
    area += length(sum) / 2;
  }
  EXPECT_NEAR(area, 36 - 4, 1e-12);
}

TEST(OccluderFaces, bent_faces_are_not_merged_and_warped_ones_say_how_flat_they_are) {
  SourceObject quad;
  quad.name = "quad";
  quad.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0.5}};
  quad.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(polygons_of(*scene_of({quad})).size(), 2u);
  quad.vertices[3].z = 1e-5;
  const auto warped = polygons_of(*scene_of({quad}));
  ASSERT_EQ(warped.size(), 1u);
  EXPECT_GT(warped[0].flatness, 2e-6);
  EXPECT_LT(warped[0].flatness, 5e-6);
}

TEST(OccluderFaces, faces_that_look_opposite_ways_are_not_merged_when_one_sided) {
  SourceObject pair;
  pair.name = "pair";
  pair.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 0, 4}, {0, 0, 4}};
  pair.triangles = {{0, 1, 2}, {0, 3, 2}};  // the second looks the other way
  EXPECT_EQ(polygons_of(*scene_of({pair})).size(), 1u);
  pair.two_sided = false;
  EXPECT_EQ(polygons_of(*scene_of({pair})).size(), 2u);
}

// Three points of a line, but for rounding: some area at one corner, no turn at another.
TEST(OccluderFaces, a_needle_that_is_left_with_two_corners_is_none_and_spoils_no_scene) {
  SourceObject needle;
  needle.name = "needle";
  needle.vertices = {{-3.2, -8.700000000000001, -8.9},
                     {1.6, 0.8999999999999999, 0.6999999999999997},
                     {-0.20000000000000018, -2.7000000000000006, -2.900000000000001}};
  needle.triangles = {{0, 1, 2}};
  const auto built = build_scene({.objects = {needle, house()}});
  ASSERT_TRUE(built.ok()) << built.error().text;
  EXPECT_EQ(polygons_of(**built).size(), 6u);  // the house's
}

}  // namespace pvsfarm
