// What the city and the closed city are built of: blocks of buildings and the cars around them.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/geometry/box.hpp"
#include "coordinator/generate/generated_scene.hpp"

namespace pvsfarm {

struct BlockStyle {
  double lowest_m = 9, highest_m = 35;
  double gap_share = 0;  // of the joints between neighbours
};
// The 16 buildings of the block that begins at `corner`: five along each x side, corners included,
// three along each y side. Buildings are 8 to 14 m deep; behind a y side's front nothing but what
// touches it stands nearer than 10 m, which the closed city relies on.
std::vector<Box> make_block(Random& random, const Vec2& corner, double block_m,
                            const BlockStyle& style);

// The sides of a block, by the street a car stands in.
enum class Side : int { kSouth, kNorth, kWest, kEast };

struct CarRow {
  Vec2 corner;  // of the block
  double block_m = 60;
  Side side = Side::kSouth;
  double clear_m = 0;  // at both ends of the side, where no car stands
  std::string prefix;  // of the names; numbers from `first` on follow
  int first = 0;
  int triangles = 24;  // of a car; see city_detail.hpp
};
inline constexpr int kCarsPerSide = 10;
inline constexpr double kHighestCar_m = 1.48;
// Eight cars parked along the kerb and two on the lane beside, within 7 m of the block and clear of
// each other. A car is a closed body with a closed cabin on it, about 4.3 x 1.8 x 1.45 m.
void add_cars(std::vector<SourceObject>& objects, Random& random, const CarRow& row);

}  // namespace pvsfarm
