#include <algorithm>
#include <cmath>
#include <string>

#include "coordinator/generate/city_detail.hpp"
#include "coordinator/generate/city_parts.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr double kGapShare = 0.15;

// Districts side by side: columns x rows, as near to a square as their number allows.
struct Districts {
  int columns = 1, rows = 1;
  explicit Districts(int count) : columns(count) {
    for (int r = 1; r * r <= count; ++r)
      if (count % r == 0) rows = r, columns = count / r;
  }
};

StreetNetwork network_of(const CityRequest& request) {
  const Districts districts(request.districts);
  return {.columns = request.blocks * districts.columns, .rows = request.blocks * districts.rows};
}

int most_cars(const StreetNetwork& network) {
  return network.columns * network.rows * kCarsPerBlock;
}

// Of all places for a car, as many as there are cars, evenly.
bool holds_car(std::int64_t place, std::int64_t cars, std::int64_t places) {
  return (place + 1) * cars / places > place * cars / places;
}

void add_block_cars(GeneratedScene& scene, Random& random, const CityRequest& request,
                    const StreetNetwork& network, int bx, int by) {
  std::vector<SourceObject> cars;
  for (int side = 0; side < 4; ++side)
    add_cars(cars, random,
             {.corner = {network.block_begin(bx), network.block_begin(by)},
              .block_m = network.block_m,
              .side = static_cast<Side>(side),
              .clear_m = 0,
              .prefix = numbered("car", {bx, by}),
              .first = side * kCarsPerSide,
              .triangles = request.car_triangles});
  const std::int64_t places = most_cars(network);
  std::int64_t place = (static_cast<std::int64_t>(by) * network.columns + bx) * kCarsPerBlock;
  for (SourceObject& car : cars) {
    car.dynamic = request.moving_cars;
    if (holds_car(place++, request.cars < 0 ? places : request.cars, places))
      scene.source.objects.push_back(std::move(car));
  }
}

void add_block(GeneratedScene& scene, const CityRequest& request, const StreetNetwork& network,
               int bx, int by) {
  Random random = stream_of(request.seed, static_cast<std::uint64_t>(by) * kMaxBlocks + bx);
  std::vector<SourceObject>& objects = scene.source.objects;

  SourceObject ground{.name = numbered("ground", {bx, by}), .occluder = false};
  add_ground(ground, network.ground_tile(bx, by), kMaxCoordinate_m);
  objects.push_back(std::move(ground));

  const Vec2 corner{network.block_begin(bx), network.block_begin(by)};
  const Box block{{corner.x, corner.y, 0},
                  {corner.x + network.block_m, corner.y + network.block_m, 0}};
  const int ledges = request.building_triangles / kTrianglesPerLedge - 1;
  int number = 0;
  for (const Box& box : make_block(random, corner, network.block_m, {.gap_share = kGapShare})) {
    objects.push_back(box_object(numbered("building", {bx, by, number++}), box));
    add_ledges(objects.back(), box, block, ledges);
  }
  add_block_cars(scene, random, request, network, bx, by);
}

Status check_detail(const CityRequest& request, const StreetNetwork& network) {
  if (Status s = check_range("--cars", request.cars, -1, most_cars(network)); !s) return s;
  if (Status s = check_range("--building-triangles", request.building_triangles, kTrianglesPerLedge,
                             kMaxBuildingTriangles);
      !s)
    return s;
  if (request.building_triangles % kTrianglesPerLedge != 0)
    return Error{ErrorKind::kCommandLine, "--building-triangles must be a multiple of 12"};
  if (request.car_triangles == kPlainCarTriangles) return {};
  if (Status s = check_range("--car-triangles", request.car_triangles, kMinDetailedCarTriangles,
                             kMaxDetailedCarTriangles);
      !s)
    return s;
  if (request.car_triangles % 4 != 0)
    return Error{ErrorKind::kCommandLine, "--car-triangles must be a multiple of 4"};
  return {};
}

Status check(const CityRequest& request) {
  if (Status s = check_range("--blocks", request.blocks, 1, kMaxBlocks); !s) return s;
  if (Status s = check_range("--districts", request.districts, 1, kMaxBlocks); !s) return s;
  if (Status s = check_range("--lanes", request.lanes, 0, kMaxLanes); !s) return s;
  const StreetNetwork network = network_of(request);
  if (std::max(network.columns, network.rows) > kMaxBlocks)
    return Error{ErrorKind::kCommandLine, "--blocks and --districts make a city of more than " +
                                              std::to_string(kMaxBlocks) + " blocks along a side"};
  if (Status s = check_detail(request, network); !s) return s;
  const StreetNetwork tiled{.columns = request.blocks, .rows = request.blocks};
  const double narrow_m = request.lanes > 0 ? network.street_m / request.lanes : request.cell_size;
  if (Status s = check_cell_size(request.cell_size, tiled.street_area_m2()); !s) return s;
  return check_cell_size(std::min(narrow_m, request.cell_size), tiled.street_area_m2());
}

}  // namespace

Result<GeneratedScene> generate_city(const CityRequest& request) {
  if (Status s = check(request); !s) return s.error();
  const StreetNetwork network = network_of(request);
  GeneratedScene scene;
  for (int by = 0; by < network.rows; ++by)
    for (int bx = 0; bx < network.columns; ++bx) add_block(scene, request, network, bx, by);

  const Districts districts(request.districts);
  const int column = (districts.columns - 1) / 2 * request.blocks;
  const int row = (districts.rows - 1) / 2 * request.blocks;
  const double across_m = network.street_m - 2 * kClearOfFronts_m;
  const int square = std::max(1, static_cast<int>(std::ceil(across_m / request.cell_size - 1e-9)));
  tile_lanes(scene.cells, network,
             {.cell_size = request.cell_size,
              .abreast = request.lanes > 0 ? request.lanes : square,
              .first_column = column,
              .columns = request.blocks,
              .first_row = row,
              .rows = request.blocks});
  return scene;
}

}  // namespace pvsfarm
