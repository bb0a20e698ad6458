#include "coordinator/generate/city_detail.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "coordinator/generate/generated_scene.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr double kClearance_m = 0.25;  // of a car's body above the ground
constexpr double kWheelRadius_m = 0.3125, kWheelWidth_m = 0.1875;
constexpr int kMinWheelCorners = 8;
constexpr double kWheelOut_m = 0.0625;  // of the body's flank

// A side of a building that looks at a street.
struct Front {
  int across = 0;        // the axis it looks along
  bool is_high = false;  // towards larger coordinates
};

std::vector<Front> fronts_of(const Box& building, const Box& block) {
  std::vector<Front> fronts;
  for (int a = 0; a < 2; ++a) {
    if (building.lo[a] == block.lo[a]) fronts.push_back({a, false});
    if (building.hi[a] == block.hi[a]) fronts.push_back({a, true});
  }
  return fronts;
}

// In rows and columns of near square places, each ledge low in the middle of its place.
void add_front_ledges(SourceObject& object, const Box& building, const Front& front, int count) {
  const int along = 1 - front.across;
  const double width = building.size()[along], height = building.size().z;
  const int columns = std::max(1, static_cast<int>(std::sqrt(count * width / height)));
  const int rows = (count + columns - 1) / columns;
  for (int i = 0; i < count; ++i) {
    const double place_m = width / columns, storey_m = height / rows;
    const double left = building.lo[along] + (i % columns + 0.2) * place_m;
    const double low = building.lo.z + (i / columns + 0.3) * storey_m;
    Box ledge;
    ledge.lo[along] = snap(left), ledge.hi[along] = snap(left + 0.6 * place_m);
    ledge.lo.z = snap(low), ledge.hi.z = snap(low + std::min(0.5, 0.4 * storey_m));
    const double face = front.is_high ? building.hi[front.across] : building.lo[front.across];
    ledge.lo[front.across] = front.is_high ? face : face - kLedgeDepth_m;
    ledge.hi[front.across] = front.is_high ? face + kLedgeDepth_m : face;
    add_box(object, ledge);
  }
}

using Cuts = std::array<int, 3>;

int triangles_of(const Cuts& c) { return 4 * (c[0] * c[1] + c[1] * c[2] + c[2] * c[0]); }

// Cuts of a hull in `k` pieces along its length: near square for a car's proportions.
struct HullCuts {
  Cuts body, cabin;  // along the car, across, up
  explicit HullCuts(int k)
      : body{k, std::max(1, k / 2), std::max(1, k / 6)},
        cabin{std::max(1, 2 * k / 3), std::max(1, k / 2), std::max(1, k / 6)} {}
  int triangles() const { return triangles_of(body) + triangles_of(cabin); }
};

Cuts turned(Cuts cuts, int along) {
  if (along == 1) std::swap(cuts[0], cuts[1]);
  return cuts;
}

// A closed cylinder of 4 * corners - 4 triangles with its axle along `across`, inside `box`.
void add_wheel(SourceObject& car, const Box& box, int across, int corners) {
  const int along = 1 - across;
  const Vec3 middle = box.center();
  std::vector<Vec2> profile;
  for (int i = 0; i < corners; ++i) {
    // The first corner stands on the ground.
    const double angle = 2 * std::numbers::pi * i / corners - std::numbers::pi / 2;
    const double u = kWheelRadius_m * std::cos(angle), v = kWheelRadius_m * std::sin(angle);
    // add_prism mirrors the profile of what runs along y.
    profile.push_back(
        {snap((across == 1 ? -middle[along] : middle[along]) + u), snap(middle.z + v)});
  }
  add_prism(car, {profile, box.lo[across], box.hi[across], across == 1});
}

}  // namespace

void add_ledges(SourceObject& object, const Box& building, const Box& block, int count) {
  const std::vector<Front> fronts = fronts_of(building, block);
  PVS_CHECK(!fronts.empty());
  const int sides = static_cast<int>(fronts.size());
  for (int i = 0; i < sides; ++i) {
    const int share = count * (i + 1) / sides - count * i / sides;
    if (share > 0) add_front_ledges(object, building, fronts[i], share);
  }
}

void add_detailed_car(SourceObject& car, const CarShape& shape, int triangles) {
  PVS_CHECK(triangles % 4 == 0 && triangles >= kMinDetailedCarTriangles);
  const int along = shape.body.size().x > shape.body.size().y ? 0 : 1, across = 1 - along;
  // 1. As many as fit are the hull's, what remains the wheels'.
  int k = 1;
  while (HullCuts(k + 1).triangles() <= triangles - 4 * (4 * kMinWheelCorners - 4)) ++k;
  const HullCuts cuts(k);
  Box body = shape.body;
  body.lo.z += kClearance_m;
  body.lo[across] += kWheelOut_m;
  body.hi[across] -= kWheelOut_m;
  add_frustum(car, body, body, turned(cuts.body, along));
  add_frustum(car, shape.cabin, shape.roof, turned(cuts.cabin, along));

  // 2. Four wheels.
  const int corners = (triangles - cuts.triangles()) / 4 + 4;  // of all four
  for (int w = 0; w < 4; ++w) {
    const bool front = w % 2 == 1, left = w / 2 == 1;
    const double length_m = shape.body.size()[along];
    const double axle = snap(shape.body.lo[along] + length_m * (front ? 0.8 : 0.2));
    Box wheel;
    wheel.lo[along] = axle - kWheelRadius_m, wheel.hi[along] = axle + kWheelRadius_m;
    wheel.lo[across] = left ? shape.body.hi[across] - kWheelWidth_m : shape.body.lo[across];
    wheel.hi[across] = wheel.lo[across] + kWheelWidth_m;
    wheel.lo.z = 0, wheel.hi.z = 2 * kWheelRadius_m;
    add_wheel(car, wheel, across, corners * (w + 1) / 4 - corners * w / 4);
  }
}

}  // namespace pvsfarm
