#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr int kTreesPerSide = 10;  // of a compartment
constexpr double kTreePitch_m = 4, kRide_m = 6;
constexpr std::int64_t kMaxTrees = 1'000'000, kMaxLeaves = 100'000;
constexpr std::int64_t kMaxLeavesInAll = 200'000'000;

// A point of the cone's volume above the ground, as the middle of a leaf.
Vec3 draw_leaf_middle(Random& random, const Vec3& foot, double crown_m, double height_m) {
  const double up = 1 - std::cbrt(random.unit());  // a cone holds most of its volume below
  const double radius = crown_m * (1 - up) * std::sqrt(random.unit());
  const double angle = 2 * std::numbers::pi * random.unit();
  return {foot.x + radius * std::cos(angle), foot.y + radius * std::sin(angle),
          0.5 + up * (height_m - 0.8)};
}

Vec3 draw_direction(Random& random) {
  const double z = random.between(-1, 1), angle = 2 * std::numbers::pi * random.unit();
  const double flat = std::sqrt(1 - z * z);
  return {flat * std::cos(angle), flat * std::sin(angle), z};
}

void add_leaf(SourceObject& tree, Random& random, const Vec3& middle, double size) {
  for (;;) {
    std::array<Vec3, 3> corners;
    for (Vec3& corner : corners) {
      corner = middle + draw_direction(random) * size;
      corner.z = std::max(corner.z, 0.0);
      for (int a = 0; a < 3; ++a) corner[a] = snap(corner[a]);
    }
    // Slivers are drawn again: no renderer keeps them, and no leaf looks so.
    const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (length(normal) < 0.2 * size * size) continue;
    const auto first = static_cast<std::uint32_t>(tree.vertices.size());
    tree.vertices.insert(tree.vertices.end(), corners.begin(), corners.end());
    tree.triangles.push_back({first, first + 1, first + 2});
    return;
  }
}

SourceObject make_tree(Random& random, const Vec3& slot, int leaves, std::string name) {
  SourceObject tree{.name = std::move(name)};
  const Vec3 foot{snap(slot.x + random.between(-0.5, 0.5)),
                  snap(slot.y + random.between(-0.5, 0.5)), 0};
  const double height_m = random.between(6, 14), crown_m = random.between(0.9, 1.25);
  const double thick = snap(random.between(0.1, 0.18)), top = snap(height_m * 0.9);
  const double tip = snap(thick / 3);
  add_frustum(tree, {foot - Vec3{thick, thick, 0}, foot + Vec3{thick, thick, 0}},
              {{foot.x - tip, foot.y - tip, top}, {foot.x + tip, foot.y + tip, top}});
  for (int i = 0; i < leaves; ++i) {
    const Vec3 middle = draw_leaf_middle(random, foot, crown_m, height_m);
    add_leaf(tree, random, middle, random.between(0.12, 0.22));
  }
  return tree;
}

Status check(const ForestRequest& request, const StreetNetwork& network) {
  if (Status s = check_range("--trees", request.trees, 1, kMaxTrees); !s) return s;
  if (Status s = check_range("--leaves", request.leaves, 0, kMaxLeaves); !s) return s;
  if (static_cast<std::int64_t>(request.trees) * request.leaves > kMaxLeavesInAll)
    return Error{ErrorKind::kCommandLine, "--trees times --leaves must not pass " +
                                              std::to_string(kMaxLeavesInAll) + " triangles"};
  return check_cell_size(request.cell_size, network.street_area_m2());
}

// A thicket: trees on a jittered grid, crowns as upright cylinders that reach into each other.
constexpr double kCrown_m = 2.2;

// Whether a leaf around `middle` may reach into a glade of the grid; `size` is its reach.
bool near_glade(const std::vector<Vec3>& glades, double half_m, const Vec3& middle, double size) {
  for (const Vec3& glade : glades)
    if (std::abs(middle.x - glade.x) < half_m + size &&
        std::abs(middle.y - glade.y) < half_m + size)
      return true;
  return false;
}

SourceObject make_leafy_tree(Random& random, const Vec3& slot, const ForestRequest& request,
                             const std::vector<Vec3>& glades, std::string name) {
  SourceObject tree{.name = std::move(name)};
  const Vec3 foot{snap(slot.x + random.between(-0.5, 0.5)),
                  snap(slot.y + random.between(-0.5, 0.5)), 0};
  const double height_m = random.between(6, 9), thick = snap(random.between(0.08, 0.12));
  const double top = snap(height_m * 0.9), tip = snap(thick / 3);
  add_frustum(tree, {foot - Vec3{thick, thick, 0}, foot + Vec3{thick, thick, 0}},
              {{foot.x - tip, foot.y - tip, top}, {foot.x + tip, foot.y + tip, top}});
  const double half_m = 0.5 * request.cell_size + kClearOfFronts_m;
  for (int i = 0; i < request.leaves;) {
    const double radius = kCrown_m * std::sqrt(random.unit());
    const double angle = 2 * std::numbers::pi * random.unit();
    const double size = request.leaf_size * random.between(0.7, 1.3);
    const Vec3 middle{foot.x + radius * std::cos(angle), foot.y + radius * std::sin(angle),
                      random.unit() * height_m};
    if (near_glade(glades, half_m, middle, size)) continue;  // the next may fit
    add_leaf(tree, random, middle, size);
    ++i;
  }
  return tree;
}

Status check_thicket(const ForestRequest& request) {
  if (Status s = check_range("--trees", request.trees, 1, kMaxTrees); !s) return s;
  if (Status s = check_range("--leaves", request.leaves, 0, kMaxLeaves); !s) return s;
  if (Status s = check_range("--glades", request.glades, 1, request.trees); !s) return s;
  if (!(request.cell_size >= kMinCellSize_m && request.cell_size <= kTreePitch_m - 1))
    return Error{ErrorKind::kCommandLine, "--cell-size of a glade must be from 0.125 to 3"};
  if (!(request.leaf_size >= 0.01 && request.leaf_size <= 2))
    return Error{ErrorKind::kCommandLine, "--leaf-size must be a number of metres from 0.01 to 2"};
  if (static_cast<std::int64_t>(request.trees) * request.leaves > kMaxLeavesInAll)
    return Error{ErrorKind::kCommandLine, "--trees times --leaves must not pass " +
                                              std::to_string(kMaxLeavesInAll) + " triangles"};
  return {};
}

Result<GeneratedScene> generate_thicket(const ForestRequest& request) {
  if (Status s = check_thicket(request); !s) return s.error();
  const std::int64_t slots = std::int64_t{request.trees} + request.glades;
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(slots))));
  const auto middle_of = [&](std::int64_t slot) {
    return Vec3{(static_cast<double>(slot % side) + 0.5) * kTreePitch_m,
                (static_cast<double>(slot / side) + 0.5) * kTreePitch_m, 0};
  };
  GeneratedScene scene;
  SourceObject ground{.name = numbered("ground", {0}), .occluder = false};
  add_ground(ground, {{0, 0, 0}, {side * kTreePitch_m, side * kTreePitch_m, 0}}, kMaxCoordinate_m);
  scene.source.objects.push_back(std::move(ground));
  // Glade g is slot (g + 1/2) slots / glades: evenly many trees between, on other columns each row.
  const auto glade_slot = [&](std::int64_t g) {
    return (2 * g + 1) * slots / (2 * request.glades);
  };
  std::vector<Vec3> glades;
  for (int g = 0; g < request.glades; ++g) glades.push_back(middle_of(glade_slot(g)));
  int planted = 0, glade = 0;
  for (std::int64_t slot = 0; slot < slots; ++slot) {
    if (glade < request.glades && slot == glade_slot(glade)) {
      ++glade;
      continue;
    }
    const Vec3 at = middle_of(slot);
    std::vector<Vec3> near;
    for (const Vec3& g : glades)
      if (std::max(std::abs(g.x - at.x), std::abs(g.y - at.y)) < 3 * kTreePitch_m)
        near.push_back(g);
    Random random = stream_of(request.seed, static_cast<std::uint64_t>(slot));
    scene.source.objects.push_back(
        make_leafy_tree(random, at, request, near, numbered("tree", {planted})));
    ++planted;
  }
  const Vec3 half{snap(0.5 * request.cell_size), snap(0.5 * request.cell_size), 0};
  for (const Vec3& g : glades) tile_cells(scene.cells, {g - half, g + half}, 2 * half.x);
  return scene;
}

}  // namespace

Result<GeneratedScene> generate_forest(const ForestRequest& request) {
  if (request.glades != 0) return generate_thicket(request);
  constexpr int kPerCompartment = kTreesPerSide * kTreesPerSide;
  const int compartments = std::max(1, (request.trees + kPerCompartment - 1) / kPerCompartment);
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(compartments))));
  const StreetNetwork network{
      .columns = side, .rows = side, .block_m = kTreesPerSide * kTreePitch_m, .street_m = kRide_m};
  if (Status s = check(request, network); !s) return s.error();

  GeneratedScene scene;
  int planted = 0;
  for (int by = 0; by < network.rows; ++by)
    for (int bx = 0; bx < network.columns; ++bx) {
      const int number = by * network.columns + bx;
      Random random = stream_of(request.seed, static_cast<std::uint64_t>(number));
      SourceObject ground{.name = numbered("ground", {number}), .occluder = false};
      add_ground(ground, network.ground_tile(bx, by), kMaxCoordinate_m);
      scene.source.objects.push_back(std::move(ground));
      for (int i = 0; i < kPerCompartment && planted < request.trees; ++i, ++planted) {
        const Vec3 slot{network.block_begin(bx) + (i % kTreesPerSide + 0.5) * kTreePitch_m,
                        network.block_begin(by) + (i / kTreesPerSide + 0.5) * kTreePitch_m, 0};
        scene.source.objects.push_back(
            make_tree(random, slot, request.leaves, numbered("tree", {planted})));
      }
    }
  tile_streets(scene.cells, network, request.cell_size);
  return scene;
}

}  // namespace pvsfarm
