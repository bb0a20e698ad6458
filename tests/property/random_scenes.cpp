#include "tests/property/random_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/property/random_shapes.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"

namespace pvsfarm {
namespace {

constexpr int kCellsPerWorld = 3;

class Builder {
 public:
  explicit Builder(std::uint64_t seed) : random(seed) {}

  void add(SourceObject object, Role role) {
    object.name = "object " + std::to_string(world.source.objects.size());
    set_role(object, role);
    world.source.objects.push_back(std::move(object));
  }
  bool chance(double p) { return random.unit() < p; }
  // A box around `center`, its half sides drawn from [lo, hi].
  Box box(const Vec3& center, double lo, double hi) {
    const Vec3 half{random.between(lo, hi), random.between(lo, hi), random.between(lo, hi)};
    return {center - half, center + half};
  }
  // Small things to be hidden or seen, along +x between two distances.
  void occludees_ahead(int count, double near, double far) {
    for (int k = 0; k < count; ++k) {
      const double x = random.between(near, far);
      const Vec3 center{x, random.between(-0.7, 0.7) * x, random.between(-0.7, 0.7) * x};
      if (chance(0.3)) {
        SourceObject mesh = random_star(random, random.between(0.1, 1), 0.5);
        transform(mesh, random_frame(random), center);
        add(std::move(mesh), Role::kOnlyOccluded);
      } else {
        add(box_object("", box(center, 0.02, 1)), Role::kOnlyOccluded);
      }
    }
  }
  // Cells around `center`; half sides up to `reach`.
  void cells_around(const Vec3& center, double reach, bool level) {
    for (int k = 0; k < kCellsPerWorld; ++k) {
      Vec3 half;
      for (int a = 0; a < 3; ++a) {
        half[a] = reach * random.between(0.05, 1);
        if (chance(0.1)) half[a] = 0;
      }
      if (chance(0.05)) half = Vec3{0};
      if (level) half.z = std::min(half.z, 0.4);
      Vec3 at = center;
      for (int a = 0; a < (level ? 2 : 3); ++a) at[a] += random.between(-1, 1) * 0.3;
      if (chance(0.4)) {
        world.cells.push_back(Cell::aligned({at - half, at + half}));
        continue;
      }
      const Frame f = level ? frame_about_z(random.between(0, 7)) : random_frame(random);
      world.cells.push_back(Cell{.origin = at, .axes = f, .lo = -half, .hi = half});
    }
  }

  Random random;
  RandomWorld world;
};

void blocks(Builder& b) {
  const double base_gap = b.chance(0.3) ? std::pow(10.0, -b.random.between(1, 6)) : 0;
  for (int i = -3; i <= 3; ++i)
    for (int j = -3; j <= 3; ++j) {
      if (i == 0 && j == 0) continue;
      const Vec3 at{8.0 * i, 8.0 * j, 0};
      // Neighbours along a row touch, or leave a lane.
      const double wide = b.chance(0.6) ? 4 : b.random.between(2, 3.999);
      const double deep = b.random.between(1.5, 3), high = b.random.between(1, 12);
      const double base = b.chance(0.2) ? base_gap : 0;
      b.add(box_object("", {at + Vec3{-wide, -deep, base}, at + Vec3{wide, deep, base + high}}),
            Role::kBoth);
      const Vec3 street = at + Vec3{b.random.between(-3, 3), 3.5, 0};
      b.add(box_object("", {street, street + Vec3{0.5, 0.3, b.random.between(0.2, 1)}}),
            Role::kOnlyOccluded);
    }
  if (b.chance(0.5)) {
    b.add(box_object("", {{-40, -40, 0}, {40, 40, 0}}), Role::kBoth);
  }
  b.cells_around({0, b.random.between(-1, 1) * 0.2, 1.4}, 1.2, true);
}

void plates(Builder& b) {
  const int count = 1 + static_cast<int>(b.random.below(12));
  for (int k = 0; k < count; ++k) {
    const double x = b.random.between(2.5, 12);
    SourceObject plate =
        random_polygon(b.random, b.random.between(0.5, 1.6) * x, b.random.between(0.5, 1.6) * x);
    plate.two_sided = !b.chance(0.3);
    Frame tilt = random_frame(b.random);
    if (b.chance(0.6)) tilt = frame_about_z(b.random.between(-0.4, 0.4) + (b.chance(0.5) ? 3 : 0));
    transform(plate, tilt, {x, b.random.between(-2, 2), b.random.between(-2, 2)});
    b.add(std::move(plate), b.chance(0.5) ? Role::kBoth : Role::kOnlyOccludes);
  }
  b.occludees_ahead(30, 6, 40);
  b.cells_around(Vec3{0}, 1.5, false);
}

void slits(Builder& b) {
  for (double x : {3.0, 5.0, 8.0}) {
    if (b.chance(0.6)) continue;
    const bool upright = b.chance(0.5);
    double at = -24;
    while (at < 24) {
      const double gap = b.chance(0.4) ? 0 : std::pow(10.0, b.random.between(-7, 0.5));
      const double next = at + b.random.between(2, 16);
      Box plate{{x, at, -24}, {x, next - gap, 24}};
      if (b.chance(0.3)) plate.hi.x += b.random.between(0.01, 1);
      if (!upright) std::swap(plate.lo.y, plate.lo.z), std::swap(plate.hi.y, plate.hi.z);
      b.add(box_object("", plate), Role::kOnlyOccludes);
      at = next;
    }
  }
  b.occludees_ahead(25, 9, 30);
  b.cells_around(Vec3{0}, 1.5, false);
}

void straddle(Builder& b) {
  const int count = 2 + static_cast<int>(b.random.below(8));
  for (int k = 0; k < count; ++k) {
    Box slab =
        b.box({b.random.between(4, 14), b.random.between(-6, 6), b.random.between(-3, 3)}, 0.01, 3);
    slab.lo.x = std::max(slab.lo.x - 5, 1.7);  // long in the line of sight
    slab.hi.x += 6 * b.random.unit();
    if (b.chance(0.5)) slab.lo.z = -9, slab.hi.z = 9;
    SourceObject solid = box_object("", slab);
    if (b.chance(0.3)) transform(solid, frame_about_z(b.random.between(-0.2, 0.2)), Vec3{0});
    solid.two_sided = b.chance(0.7);
    b.add(std::move(solid), b.chance(0.5) ? Role::kBoth : Role::kOnlyOccludes);
  }
  const double hole = b.random.between(0.05, 2), x = b.random.between(5, 12);
  for (double sign : {-1.0, 1.0}) {
    Box plate{{x, 0, -20}, {x, 0, 20}};
    plate.lo.y = sign > 0 ? hole : -30;
    plate.hi.y = sign > 0 ? 30 : -hole;
    b.add(box_object("", plate), Role::kOnlyOccludes);
  }
  b.occludees_ahead(30, 6, 40);
  b.cells_around(Vec3{0}, 1.5, false);
  for (Cell& cell : b.world.cells)
    if (b.chance(0.5)) cell.lo.y *= 5, cell.hi.y *= 5;
}

void meshes(Builder& b) {
  const int count = 3 + static_cast<int>(b.random.below(8));
  for (int k = 0; k < count; ++k) {
    const double x = b.random.between(4, 12), size = x * b.random.between(0.2, 0.6);
    SourceObject mesh;
    switch (b.random.below(4)) {
      case 0:
        mesh = random_star(b.random, size, b.random.between(0, 0.6));
        break;
      case 1:
        mesh = l_prism(size);
        break;
      case 2:  // two parts with a gap between them
        mesh = box_object("", {{-1, -size, -size}, {0, -0.2 * size * b.random.unit(), size}});
        append(mesh, box_object("", {{0.5, 0.2 * size * b.random.unit(), -size}, {1, size, size}}));
        break;
      default:
        mesh = tessellated_wall(6, 6, size / 3, [&](int, int) { return b.chance(0.05); });
        for (Vec3& v : mesh.vertices) v -= Vec3{0, size, size};
    }
    transform(mesh, b.chance(0.5) ? random_frame(b.random) : frame_about_z(b.random.unit()),
              {x, b.random.between(-0.5, 0.5) * x, b.random.between(-0.5, 0.5) * x});
    if (b.chance(0.4)) crack(mesh, size * std::pow(10.0, -b.random.between(1, 9)), b.random);
    if (b.chance(0.25)) damage(mesh, b.random);
    mesh.two_sided = b.chance(0.6);
    b.add(std::move(mesh), b.chance(0.6) ? Role::kBoth : Role::kOnlyOccludes);
    b.world.source.objects.back().dynamic = b.chance(0.05);
  }
  b.occludees_ahead(25, 10, 40);
  b.cells_around(Vec3{0}, 1.2, false);
}

void rooms(Builder& b) {
  const double side = 8, high = 4;
  for (int k = 0; k < 4; ++k) {
    const int door = static_cast<int>(b.random.below(16)),
              window = static_cast<int>(b.random.below(16));
    const bool has_door = b.chance(0.5), has_window = b.chance(0.4);
    SourceObject wall = tessellated_wall(16, 8, 0.5, [&](int c, int r) {
      return (has_door && (c == door || c == door + 1) && r < 4) ||
             (has_window && c == window && r >= 3 && r < 6);
    });
    for (Vec3& v : wall.vertices) v += Vec3{side / 2, -side / 2, 0};
    transform(wall, frame_about_z(k * std::numbers::pi / 2), Vec3{0});
    if (b.chance(0.2)) crack(wall, std::pow(10.0, -b.random.between(2, 9)), b.random);
    b.add(std::move(wall), Role::kBoth);
  }
  const double half = side / 2;
  b.add(box_object("", {{-half, -half, 0}, {half, half, 0}}), Role::kBoth);
  if (b.chance(0.8)) b.add(box_object("", {{-half, -half, high}, {half, half, high}}), Role::kBoth);
  for (int k = 0; k < 40; ++k) {
    const Vec3 at{b.random.between(-20, 20), b.random.between(-20, 20), b.random.between(0, 4)};
    Box box = b.box(at, 0.05, 0.8);
    box.lo.z = std::max(box.lo.z, 0.0);
    b.add(box_object("", box), b.chance(0.3) ? Role::kBoth : Role::kOnlyOccluded);
  }
  b.cells_around({0, 0, 1.5}, 1.5, true);
}

void touching(Builder& b) {
  const Vec3 at = b.chance(0.5) ? Vec3{0} : Vec3{b.random.unit(), b.random.unit(), b.random.unit()};
  b.cells_around(at, 1.5, false);
  const Box cell = b.world.cells[0].bounds();
  for (int k = 0; k < 6; ++k) {
    // A box or star at a face of the cell: apart by a hair, in touch, or overlapping.
    const int axis = static_cast<int>(b.random.below(3));
    const double shift[] = {0, 0, 1e-9, 1e-3, -1e-9, -0.3};
    Box box = b.box(at, 0.5, 6);
    const double thick = b.random.between(0.1, 4);
    box.lo[axis] = cell.hi[axis] + shift[b.random.below(6)];
    box.hi[axis] = box.lo[axis] + thick;
    SourceObject solid = box_object("", box);
    if (b.chance(0.2)) {
      solid = random_star(b.random, b.random.between(0.5, 8), 0.3);
      transform(solid, random_frame(b.random), box.center());
    }
    solid.two_sided = b.chance(0.6);
    b.add(std::move(solid), Role::kBoth);
  }
  b.add(box_object("", {{8, -12, -12}, {9, 12, 12}}), Role::kBoth);
  b.occludees_ahead(25, 3, 30);
}

void solids(Builder& b) {
  const int count = 2 + static_cast<int>(b.random.below(5));
  for (int k = 0; k < count; ++k) {
    const double x = b.random.between(4, 12), size = x * b.random.between(0.2, 0.7);
    SourceObject mesh = random_solid(b.random, size);
    if (b.chance(0.3)) append(mesh, random_solid(b.random, size * b.random.between(0.2, 1)));
    if (b.chance(0.15)) turn_inside_out(mesh);
    transform(mesh, b.chance(0.5) ? random_frame(b.random) : frame_about_z(b.random.unit()),
              {x, b.random.between(-0.5, 0.5) * x, b.random.between(-0.5, 0.5) * x});
    if (b.chance(0.1)) crack(mesh, size * std::pow(10.0, -b.random.between(1, 9)), b.random);
    if (b.chance(0.1)) damage(mesh, b.random);
    mesh.two_sided = b.chance(0.6);
    b.add(std::move(mesh), b.chance(0.6) ? Role::kBoth : Role::kOnlyOccludes);
  }
  if (b.chance(0.3)) {  // around the cell
    Box room = b.box(Vec3{0}, 2, 5);
    room.hi.x += 12 * b.random.unit();
    SourceObject walls = fine_box(room, 5, sides_but_perhaps_one(b.random, 0.4));
    walls.two_sided = b.chance(0.5);
    if (b.chance(0.7)) turn_inside_out(walls);
    b.add(std::move(walls), Role::kOnlyOccludes);
  }
  b.occludees_ahead(25, 5, 40);
  b.cells_around(Vec3{0}, 1.5, false);
}

void earth(Builder& b) {
  constexpr double kReach = 18;
  if (b.chance(0.8)) {
    SourceObject hills = random_hills(b.random, kReach);
    if (b.chance(0.1)) damage(hills, b.random);
    hills.two_sided = b.chance(0.6);
    b.add(std::move(hills), b.chance(0.7) ? Role::kBoth : Role::kOnlyOccludes);
  }
  for (int k = 0; k < 8; ++k) {
    Box house = b.box({b.random.between(-12, 12), b.random.between(-12, 12), 0}, 0.5, 4);
    house.lo.z = b.chance(0.7) ? 0 : b.random.between(-0.5, 0.5);
    b.add(fine_box(house, 3, kAllSides & ~(b.chance(0.9) ? kLowZ : kHighX)), Role::kBoth);
  }
  for (int k = 0; k < 30; ++k) {
    const double edge = b.chance(0.1) ? kReach + 0.1 : kReach - 1;
    Box box = b.box(
        {b.random.between(-edge, edge), b.random.between(-edge, edge), b.random.between(0, 6)},
        0.05, 0.9);
    box.lo.z = std::max(box.lo.z, 0.0);
    b.add(box_object("", box), Role::kOnlyOccluded);
  }
  b.cells_around({b.random.between(-9, 9), b.random.between(-9, 9), b.random.between(0, 6)}, 1.2,
                 true);
}

void fill(Builder& b, Family family) {
  switch (family) {
    case Family::kBlocks:
      return blocks(b);
    case Family::kPlates:
      return plates(b);
    case Family::kSlits:
      return slits(b);
    case Family::kStraddle:
      return straddle(b);
    case Family::kMeshes:
      return meshes(b);
    case Family::kRooms:
      return rooms(b);
    case Family::kTouching:
      return touching(b);
    case Family::kSolids:
      return solids(b);
    case Family::kEarth:
      return earth(b);
  }
}

// Turns (about z only, where there is a ground), scales and moves everything.
void displace(Builder& b, bool level) {
  Frame frame = frame_about_z(0);
  if (b.chance(0.5)) frame = level ? frame_about_z(b.random.between(0, 7)) : random_frame(b.random);
  const double scales[] = {1, 1, 1, 1e3, 1e-2}, offsets[] = {0, 0, 1e4, 1e7};
  const double scale = scales[b.random.below(5)];
  const double reach = scale * offsets[b.random.below(4)];
  const Vec3 offset{reach * b.random.between(-1, 1), reach * b.random.between(-1, 1),
                    level ? 0 : reach * b.random.between(-1, 1)};
  const bool turned = frame[0] != Vec3{1, 0, 0};
  for (SourceObject& object : b.world.source.objects) {
    transform(object, frame, Vec3{0});
    for (Vec3& v : object.vertices) v = v * scale + offset;
  }
  for (Cell& cell : b.world.cells) {
    const bool aligned = cell.origin == Vec3{0} && cell.axes == Cell{}.axes && !turned;
    if (aligned) {
      cell.lo = cell.lo * scale + offset;
      cell.hi = cell.hi * scale + offset;
      continue;
    }
    cell.origin = apply(frame, cell.origin) * scale + offset;
    for (Vec3& axis : cell.axes) axis = apply(frame, axis);
    cell.lo *= scale;
    cell.hi *= scale;
  }
}

}  // namespace

const char* to_string(Family family) {
  switch (family) {
    case Family::kBlocks:
      return "blocks";
    case Family::kPlates:
      return "plates";
    case Family::kSlits:
      return "slits";
    case Family::kStraddle:
      return "straddle";
    case Family::kMeshes:
      return "meshes";
    case Family::kRooms:
      return "rooms";
    case Family::kTouching:
      return "touching";
    case Family::kSolids:
      return "solids";
    case Family::kEarth:
      return "earth";
  }
  return "";
}

RandomWorld random_world(Family family, std::uint64_t seed) {
  Builder b(seed * 8 + static_cast<std::uint64_t>(family));
  fill(b, family);
  const bool level =
      family == Family::kBlocks || family == Family::kRooms || family == Family::kEarth;
  displace(b, level);
  return std::move(b.world);
}

}  // namespace pvsfarm
