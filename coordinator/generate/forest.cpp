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

void add_leaf(SourceObject& tree, Random& random, const Vec3& middle) {
  const double size = random.between(0.12, 0.22);
  for (;;) {
    std::array<Vec3, 3> corners;
    for (Vec3& corner : corners) {
      corner = middle + draw_direction(random) * size;
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
  for (int i = 0; i < leaves; ++i)
    add_leaf(tree, random, draw_leaf_middle(random, foot, crown_m, height_m));
  return tree;
}

Status check(const ForestRequest& request, const StreetNetwork& network) {
  if (Status s = check_range("--trees", request.trees, 1, kMaxTrees); !s) return s;
  if (Status s = check_range("--leaves", request.leaves, 0, kMaxLeaves); !s) return s;
  if (static_cast<std::int64_t>(request.trees) * request.leaves > kMaxLeavesInAll)
    return Error{ErrorKind::kCommandLine, "--trees times --leaves must not pass " +
                                              std::to_string(kMaxLeavesInAll) + " triangles"};
  const double blocks_m = network.blocks * network.block_m;
  return check_cell_size(request.cell_size,
                         network.extent_m() * network.extent_m() - blocks_m * blocks_m);
}

}  // namespace

Result<GeneratedScene> generate_forest(const ForestRequest& request) {
  constexpr int kPerCompartment = kTreesPerSide * kTreesPerSide;
  const int compartments = std::max(1, (request.trees + kPerCompartment - 1) / kPerCompartment);
  const StreetNetwork network{
      .blocks = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(compartments)))),
      .block_m = kTreesPerSide * kTreePitch_m,
      .street_m = kRide_m};
  if (Status s = check(request, network); !s) return s.error();

  GeneratedScene scene;
  int planted = 0;
  for (int by = 0; by < network.blocks; ++by)
    for (int bx = 0; bx < network.blocks; ++bx) {
      const int number = by * network.blocks + bx;
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
