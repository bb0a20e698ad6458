// Why nothing shows over the roofs. Seen from at most 14 m before a front (a street's width), at
// 1.5 m or higher, a roof at 24 m hides whatever stands d metres behind the front and reaches no
// higher than 24 + d * (24 - 1.9) / 14. Nothing but the front's own buildings stands nearer than
// 10 m behind it (make_block), where that is 39.8 m; the highest building has 35 m. A gate is as
// high as the highest building, so nothing behind it shows however far off it is.
#include <string>

#include "coordinator/generate/city_parts.hpp"
#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr double kLowest_m = 24, kHighest_m = 35;
constexpr double kGateDepth_m = 6;

// A street or court with the gates at its ends.
struct ClosedStreet {
  Box box;        // from front to front, gates included; z = 0
  int along = 0;  // axis
};

// Only the streets between blocks exist: number 1 to blocks - 1.
std::vector<ClosedStreet> closed_streets(const StreetNetwork& network) {
  std::vector<ClosedStreet> streets;
  const double begin = network.block_begin(0);
  const double end = network.block_begin(network.columns - 1) + network.block_m;
  for (int s = 1; s < network.columns; ++s) {
    const double lo = network.street_begin(s), hi = lo + network.street_m;
    streets.push_back({{{begin, lo, 0}, {end, hi, 0}}, 0});
    for (int b = 0; b < network.columns; ++b) {
      const double from = network.block_begin(b);
      streets.push_back({{{lo, from, 0}, {hi, from + network.block_m, 0}}, 1});
    }
  }
  return streets;
}

Box free_space(const ClosedStreet& street) {
  Box box = street.box;
  box.lo[street.along] += kGateDepth_m;
  box.hi[street.along] -= kGateDepth_m;
  return box;
}

void add_gates(std::vector<SourceObject>& objects, const ClosedStreet& street, int number) {
  const Box open = free_space(street);
  Box low = street.box, high = street.box;
  low.hi[street.along] = open.lo[street.along];
  high.lo[street.along] = open.hi[street.along];
  low.hi.z = high.hi.z = kHighest_m;
  objects.push_back(box_object(numbered("gate_low", {number}), low));
  objects.push_back(box_object(numbered("gate_high", {number}), high));
}

void add_block(GeneratedScene& scene, const CityRequest& request, const StreetNetwork& network,
               int bx, int by) {
  Random random = stream_of(request.seed, static_cast<std::uint64_t>(by) * kMaxBlocks + bx);
  const Vec2 corner{network.block_begin(bx), network.block_begin(by)};
  const BlockStyle style{.lowest_m = kLowest_m, .highest_m = kHighest_m, .gap_share = 0};
  int number = 0;
  for (const Box& box : make_block(random, corner, network.block_m, style))
    scene.source.objects.push_back(box_object(numbered("building", {bx, by, number++}), box));

  const int last = network.columns - 1;
  const std::array<bool, 4> has_street{by > 0, by<last, bx> 0, bx < last};
  for (int side = 0; side < 4; ++side) {
    if (!has_street[side]) continue;
    add_cars(scene.source.objects, random,
             {.corner = corner,
              .block_m = network.block_m,
              .side = static_cast<Side>(side),
              .clear_m = kGateDepth_m + 0.5,
              .prefix = numbered("car", {bx, by}),
              .first = side * kCarsPerSide});
  }
}

}  // namespace

std::vector<Box> closed_city_streets(const CityRequest& request) {
  std::vector<Box> boxes;
  for (const ClosedStreet& street :
       closed_streets({.columns = request.blocks, .rows = request.blocks})) {
    boxes.push_back(free_space(street));
    boxes.back().hi.z = kHighest_m;
  }
  return boxes;
}

Result<GeneratedScene> generate_closed_city(const CityRequest& request) {
  if (Status s = check_range("--blocks", request.blocks, 2, kMaxBlocks); !s) return s.error();
  const StreetNetwork network{.columns = request.blocks, .rows = request.blocks};
  const std::vector<ClosedStreet> streets = closed_streets(network);
  double street_area_m2 = 0;
  for (const ClosedStreet& s : streets) street_area_m2 += s.box.size().x * s.box.size().y;
  if (Status s = check_cell_size(request.cell_size, street_area_m2); !s) return s.error();

  GeneratedScene scene;
  for (int by = 0; by < request.blocks; ++by)
    for (int bx = 0; bx < request.blocks; ++bx) add_block(scene, request, network, bx, by);
  int number = 0;
  for (const ClosedStreet& street : streets) {
    SourceObject ground{.name = numbered("ground", {number}), .occluder = false};
    add_ground(ground, street.box, kMaxCoordinate_m);
    scene.source.objects.push_back(std::move(ground));
    add_gates(scene.source.objects, street, number++);
    tile_cells(scene.cells, free_space(street), request.cell_size);
  }
  return scene;
}

}  // namespace pvsfarm
