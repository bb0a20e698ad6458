// The generated cities keep the promises of coordinator/generate/generate.hpp.
#include <gtest/gtest.h>

#include <map>

#include "coordinator/generate/city_detail.hpp"
#include "coordinator/generate/generate.hpp"
#include "tests/unit/generated_boxes.hpp"

namespace pvsfarm {
namespace {

TEST(City, of_twenty_blocks_has_the_objects_of_its_description) {
  const GeneratedScene city = generate_city({.blocks = 20}).value();
  const std::vector<Box> buildings = boxes_of(city, "building"), cars = boxes_of(city, "car");
  EXPECT_EQ(buildings.size(), 6400u);
  EXPECT_EQ(cars.size(), 16000u);
  EXPECT_EQ(city.source.objects.size(), 6400u + 16000u + 400u);
  for (const Box& b : buildings) {
    ASSERT_EQ(b.lo.z, 0);
    ASSERT_GE(b.hi.z, 9);
    ASSERT_LE(b.hi.z, 35);
  }
  for (const Box& c : cars) {
    const double longer = std::max(c.size().x, c.size().y);
    const double shorter = std::min(c.size().x, c.size().y);
    ASSERT_EQ(c.lo.z, 0);
    ASSERT_NEAR(longer, 4.3, 0.45);
    ASSERT_NEAR(shorter, 1.8, 0.15);
    ASSERT_LT(c.hi.z, kEyeLow_m);
  }
  EXPECT_EQ(overlaps(buildings, buildings), buildings.size());
  EXPECT_EQ(overlaps(cars, cars), cars.size());
  EXPECT_EQ(overlaps(cars, buildings), 0u);
}

// Counted from the geometry alone: along each front of a block, where do neighbours stand apart?
TEST(City, has_gaps_at_fifteen_percent_of_the_joints_and_shared_coordinates_at_the_others) {
  const GeneratedScene city = generate_city({.blocks = 20}).value();
  const std::vector<Box> buildings = boxes_of(city, "building");
  std::size_t joints = 0, gaps = 0;
  for (std::size_t block = 0; block < buildings.size(); block += kBuildingsPerBlock) {
    Box whole;
    for (int i = 0; i < kBuildingsPerBlock; ++i) whole.add(buildings[block + i]);
    ASSERT_EQ(whole.size().x, 60);
    ASSERT_EQ(whole.size().y, 60);
    for (int front = 0; front < 4; ++front) {
      const int along = front / 2, across = 1 - along;
      std::map<double, double> stretches;  // of the front: begin to end
      for (int i = 0; i < kBuildingsPerBlock; ++i) {
        const Box& b = buildings[block + i];
        const bool on_front =
            front % 2 ? b.hi[across] == whole.hi[across] : b.lo[across] == whole.lo[across];
        if (on_front) stretches[b.lo[along]] = b.hi[along];
      }
      ASSERT_EQ(stretches.size(), 5u);
      for (auto at = stretches.begin(); std::next(at) != stretches.end(); ++at, ++joints) {
        const double apart = std::next(at)->first - at->second;
        if (apart == 0) continue;
        ASSERT_GE(apart, 0.5);
        ASSERT_LE(apart, 2.0);
        ++gaps;
      }
    }
  }
  EXPECT_EQ(joints, 6400u);
  EXPECT_NEAR(static_cast<double>(gaps) / static_cast<double>(joints), 0.15, 0.02);
}

TEST(City, has_cells_that_fill_streets_and_crossings_up_to_the_fronts) {
  const GeneratedScene city = generate_city({.blocks = 2, .cell_size = 5}).value();
  double area = 0;
  for (const Box& cell : cell_boxes(city)) {
    EXPECT_LE(cell.size().x, 5);
    EXPECT_LE(cell.size().y, 5);
    EXPECT_EQ(cell.lo.z, kEyeLow_m);
    EXPECT_EQ(cell.hi.z, kEyeHigh_m);
    area += cell.size().x * cell.size().y;
  }
  const double extent = 2 * 74 + 14 - 2 * kClearOfFronts_m, block = 60 + 2 * kClearOfFronts_m;
  EXPECT_DOUBLE_EQ(area, extent * extent - 4 * block * block);  // and they do not overlap: above
}

// Durand 2000, section 7.1: 12 districts, 1.8 million triangles of buildings, 3,000 cars of 1,400,
// 1,500 cells in the streets of one district.
TEST(City, of_the_size_of_durands_has_its_numbers) {
  const CityRequest durand{.blocks = 10,
                           .cell_size = 20.2,
                           .districts = 12,
                           .lanes = 2,
                           .cars = 3000,
                           .building_triangles = 96,
                           .car_triangles = 1400,
                           .moving_cars = true};
  const GeneratedScene city = generate_city(durand).value();
  std::size_t cars = 0, cars_triangles = 0, buildings = 0, buildings_triangles = 0;
  Box all;
  for (const SourceObject& object : city.source.objects) {
    const bool car = is_a(object, "car");
    all.add(box_of(object));
    EXPECT_EQ(object.dynamic, car) << object.name;
    if (car) ++cars, cars_triangles += object.triangles.size();
    if (is_a(object, "building")) ++buildings, buildings_triangles += object.triangles.size();
  }
  EXPECT_EQ(cars, 3000u);
  EXPECT_EQ(cars_triangles, 3000u * 1400u);
  EXPECT_EQ(buildings, 12u * 100u * 16u);
  EXPECT_EQ(buildings_triangles, 12u * 100u * 16u * 96u);
  EXPECT_NEAR(static_cast<double>(city.cells.size()), 1500, 100);
  EXPECT_EQ(all.size().x, 40 * 74 + 14);
  EXPECT_EQ(all.size().y, 30 * 74 + 14);
  // All cells in one district, in its streets and those around it.
  Box cells;
  for (const Box& cell : cell_boxes(city)) {
    cells.add(cell);
    EXPECT_GT(std::max(cell.size().x, cell.size().y), 1.9 * std::min(cell.size().x, cell.size().y));
  }
  EXPECT_EQ(cells.size().x, 10 * 74 + 14 - 2 * kClearOfFronts_m);
  EXPECT_EQ(cells.lo.x - kClearOfFronts_m, 10 * 74);
}

TEST(City, with_detail_has_the_outlines_of_the_plain_one) {
  const GeneratedScene plain = generate_city({.blocks = 2}).value();
  const GeneratedScene heavy =
      generate_city({.blocks = 2, .building_triangles = 120, .car_triangles = 600}).value();
  ASSERT_EQ(plain.source.objects.size(), heavy.source.objects.size());
  for (std::size_t i = 0; i < plain.source.objects.size(); ++i) {
    const SourceObject &thin = plain.source.objects[i], &rich = heavy.source.objects[i];
    ASSERT_EQ(thin.name, rich.name);
    const Box a = box_of(thin), b = box_of(rich);
    const double grown = is_a(thin, "building") ? kLedgeDepth_m : 1.0 / 1024;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(a.lo[axis], b.lo[axis], grown) << thin.name;
      EXPECT_NEAR(a.hi[axis], b.hi[axis], grown) << thin.name;
    }
    if (!is_a(thin, "building")) continue;
    EXPECT_TRUE(std::equal(thin.triangles.begin(), thin.triangles.end(), rich.triangles.begin()));
    EXPECT_TRUE(std::equal(thin.vertices.begin(), thin.vertices.end(), rich.vertices.begin()));
  }
}

TEST(City, names_the_option_that_asks_for_too_much_detail) {
  for (const auto& [request, option] :
       {std::pair{CityRequest{.blocks = 2, .cars = 161}, "--cars"},
        std::pair{CityRequest{.building_triangles = 90}, "--building-triangles"},
        std::pair{CityRequest{.car_triangles = 100}, "--car-triangles"},
        std::pair{CityRequest{.car_triangles = 1402}, "--car-triangles"},
        std::pair{CityRequest{.blocks = 100, .districts = 12}, "--districts"},
        std::pair{CityRequest{.lanes = -1}, "--lanes"}}) {
    const Result<GeneratedScene> city = generate_city(request);
    ASSERT_FALSE(city);
    EXPECT_NE(city.error().text.find(option), std::string::npos) << city.error().text;
  }
}

TEST(ClosedCity, has_fronts_without_gaps_around_every_street) {
  const CityRequest request{.blocks = 3};
  const GeneratedScene city = generate_closed_city(request).value();
  std::vector<Box> walls = boxes_of(city, "building");
  for (const char* gate : {"gate_low", "gate_high"})
    for (const Box& box : boxes_of(city, gate)) walls.push_back(box);
  for (const Box& street : closed_city_streets(request)) {
    // Along each side, what touches it from outside covers its whole length.
    for (int side = 0; side < 4; ++side) {
      const int across = side / 2, along = 1 - across;
      std::map<double, double> stretches;
      for (const Box& wall : walls) {
        const bool touches =
            side % 2 ? wall.lo[across] == street.hi[across] : wall.hi[across] == street.lo[across];
        if (touches) stretches[wall.lo[along]] = wall.hi[along];
        if (touches) {
          EXPECT_GE(wall.hi.z, 24);
        }
      }
      double covered = street.lo[along];
      for (const auto& [begin, end] : stretches)
        if (begin <= covered) covered = std::max(covered, end);
      EXPECT_GE(covered, street.hi[along]);
    }
  }
}

// No ray at random from a street meets anything first that does not stand at this street.
TEST(ClosedCity, shows_nothing_but_ones_own_street) {
  const CityRequest request{.blocks = 3, .seed = 9};
  const GeneratedScene city = generate_closed_city(request).value();
  std::vector<Box> solids;  // every object of it is a box, or a car, whose box hides less than it
  for (const SourceObject& object : city.source.objects)
    if (!is_a(object, "car") && !is_a(object, "ground")) solids.push_back(box_of(object));
  Random random(3);
  for (const Box& street : closed_city_streets(request)) {
    for (int ray = 0; ray < 4000; ++ray) {
      const Vec3 from{random.between(street.lo.x, street.hi.x),
                      random.between(street.lo.y, street.hi.y),
                      random.between(kEyeLow_m, kEyeHigh_m)};
      const Box& aim = solids[random.below(solids.size())];
      Vec3 to;
      for (int a = 0; a < 3; ++a) to[a] = random.between(aim.lo[a], aim.hi[a]);
      to.z = aim.hi.z;
      double nearest = 2;
      const Box* met = nullptr;
      for (const Box& box : solids) {
        double enter = 0, leave = nearest;
        for (int a = 0; a < 3; ++a) {
          const double d = to[a] - from[a];
          const double t0 = (box.lo[a] - from[a]) / d, t1 = (box.hi[a] - from[a]) / d;
          enter = std::max(enter, std::min(t0, t1));
          leave = std::min(leave, std::max(t0, t1));
        }
        if (enter <= leave && enter < nearest) nearest = enter, met = &box;
      }
      ASSERT_NE(met, nullptr);
      ASSERT_TRUE(met->meets(street)) << "seen from " << from.x << ' ' << from.y;
    }
  }
}

}  // namespace
}  // namespace pvsfarm
