#include <string>

#include "coordinator/generate/city_parts.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr double kGapShare = 0.15;

void add_block(GeneratedScene& scene, const CityRequest& request, const StreetNetwork& network,
               int bx, int by) {
  Random random = stream_of(request.seed, static_cast<std::uint64_t>(by) * kMaxBlocks + bx);
  std::vector<SourceObject>& objects = scene.source.objects;

  SourceObject ground{.name = numbered("ground", {bx, by}), .occluder = false};
  add_ground(ground, network.ground_tile(bx, by), kMaxCoordinate_m);
  objects.push_back(std::move(ground));

  const Vec2 corner{network.block_begin(bx), network.block_begin(by)};
  int number = 0;
  for (const Box& box : make_block(random, corner, network.block_m, {.gap_share = kGapShare}))
    objects.push_back(box_object(numbered("building", {bx, by, number++}), box));
  for (int side = 0; side < 4; ++side)
    add_cars(objects, random,
             {.corner = corner,
              .block_m = network.block_m,
              .side = static_cast<Side>(side),
              .clear_m = 0,
              .prefix = numbered("car", {bx, by}),
              .first = side * kCarsPerSide});
}

}  // namespace

Result<GeneratedScene> generate_city(const CityRequest& request) {
  if (Status s = check_range("--blocks", request.blocks, 1, kMaxBlocks); !s) return s.error();
  const StreetNetwork network{.blocks = request.blocks};
  const double street_area_m2 = network.extent_m() * network.extent_m() -
                                request.blocks * request.blocks * network.block_m * network.block_m;
  if (Status s = check_cell_size(request.cell_size, street_area_m2); !s) return s.error();

  GeneratedScene scene;
  for (int by = 0; by < request.blocks; ++by)
    for (int bx = 0; bx < request.blocks; ++bx) add_block(scene, request, network, bx, by);
  tile_streets(scene.cells, network, request.cell_size);
  return scene;
}

}  // namespace pvsfarm
