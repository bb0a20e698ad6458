#include "tests/property/random_shapes.hpp"

#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"

namespace pvsfarm {

Frame frame_about_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}};
}

Frame random_frame(Random& random) {
  for (;;) {
    const Vec3 a{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const Vec3 b{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const Vec3 n = cross(a, b);
    if (length(n) < 0.2) continue;
    const Vec3 x = a / length(a), z = n / length(n);
    return {x, cross(z, x), z};
  }
}

void transform(SourceObject& object, const Frame& frame, const Vec3& offset) {
  for (Vec3& v : object.vertices) v = apply(frame, v) + offset;
}

SourceObject random_polygon(Random& random, double half_y, double half_z) {
  const int sides = 3 + static_cast<int>(random.below(6));
  std::vector<Vec3> points;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * (k + random.between(-0.3, 0.3)) / sides;
    points.push_back({0, half_y * std::cos(angle), half_z * std::sin(angle)});
  }
  return polygon_object("polygon", points);
}

SourceObject random_star(Random& random, double radius, double noise) {
  constexpr std::uint32_t kRings = 5, kSectors = 8;
  SourceObject star;
  const auto r = [&] { return radius * (1 + noise * random.between(-1, 1)); };
  star.vertices.push_back({0, 0, -r()});
  for (std::uint32_t i = 1; i <= kRings; ++i)
    for (std::uint32_t k = 0; k < kSectors; ++k) {
      const double polar = std::numbers::pi * i / (kRings + 1);
      const double around = 2 * std::numbers::pi * k / kSectors;
      star.vertices.push_back(Vec3{std::sin(polar) * std::cos(around),
                                   std::sin(polar) * std::sin(around), -std::cos(polar)} *
                              r());
    }
  star.vertices.push_back({0, 0, r()});
  const auto at = [](std::uint32_t ring, std::uint32_t k) {
    return 1 + ring * kSectors + k % kSectors;
  };
  const std::uint32_t top = 1 + kRings * kSectors;
  for (std::uint32_t k = 0; k < kSectors; ++k) {
    star.triangles.push_back({0, at(0, k + 1), at(0, k)});
    for (std::uint32_t i = 0; i + 1 < kRings; ++i) {
      star.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
      star.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
    }
    star.triangles.push_back({at(kRings - 1, k), at(kRings - 1, k + 1), top});
  }
  return star;
}

SourceObject l_prism(double s) {
  constexpr std::array<std::array<double, 2>, 6> kOutline{
      {{-1, -1}, {1, -1}, {1, -0.2}, {-0.2, -0.2}, {-0.2, 1}, {-1, 1}}};
  constexpr std::array<std::array<std::uint32_t, 3>, 4> kCap{
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}};
  SourceObject prism;
  for (double z : {-s, s})
    for (const auto& p : kOutline) prism.vertices.push_back({s * p[0], s * p[1], z});
  for (const auto& t : kCap) {
    prism.triangles.push_back({t[0], t[2], t[1]});
    prism.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
  }
  for (std::uint32_t k = 0; k < 6; ++k) {
    const std::uint32_t n = (k + 1) % 6;
    prism.triangles.push_back({k, n, n + 6});
    prism.triangles.push_back({k, n + 6, k + 6});
  }
  return prism;
}

void crack(SourceObject& object, double gap, Random& random) {
  SourceObject apart = object;
  apart.vertices.clear();
  apart.triangles.clear();
  for (const auto& t : object.triangles) {
    const auto base = static_cast<std::uint32_t>(apart.vertices.size());
    for (std::uint32_t i : t) {
      const Vec3 by{random.between(-gap, gap), random.between(-gap, gap),
                    random.between(-gap, gap)};
      apart.vertices.push_back(object.vertices[i] + by);
    }
    apart.triangles.push_back({base, base + 1, base + 2});
  }
  object = std::move(apart);
}

void damage(SourceObject& object, Random& random) {
  std::vector<std::array<std::uint32_t, 3>> kept;
  for (auto t : object.triangles) {
    switch (random.below(24)) {
      case 0:
        continue;
      case 1:
        kept.push_back(t);
        break;
      case 2:
        std::swap(t[0], t[1]);
        break;
      case 3:
        kept.push_back({t[0], t[1], t[1]});
        break;
      default:
        break;
    }
    kept.push_back(t);
  }
  if (!kept.empty()) object.triangles = std::move(kept);
}

int sides_but_perhaps_one(Random& random, double p) {
  return random.unit() < p ? kAllSides & ~(1 << random.below(6)) : kAllSides;
}

SourceObject random_solid(Random& random, double s) {
  switch (random.below(5)) {
    case 0:
      return random_star(random, s, random.between(0, 0.6));
    case 1:
      return l_prism(s);
    case 2:
      return torus(0, s * 0.7, s * random.between(0.05, 0.3), 12);
    case 3: {
      std::vector<Vec2> line;
      for (int k = 0; k < 24; ++k)
        line.push_back(s * Vec2(random.between(-1, 1), random.between(-1, 1)));
      return extruded(line, -s * random.unit(), s * random.unit());
    }
    default: {
      const Vec3 half{random.between(0.2 * s, s), random.between(0.2 * s, s),
                      random.between(0.2 * s, s)};
      return fine_box({-half, half}, 4, sides_but_perhaps_one(random, 0.25));
    }
  }
}

SourceObject random_hills(Random& random, double reach) {
  constexpr int kN = 24;
  std::array<double, (kN + 1) * (kN + 1)> heights;
  for (double& height : heights) height = random.between(0, 0.8);
  for (int hill = 0; hill < 6; ++hill) {
    const double x = random.between(0, kN), y = random.between(0, kN);
    const double high = random.between(0, 9), wide = random.between(2, 12);
    for (int k = 0; k < std::ssize(heights); ++k) {
      const double dx = k / (kN + 1) - x, dy = k % (kN + 1) - y;
      heights[k] += high / (1 + (dx * dx + dy * dy) / wide);
    }
  }
  SourceObject hills;
  add_sheet(hills, kN, [&](int i, int j) {
    const double step = 2 * reach / kN;
    return Vec3{i * step - reach, j * step - reach, heights[i * (kN + 1) + j]};
  });
  return hills;
}

}  // namespace pvsfarm
