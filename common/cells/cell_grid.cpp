// Grid cells over the places where a person can stand, found with Recast (its only include).
//
// Recast voxelises the triangles, marks the tops of walkable spans, and takes away what has no
// headroom or lies within a person's radius of an obstacle. Then, here: connected floors much
// smaller than the largest are left out (roofs, ledges, the insides of closed buildings), and every
// grid square gets one cell a storey, cut back to the rectangle of its walkable voxels, so that it
// stays clear of walls along its sides.
#include <recastnavigation/Recast.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "common/cells/cell_source.hpp"

namespace pvsfarm {
namespace {

constexpr double kPersonHeight_m = 1.8, kPersonRadius_m = 0.3, kStep_m = 0.4;
constexpr double kWalkableNormal = 0.70710678;  // of z: slopes up to 45 degrees
// Columns of voxels; bounds memory at about 0.5 GB, and with it the squares of a grid.
constexpr double kMaxColumns = 6e6;
constexpr int kMaxSpans = 1 << 24;            // of a compact heightfield: an index of 24 bits
constexpr double kSmallestFloorShare = 0.05;  // of the largest connected floor

// Voxels and squares over the scene. Recast's frame is (x, z, -y) less the origin: y up.
struct Field {
  Vec3 origin;         // low corner of square (0, 0), seen from above
  double size = 0;     // of a square
  int per_square = 1;  // voxels along a square
  int squares_x = 0, squares_y = 0;
  double voxel_height = 0.1;

  double voxel() const { return size / per_square; }
  // The rise a person takes; a slope of 45 degrees climbs a voxel a voxel and must stay one floor.
  double step_m() const { return std::max(kStep_m, voxel()); }
  int width() const { return squares_x * per_square; }
  int depth() const { return squares_y * per_square; }
  // Voxel borders; the borders of squares are the same doubles whatever the voxels.
  double border(int axis, int voxel_index) const {
    const int square = voxel_index / per_square, rest = voxel_index % per_square;
    return origin[axis] + square * size + rest * voxel();
  }
};

Result<Field> lay_out(const Scene& scene, const GridRequest& request) {
  const Box& bounds = scene.bounds();
  Field field{.origin = bounds.lo, .size = request.size};
  const double across = std::ceil(bounds.size().x / request.size + 1e-9);
  const double up = std::ceil(bounds.size().y / request.size + 1e-9);
  if (!(across * up <= kMaxColumns)) {
    const auto whole = [](double v) { return std::to_string(static_cast<long long>(v)); };
    return invalid_input("cells grid: squares of " + std::to_string(request.size) +
                         " over a scene of " + whole(bounds.size().x) + " x " +
                         whole(bounds.size().y) + " are more than " + whole(kMaxColumns) +
                         "; use a larger SIZE, or a cells file");
  }
  field.squares_x = std::max(1, static_cast<int>(across));
  field.squares_y = std::max(1, static_cast<int>(up));
  const double wanted_m = std::clamp(request.size / 10, 0.15, 0.5);
  const double affordable = std::sqrt(kMaxColumns / (across * up));
  field.per_square =
      std::max(1, static_cast<int>(std::min(std::ceil(request.size / wanted_m), affordable)));
  // A span's height is a number of 13 bits; a little room above for the topmost floor.
  field.voxel_height = std::max(0.1, bounds.size().z / (RC_SPAN_MAX_HEIGHT - 64));
  return field;
}

void add_triangles(rcContext& context, const Scene& scene, const Field& field, int climb_voxels,
                   rcHeightfield& solid) {
  const auto corner = [&](std::uint32_t vertex, float* out) {
    const Vec3 p = scene.vertices()[vertex] - field.origin;
    out[0] = static_cast<float>(p.x);
    out[1] = static_cast<float>(p.z);
    out[2] = static_cast<float>(-p.y);
  };
  for (std::uint32_t i = 0; i < scene.object_count(); ++i) {
    const ObjectRecord& object = scene.object(ObjectId{i});
    if (object.dynamic) continue;
    for (const Triangle& triangle : scene.triangles(ObjectId{i})) {
      const Vec3 a = scene.vertices()[triangle.vertex[0]];
      const Vec3 normal =
          cross(scene.vertices()[triangle.vertex[1]] - a, scene.vertices()[triangle.vertex[2]] - a);
      // A floor modelled upside down is a floor all the same if it is drawn from both sides.
      const double rise = object.two_sided ? std::abs(normal.z) : normal.z;
      const bool walkable = rise >= kWalkableNormal * length(normal);
      float v[3][3];
      for (int k = 0; k < 3; ++k) corner(triangle.vertex[k], v[k]);
      rcRasterizeTriangle(&context, v[0], v[1], v[2], walkable ? RC_WALKABLE_AREA : RC_NULL_AREA,
                          solid, climb_voxels);
    }
  }
}

// Recast knows surfaces only; a box building standing on a ground that runs on beneath it would be
// a hall. Fill the boxes the scene knows to be matter.
void fill_boxes(rcContext& context, const Scene& scene, const Field& field, int climb_voxels,
                rcHeightfield& solid) {
  for (const Occluder& occluder : scene.occluders()) {
    if (!occluder.is_box) continue;
    const Vec3 lo = occluder.box.lo - field.origin, hi = occluder.box.hi - field.origin;
    const auto first = [&](double v) {
      return std::max(0, static_cast<int>(std::ceil(v / field.voxel())));
    };
    const auto last = [&](double v, int end) {
      return std::min(end, static_cast<int>(std::floor(v / field.voxel())));
    };
    const int top = static_cast<int>(std::ceil(hi.z / field.voxel_height));
    const int bottom = static_cast<int>(std::floor(lo.z / field.voxel_height));
    const auto z_lo = static_cast<unsigned short>(std::clamp(bottom, 0, RC_SPAN_MAX_HEIGHT - 1));
    const auto z_hi = static_cast<unsigned short>(std::clamp(top, z_lo + 1, RC_SPAN_MAX_HEIGHT));
    for (int y = first(lo.y); y < last(hi.y, field.depth()); ++y)
      for (int x = first(lo.x); x < last(hi.x, field.width()); ++x)
        rcAddSpan(&context, solid, x, field.depth() - 1 - y, z_lo, z_hi, RC_NULL_AREA,
                  climb_voxels);
  }
}

struct FreeHeightfield {
  void operator()(rcHeightfield* field) const { rcFreeHeightField(field); }
  void operator()(rcCompactHeightfield* field) const { rcFreeCompactHeightfield(field); }
};
using OpenField = std::unique_ptr<rcCompactHeightfield, FreeHeightfield>;

Result<OpenField> find_open_space(const Scene& scene, const Field& field) {
  rcContext context(false);
  const std::unique_ptr<rcHeightfield, FreeHeightfield> solid(rcAllocHeightfield());
  const OpenField none;
  const Vec3 extent = scene.bounds().size();
  // y of the scene runs against Recast's z: the field spans -depth to 0 there.
  const float lo[3] = {0, 0, static_cast<float>(-field.squares_y * field.size)};
  const float hi[3] = {static_cast<float>(field.squares_x * field.size),
                       static_cast<float>(extent.z + 2 * kPersonHeight_m), 0};
  const int headroom = static_cast<int>(std::ceil(kPersonHeight_m / field.voxel_height));
  const int climb = static_cast<int>(std::ceil(field.step_m() / field.voxel_height));
  const int radius = static_cast<int>(std::ceil(kPersonRadius_m / field.voxel()));
  const Error no_memory = runtime_error("cells grid: out of memory; use a larger SIZE");
  if (!solid || !rcCreateHeightfield(&context, *solid, field.width(), field.depth(), lo, hi,
                                     static_cast<float>(field.voxel()),
                                     static_cast<float>(field.voxel_height)))
    return no_memory;
  add_triangles(context, scene, field, climb, *solid);
  fill_boxes(context, scene, field, climb, *solid);
  rcFilterLowHangingWalkableObstacles(&context, climb, *solid);
  rcFilterWalkableLowHeightSpans(&context, headroom, *solid);
  if (rcGetHeightFieldSpanCount(&context, *solid) >= kMaxSpans)
    return invalid_input("cells grid: the scene has too many storeys for squares of " +
                         std::to_string(field.size) + "; use a larger SIZE, or a cells file");
  OpenField open(rcAllocCompactHeightfield());
  if (!open || !rcBuildCompactHeightfield(&context, headroom, climb, *solid, *open) ||
      !rcErodeWalkableArea(&context, radius, *open))
    return no_memory;
  return open;
}

// For every span of the open space the number of its connected floor, -1 where none can stand.
std::vector<int> connected_floors(const rcCompactHeightfield& open, std::vector<int>& sizes) {
  std::vector<int> floor_of(static_cast<std::size_t>(open.spanCount), -1);
  struct Place {
    int x, y, span;
  };
  std::vector<Place> pending;
  const auto visit = [&](int x, int y, int span) {
    if (open.areas[span] == RC_NULL_AREA || floor_of[span] >= 0) return;
    floor_of[span] = static_cast<int>(sizes.size()) - 1;
    ++sizes.back();
    pending.push_back({x, y, span});
  };
  for (int y = 0; y < open.height; ++y)
    for (int x = 0; x < open.width; ++x) {
      const rcCompactCell& column = open.cells[x + y * open.width];
      for (int s = static_cast<int>(column.index), end = s + static_cast<int>(column.count);
           s < end; ++s) {
        if (open.areas[s] == RC_NULL_AREA || floor_of[s] >= 0) continue;
        sizes.push_back(0);
        visit(x, y, s);
        while (!pending.empty()) {
          const Place at = pending.back();
          pending.pop_back();
          for (int direction = 0; direction < 4; ++direction) {
            const int connection = rcGetCon(open.spans[at.span], direction);
            if (connection == RC_NOT_CONNECTED) continue;
            const int nx = at.x + rcGetDirOffsetX(direction);
            const int ny = at.y + rcGetDirOffsetY(direction);
            const auto& next = open.cells[nx + ny * open.width];
            visit(nx, ny, static_cast<int>(next.index) + connection);
          }
        }
      }
    }
  return floor_of;
}

struct Stand {
  int x, y;  // voxel, y as in the scene
  double z;  // of the floor
};

// One cell a storey: a walkable floor rises by no more than a step from voxel to voxel, so a larger
// gap between heights parts two floors.
void add_square(const Field& field, const GridRequest& request, std::vector<Stand>& stands,
                std::vector<RootCell>& cells) {
  std::sort(stands.begin(), stands.end(), [](const Stand& a, const Stand& b) { return a.z < b.z; });
  for (std::size_t begin = 0, end; begin < stands.size(); begin = end) {
    int x_lo = stands[begin].x, x_hi = x_lo, y_lo = stands[begin].y, y_hi = y_lo;
    for (end = begin; end < stands.size(); ++end) {
      if (end > begin && stands[end].z - stands[end - 1].z > field.step_m() + field.voxel_height)
        break;
      x_lo = std::min(x_lo, stands[end].x), x_hi = std::max(x_hi, stands[end].x);
      y_lo = std::min(y_lo, stands[end].y), y_hi = std::max(y_hi, stands[end].y);
    }
    // The floor lies anywhere in its voxel's height.
    const Box box{{field.border(0, x_lo), field.border(1, y_lo),
                   stands[begin].z - field.voxel_height + kEyeLow_m},
                  {field.border(0, x_hi + 1), field.border(1, y_hi + 1),
                   stands[end - 1].z + kEyeLow_m + request.height}};
    cells.push_back({static_cast<std::int64_t>(cells.size()), Cell::aligned(box)});
  }
}

}  // namespace

Result<std::vector<RootCell>> grid_cells(const Scene& scene, const GridRequest& request) {
  const Result<Field> layout = lay_out(scene, request);
  if (!layout) return layout.error();
  const Field& field = *layout;
  Result<OpenField> found = find_open_space(scene, field);
  if (!found) return found.error();
  const rcCompactHeightfield& open = **found;

  std::vector<int> sizes;
  const std::vector<int> floor_of = connected_floors(open, sizes);
  const int largest = sizes.empty() ? 0 : *std::max_element(sizes.begin(), sizes.end());
  std::vector<RootCell> cells;
  std::vector<Stand> stands;
  for (int sy = 0; sy < field.squares_y; ++sy)
    for (int sx = 0; sx < field.squares_x; ++sx) {
      stands.clear();
      for (int y = sy * field.per_square; y < (sy + 1) * field.per_square; ++y)
        for (int x = sx * field.per_square; x < (sx + 1) * field.per_square; ++x) {
          const auto& column = open.cells[x + (field.depth() - 1 - y) * open.width];
          for (unsigned s = column.index, end = s + column.count; s < end; ++s)
            if (floor_of[s] >= 0 && sizes[floor_of[s]] >= kSmallestFloorShare * largest)
              stands.push_back({x, y, field.origin.z + open.spans[s].y * field.voxel_height});
        }
      add_square(field, request, stands, cells);
    }
  if (cells.empty())
    return invalid_input(
        "cells grid: found no floor a person can stand on; is the scene in metres, and the right "
        "axis up? Otherwise give a cells file");
  return cells;
}

}  // namespace pvsfarm
