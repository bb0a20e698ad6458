// The generated scenes keep the promises of coordinator/generate/generate.hpp.
#include "coordinator/generate/generate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "tests/unit/generated_boxes.hpp"

namespace pvsfarm {
namespace {

// A pair of coincident opposite edges, for every edge: what a closed oriented surface has.
void expect_closed(const SourceObject& object,
                   const std::vector<std::array<std::uint32_t, 3>>& of) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : of)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1) << object.name;
    EXPECT_TRUE(edges.contains({edge.second, edge.first})) << object.name;
  }
  double six_volumes = 0;
  for (const auto& t : of)
    six_volumes += dot(object.vertices[t[0]], cross(object.vertices[t[1]], object.vertices[t[2]]));
  EXPECT_GT(six_volumes, 0) << object.name << " is turned inside out";
}

struct Scene {
  const char* name;
  std::function<Result<GeneratedScene>(std::uint64_t seed)> make;
};

std::ostream& operator<<(std::ostream& out, const Scene& scene) { return out << scene.name; }

const Scene kScenes[] = {
    {"city", [](std::uint64_t seed) { return generate_city({.blocks = 3, .seed = seed}); }},
    {"large_city",
     [](std::uint64_t seed) {
       return generate_city({.blocks = 2,
                             .cell_size = 21,
                             .seed = seed,
                             .districts = 2,
                             .lanes = 2,
                             .cars = 37,
                             .building_triangles = 96,
                             .car_triangles = 1400,
                             .moving_cars = true});
     }},
    {"closed_city",
     [](std::uint64_t seed) { return generate_closed_city({.blocks = 3, .seed = seed}); }},
    {"forest",
     [](std::uint64_t seed) {
       return generate_forest({.trees = 150, .leaves = 40, .seed = seed});
     }},
    {"thicket",
     [](std::uint64_t seed) {
       return generate_forest(
           {.trees = 150, .leaves = 40, .cell_size = 2, .glades = 6, .seed = seed});
     }},
    {"rooms", [](std::uint64_t seed) { return generate_rooms({.rooms = 4, .seed = seed}); }},
    {"terrain", [](std::uint64_t seed) { return generate_terrain({.tiles = 3, .seed = seed}); }},
    {"maze", [](std::uint64_t seed) { return generate_maze({.size = 12, .seed = seed}); }},
};

class EveryScene : public testing::TestWithParam<Scene> {
 protected:
  GeneratedScene make(std::uint64_t seed) { return GetParam().make(seed).value(); }
};

bool same(const GeneratedScene& a, const GeneratedScene& b) {
  if (a.source.objects.size() != b.source.objects.size() || a.cells.size() != b.cells.size())
    return false;
  for (std::size_t i = 0; i < a.source.objects.size(); ++i) {
    const SourceObject &p = a.source.objects[i], &q = b.source.objects[i];
    if (p.name != q.name || p.vertices != q.vertices || p.triangles != q.triangles) return false;
  }
  for (std::size_t i = 0; i < a.cells.size(); ++i)
    if (!(a.cells[i].cell == b.cells[i].cell) || a.cells[i].id != b.cells[i].id) return false;
  return true;
}

TEST_P(EveryScene, is_the_same_for_the_same_seed_only) {
  EXPECT_TRUE(same(make(5), make(5)));
  EXPECT_FALSE(same(make(5), make(6)));
}

TEST_P(EveryScene, has_coordinates_that_survive_float32_and_triangles_that_have_an_area) {
  for (const SourceObject& object : make(1).source.objects) {
    for (const Vec3& v : object.vertices)
      for (int a = 0; a < 3; ++a) {
        ASSERT_EQ(v[a] * 1024, std::nearbyint(v[a] * 1024)) << object.name;
        ASSERT_EQ(static_cast<double>(static_cast<float>(v[a])), v[a]) << object.name;
      }
    for (const auto& t : object.triangles) {
      const Vec3 a = object.vertices[t[0]];
      ASSERT_GT(length(cross(object.vertices[t[1]] - a, object.vertices[t[2]] - a)), 1e-4)
          << object.name;
    }
  }
}

TEST_P(EveryScene, has_names_and_cell_ids_of_their_own) {
  const GeneratedScene scene = make(1);
  std::set<std::string> names;
  for (const SourceObject& object : scene.source.objects) names.insert(object.name);
  EXPECT_EQ(names.size(), scene.source.objects.size());
  ASSERT_FALSE(scene.cells.empty());
  for (std::size_t i = 0; i < scene.cells.size(); ++i)
    ASSERT_EQ(scene.cells[i].id, static_cast<std::int64_t>(i));
}

TEST_P(EveryScene, has_cells_that_overlap_neither_each_other_nor_any_object) {
  const GeneratedScene scene = make(1);
  const std::vector<Box> cells = cell_boxes(scene);
  EXPECT_EQ(overlaps(cells, cells), cells.size());  // each with itself
  std::vector<Box> solids;
  for (const SourceObject& object : scene.source.objects)
    // A wall's box spans its opening, a terrain tile's the air in its valleys; below.
    if (!is_a(object, "wall_x") && !is_a(object, "wall_y") && !is_a(object, "terrain"))
      solids.push_back(box_of(object));
  EXPECT_EQ(overlaps(cells, solids), 0u);
}

TEST_P(EveryScene, has_solids_that_are_closed_and_turned_outwards) {
  for (const SourceObject& object : make(1).source.objects) {
    if (is_a(object, "ground") || is_a(object, "floor") || is_a(object, "ceiling") ||
        is_a(object, "terrain"))
      continue;
    std::vector<std::array<std::uint32_t, 3>> closed = object.triangles;
    if (is_a(object, "tree")) closed.resize(12);  // the trunk; leaves are single triangles
    expect_closed(object, closed);
  }
}

INSTANTIATE_TEST_SUITE_P(Generate, EveryScene, testing::ValuesIn(kScenes),
                         [](const auto& scene_info) { return scene_info.param.name; });

TEST(Terrain, has_tiles_that_share_their_border_bit_for_bit) {
  const GeneratedScene scene = generate_terrain({.tiles = 3}).value();
  std::map<std::pair<double, double>, std::set<double>> heights;
  std::map<std::pair<double, double>, int> tiles_at;
  for (const SourceObject& object : scene.source.objects)
    if (is_a(object, "terrain"))
      for (const Vec3& v : object.vertices) {
        heights[{v.x, v.y}].insert(v.z);
        ++tiles_at[{v.x, v.y}];
      }
  int shared = 0;
  for (const auto& [place, zs] : heights) {
    EXPECT_EQ(zs.size(), 1u);
    shared += tiles_at[place] > 1;
  }
  EXPECT_EQ(shared, 2 * 2 * (3 * 16 + 1) - 4);  // two lines each way, counted once where they cross
}

TEST(Terrain, has_cells_that_stay_above_the_ground_and_hold_every_eye) {
  const GeneratedScene scene = generate_terrain({.tiles = 4}).value();
  std::map<std::pair<double, double>, double> ground;
  for (const SourceObject& object : scene.source.objects)
    if (is_a(object, "terrain"))
      for (const Vec3& v : object.vertices) ground[{v.x, v.y}] = v.z;
  for (const Box& cell : cell_boxes(scene))
    for (double y = std::floor(cell.lo.y / 4) * 4; y < cell.hi.y + 4; y += 4)
      for (double x = std::floor(cell.lo.x / 4) * 4; x < cell.hi.x + 4; x += 4) {
        if (!ground.contains({x, y})) continue;
        if (x < cell.lo.x || x > cell.hi.x || y < cell.lo.y || y > cell.hi.y) continue;
        const double z = ground[{x, y}];
        EXPECT_LT(z, cell.lo.z);
        EXPECT_LE(cell.lo.z, z + kEyeLow_m);
        EXPECT_GE(cell.hi.z, z + kEyeHigh_m);
      }
}

// Cells that touch, flooded from the first one, are all of them: no room or place is cut off.
std::size_t reachable_cells(const GeneratedScene& scene) {
  const std::vector<Box> cells = cell_boxes(scene);
  const auto share_a_side = [](const Box& a, const Box& b) {
    if (!a.meets(b)) return false;
    int touching = 0;
    for (int axis = 0; axis < 2; ++axis)
      touching += a.hi[axis] == b.lo[axis] || b.hi[axis] == a.lo[axis];
    return touching == 1;
  };
  std::vector<bool> seen(cells.size());
  std::vector<std::size_t> open{0};
  seen[0] = true;
  std::size_t count = 0;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    ++count;
    for (std::size_t next = 0; next < cells.size(); ++next)
      if (!seen[next] && share_a_side(cells[at], cells[next]))
        seen[next] = true, open.push_back(next);
  }
  return count;
}

TEST(Rooms, are_all_connected_by_doors) {
  const GeneratedScene scene = generate_rooms({.rooms = 6}).value();
  EXPECT_EQ(reachable_cells(scene), scene.cells.size());
}

TEST(Maze, connects_every_place_by_one_way_only) {
  const GeneratedScene scene = generate_maze({.size = 15}).value();
  EXPECT_EQ(reachable_cells(scene), scene.cells.size());
  EXPECT_EQ(scene.cells.size(), 15u * 15u + (15u * 15u - 1));  // a tree: places and passages
}

// The doorway's cells lie in the wall's box, but in its opening.
TEST(Rooms, have_door_cells_in_openings) {
  const GeneratedScene scene = generate_rooms({.rooms = 4}).value();
  std::size_t doors = 0;
  for (const SourceObject& wall : scene.source.objects) {
    if (!is_a(wall, "wall_x") && !is_a(wall, "wall_y")) continue;
    for (const Box& cell : cell_boxes(scene)) {
      if (!overlap(cell, box_of(wall))) continue;
      ++doors;
      for (const auto& t : wall.triangles) {
        Box triangle;
        for (const std::uint32_t v : t) triangle.add(wall.vertices[v]);
        Box inside = cell;
        for (int a = 0; a < 3; ++a) inside.lo[a] += 1e-6, inside.hi[a] -= 1e-6;
        EXPECT_FALSE(triangle.meets(inside)) << wall.name;
      }
    }
  }
  EXPECT_GE(doors, 15u);  // what connects 16 rooms
}

TEST(Generate, refuses_what_is_out_of_range_and_names_the_option) {
  const auto text = [](const Result<GeneratedScene>& result) {
    EXPECT_FALSE(result.ok());
    EXPECT_EQ(result.error().kind, ErrorKind::kCommandLine);
    return result.error().text;
  };
  EXPECT_NE(text(generate_city({.blocks = 0})).find("--blocks"), std::string::npos);
  EXPECT_NE(text(generate_city({.blocks = 100000})).find("--blocks"), std::string::npos);
  EXPECT_NE(text(generate_closed_city({.blocks = 1})).find("--blocks"), std::string::npos);
  EXPECT_NE(text(generate_city({.cell_size = 0})).find("--cell-size"), std::string::npos);
  EXPECT_NE(text(generate_city({.cell_size = std::nan("")})).find("--cell-size"),
            std::string::npos);
  EXPECT_NE(text(generate_city({.blocks = 200, .cell_size = 0.125})).find("cells"),
            std::string::npos);
  EXPECT_NE(text(generate_forest({.trees = -1})).find("--trees"), std::string::npos);
  EXPECT_NE(text(generate_forest({.trees = 1000000, .leaves = 100000})).find("--leaves"),
            std::string::npos);
  EXPECT_NE(text(generate_forest({.glades = 2001})).find("--glades"), std::string::npos);
  EXPECT_NE(text(generate_forest({.cell_size = 5, .glades = 2})).find("--cell-size"),
            std::string::npos);
  EXPECT_NE(
      text(generate_forest({.cell_size = 2, .glades = 2, .leaf_size = 3})).find("--leaf-size"),
      std::string::npos);
  EXPECT_NE(text(generate_terrain({.houses_per_tile = 5})).find("--houses"), std::string::npos);
  EXPECT_NE(text(generate_rooms({.rooms = 501})).find("--rooms"), std::string::npos);
  EXPECT_NE(text(generate_maze({.size = 0})).find("--size"), std::string::npos);
}

}  // namespace
}  // namespace pvsfarm
