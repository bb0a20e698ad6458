#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr int kMaxTiles = 200, kMaxHousesPerTile = 4;
constexpr int kQuads = 16;  // of a tile, along a side
constexpr double kQuad_m = 4, kTile_m = kQuads * kQuad_m;
constexpr int kPathQuad = 8;  // the row and the column of quads a tile's paths run along

struct Octave {
  double wave_m, height_m;
};
constexpr std::array<Octave, 4> kOctaves{{{320, 30}, {160, 9}, {64, 2.5}, {24, 0.5}}};

// Heights at the vertices of the quads, from smoothed value noise.
class Heightfield {
 public:
  Heightfield(std::uint64_t seed, int tiles) : seed_(seed), side_(tiles * kQuads + 1) {
    heights_.reserve(static_cast<std::size_t>(side_) * side_);
    for (int y = 0; y < side_; ++y)
      for (int x = 0; x < side_; ++x) heights_.push_back(snap(noise(x * kQuad_m, y * kQuad_m)));
  }
  double at(int x, int y) const { return heights_[static_cast<std::size_t>(y) * side_ + x]; }
  // Lowest and highest ground of the quads that meet `region`, which lies inside the field.
  std::array<double, 2> range(const Box& region) const {
    const auto first = [&](double v) { return static_cast<int>(std::floor(v / kQuad_m)); };
    const auto last = [&](double v) { return static_cast<int>(std::ceil(v / kQuad_m)); };
    std::array<double, 2> range{at(first(region.lo.x), first(region.lo.y)),
                                at(first(region.lo.x), first(region.lo.y))};
    for (int y = first(region.lo.y); y <= last(region.hi.y); ++y)
      for (int x = first(region.lo.x); x <= last(region.hi.x); ++x) {
        range[0] = std::min(range[0], at(x, y));
        range[1] = std::max(range[1], at(x, y));
      }
    return range;
  }

 private:
  double knot(int octave, int x, int y) const {
    const auto index = (static_cast<std::uint64_t>(octave) << 48) +
                       (static_cast<std::uint64_t>(y) << 24) + static_cast<std::uint64_t>(x);
    return stream_of(seed_, index).unit();
  }
  double noise(double x_m, double y_m) const {
    double sum = 0;
    for (int o = 0; o < static_cast<int>(kOctaves.size()); ++o) {
      const double x = x_m / kOctaves[o].wave_m, y = y_m / kOctaves[o].wave_m;
      const int ix = static_cast<int>(x), iy = static_cast<int>(y);
      const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
      const double tx = smooth(x - ix), ty = smooth(y - iy);
      const double low = knot(o, ix, iy) * (1 - tx) + knot(o, ix + 1, iy) * tx;
      const double high = knot(o, ix, iy + 1) * (1 - tx) + knot(o, ix + 1, iy + 1) * tx;
      sum += kOctaves[o].height_m * (low * (1 - ty) + high * ty);
    }
    return sum;
  }

  std::uint64_t seed_;
  int side_;
  std::vector<double> heights_;
};

SourceObject make_tile(const Heightfield& field, int tx, int ty) {
  SourceObject tile{.name = numbered("terrain", {tx, ty})};
  constexpr std::uint32_t kSide = kQuads + 1;
  for (int y = 0; y <= kQuads; ++y)
    for (int x = 0; x <= kQuads; ++x) {
      const int gx = tx * kQuads + x, gy = ty * kQuads + y;
      tile.vertices.push_back({gx * kQuad_m, gy * kQuad_m, field.at(gx, gy)});
    }
  for (std::uint32_t y = 0; y < kQuads; ++y)
    for (std::uint32_t x = 0; x < kQuads; ++x) {
      const std::uint32_t at = y * kSide + x;
      tile.triangles.push_back({at, at + 1, at + kSide + 1});
      tile.triangles.push_back({at, at + kSide + 1, at + kSide});
    }
  return tile;
}

// A house in one quarter of the tile, off the paths: five-cornered gable, base below the ground.
SourceObject make_house(Random& random, const Heightfield& field, const Vec2& tile, int quarter,
                        std::string name) {
  constexpr double kLowSide_m = kPathQuad * kQuad_m, kHighSide_m = (kPathQuad + 1) * kQuad_m;
  const double length = random.between(9, 13), width = random.between(6, 9);
  const bool along_y = random.below(2) == 1;
  Box plan;
  for (int a = 0; a < 2; ++a) {
    const bool high = (quarter >> a & 1) == 1;
    const double lo = high ? kHighSide_m : 0, hi = high ? kTile_m : kLowSide_m;
    const double extent = (a == 1) == along_y ? length : width;
    plan.lo[a] = tile[a] + snap(random.between(lo + 2, hi - 2 - extent));
    plan.hi[a] = snap(plan.lo[a] + extent);
  }
  const auto [low, high] = field.range(plan);
  const double base = snap(low - 0.5), eaves = snap(high + random.between(2.6, 5.5));
  const double ridge = snap(eaves + random.between(1.5, 3.5));
  // Across the ridge; mirrored for a ridge along y (Extrusion).
  const int across = along_y ? 0 : 1;
  const double left = along_y ? -plan.hi.x : plan.lo.y, right = along_y ? -plan.lo.x : plan.hi.y;
  const double middle = snap((left + right) / 2);
  const std::array<Vec2, 5> profile{
      {{left, base}, {right, base}, {right, eaves}, {middle, ridge}, {left, eaves}}};
  SourceObject house{.name = std::move(name)};
  add_prism(house, {.profile = profile,
                    .lo = plan.lo[1 - across],
                    .hi = plan.hi[1 - across],
                    .along_y = along_y});
  return house;
}

// One cell over a stretch of a path, halved along the path while the ground under it is too steep:
// below 1.5 m over the lowest ground and above the highest no box can hold every eye.
void add_path_cell(GeneratedScene& scene, const Heightfield& field, const Box& stretch, int along) {
  const auto [low, high] = field.range(stretch);
  if (high < low + kEyeLow_m - 0.125) {
    const Box box{{stretch.lo.x, stretch.lo.y, low + kEyeLow_m},
                  {stretch.hi.x, stretch.hi.y, high + kEyeHigh_m}};
    scene.cells.push_back({static_cast<std::int64_t>(scene.cells.size()), Cell::aligned(box)});
    return;
  }
  if (stretch.size()[along] <= kQuad_m) return;
  Box first = stretch, second = stretch;
  first.hi[along] = second.lo[along] = snap(stretch.center()[along]);
  add_path_cell(scene, field, first, along);
  add_path_cell(scene, field, second, along);
}

// A tile's path along `axis`; the one along y leaves out the crossing.
void add_path(GeneratedScene& scene, const Heightfield& field, const TerrainRequest& request,
              const Vec2& tile, int axis) {
  const double cross_lo = tile[axis] + kPathQuad * kQuad_m;
  const double side_lo = tile[1 - axis] + kPathQuad * kQuad_m;
  std::vector<std::array<double, 2>> pieces{{tile[axis], tile[axis] + kTile_m}};
  if (axis == 1) pieces = {{tile[1], cross_lo}, {cross_lo + kQuad_m, tile[1] + kTile_m}};
  for (const auto& [begin, end] : pieces) {
    const std::vector<double> steps = even_steps(begin, end, request.cell_size);
    for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
      Box stretch{{0, 0, 0}, {0, 0, 0}};
      stretch.lo[axis] = steps[i];
      stretch.hi[axis] = steps[i + 1];
      stretch.lo[1 - axis] = side_lo;
      stretch.hi[1 - axis] = side_lo + kQuad_m;
      add_path_cell(scene, field, stretch, axis);
    }
  }
}

}  // namespace

Result<GeneratedScene> generate_terrain(const TerrainRequest& request) {
  if (Status s = check_range("--tiles", request.tiles, 1, kMaxTiles); !s) return s.error();
  if (Status s = check_range("--houses", request.houses_per_tile, 0, kMaxHousesPerTile); !s)
    return s.error();
  const double path_area = 2 * kQuad_m * kTile_m * request.tiles * request.tiles;
  if (Status s = check_cell_size(request.cell_size, path_area); !s) return s.error();

  const Heightfield field(request.seed, request.tiles);
  GeneratedScene scene;
  for (int ty = 0; ty < request.tiles; ++ty)
    for (int tx = 0; tx < request.tiles; ++tx) {
      Random random = stream_of(~request.seed, static_cast<std::uint64_t>(ty) * kMaxTiles + tx);
      const Vec2 corner{tx * kTile_m, ty * kTile_m};
      scene.source.objects.push_back(make_tile(field, tx, ty));
      for (int h = 0; h < request.houses_per_tile; ++h)
        scene.source.objects.push_back(
            make_house(random, field, corner, h, numbered("house", {tx, ty, h})));
      for (int axis = 0; axis < 2; ++axis) add_path(scene, field, request, corner, axis);
    }
  return scene;
}

}  // namespace pvsfarm
