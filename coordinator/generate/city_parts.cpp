#include "coordinator/generate/city_parts.hpp"

#include <utility>

#include "coordinator/generate/city_detail.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

// Where neighbours along a side end and begin: equal unless there is a gap.
struct Joint {
  double end = 0, begin = 0;
};

double draw_gap(Random& random, const BlockStyle& style) {
  const bool open = random.unit() < style.gap_share;
  const double width = random.between(0.5, 2);
  return open ? snap(width) : 0;
}

double draw_height(Random& random, const BlockStyle& style) {
  return snap(random.between(style.lowest_m, style.highest_m));
}

// Cuts [0, length] into five fronts, near equal.
std::array<Joint, 4> cut_row(Random& random, double length, const BlockStyle& style) {
  std::array<Joint, 4> joints;
  for (int i = 0; i < 4; ++i) {
    const double at = snap(length * (i + 1) / 5 + random.between(-1.5, 1.5));
    const double gap = draw_gap(random, style);
    joints[i].end = snap(at - gap / 2);
    joints[i].begin = joints[i].end + gap;
  }
  return joints;
}

// A car lies along the side: `along` from its start, `away` from the block's front.
struct CarPlace {
  double along = 0, away = 0;
};

// `car` has x along the side and y away from the front; the result lies in the plane.
Box on_side(const CarRow& row, const Box& car) {
  const bool along_x = row.side == Side::kSouth || row.side == Side::kNorth;
  const bool beyond = row.side == Side::kNorth || row.side == Side::kEast;
  const int along = along_x ? 0 : 1, across = 1 - along;
  Box box = car;
  box.lo[along] = row.corner[along] + car.lo.x;
  box.hi[along] = row.corner[along] + car.hi.x;
  box.lo[across] = row.corner[across] + (beyond ? row.block_m + car.lo.y : -car.hi.y);
  box.hi[across] = row.corner[across] + (beyond ? row.block_m + car.hi.y : -car.lo.y);
  return box;
}

SourceObject make_car(Random& random, const CarRow& row, const CarPlace& place, std::string name) {
  const double half_length = random.between(1.95, 2.35), half_width = random.between(0.85, 0.95);
  const double waist = snap(random.between(0.75, 0.85));
  const double roof = snap(random.between(1.38, kHighestCar_m));
  // The cabin sits behind the bonnet, on whichever end that is.
  const double shift = random.below(2) ? 0.25 : -0.25;
  const auto rectangle = [&](double middle, double half_along, double half_across, double lo,
                             double hi) {
    return on_side(row,
                   {{snap(place.along + middle - half_along), snap(place.away - half_across), lo},
                    {snap(place.along + middle + half_along), snap(place.away + half_across), hi}});
  };
  SourceObject car{.name = std::move(name)};
  const CarShape shape{
      .body = rectangle(0, half_length, half_width, 0, waist),
      .cabin = rectangle(shift, half_length * 0.65, half_width * 0.95, waist, roof),
      .roof = rectangle(shift, half_length * 0.42, half_width * 0.8, waist, roof)};
  if (row.triangles != kPlainCarTriangles) {
    add_detailed_car(car, shape, row.triangles);
    return car;
  }
  add_box(car, shape.body);
  add_frustum(car, shape.cabin, shape.roof);
  return car;
}

}  // namespace

std::vector<Box> make_block(Random& random, const Vec2& corner, double block_m,
                            const BlockStyle& style) {
  std::vector<Box> buildings;
  const auto add = [&](double x0, double y0, double x1, double y1) {
    buildings.push_back({{corner.x + x0, corner.y + y0, 0},
                         {corner.x + x1, corner.y + y1, draw_height(random, style)}});
  };
  // South and north rows; the depths of their corner buildings say where the y sides begin and end.
  std::array<double, 2> west{}, east{};
  for (int north = 0; north < 2; ++north) {
    const std::array<Joint, 4> joints = cut_row(random, block_m, style);
    for (int i = 0; i < 5; ++i) {
      const double depth = snap(random.between(10, 14));
      add(i == 0 ? 0 : joints[i - 1].begin, north ? block_m - depth : 0,
          i == 4 ? block_m : joints[i].end, north ? block_m : depth);
      const double inner = north ? block_m - depth : depth;
      if (i == 0) west[north] = inner;
      if (i == 4) east[north] = inner;
    }
  }
  for (const bool is_east : {false, true}) {
    const auto [first, last] = is_east ? east : west;
    double begin = first + draw_gap(random, style);
    for (int i = 0; i < 3; ++i) {
      const double gap = draw_gap(random, style);
      const double cut = snap(first + (last - first) * (i + 1) / 3 + random.between(-1, 1));
      const double end = (i == 2 ? last : cut) - gap;
      const double depth = snap(random.between(8, 10));
      add(is_east ? block_m - depth : 0, begin, is_east ? block_m : depth, end);
      begin = end + gap;
    }
  }
  return buildings;
}

void add_cars(std::vector<SourceObject>& objects, Random& random, const CarRow& row) {
  constexpr double kLongest_m = 4.7;
  for (int i = 0; i < kCarsPerSide; ++i) {
    const bool parked = i < 8;
    const int slots = parked ? 8 : 2, slot = parked ? i : i - 8;
    const double slot_m = (row.block_m - 2 * row.clear_m) / slots;
    const double play = (slot_m - kLongest_m) / 2 - 0.1;
    const CarPlace place{.along = row.clear_m + slot_m * (slot + 0.5) + random.between(-play, play),
                         .away = parked ? random.between(3.15, 3.45) : random.between(5.45, 5.85)};
    objects.push_back(make_car(random, row, place, numbered(row.prefix, {row.first + i})));
  }
}

}  // namespace pvsfarm
