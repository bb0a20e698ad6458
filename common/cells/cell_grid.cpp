// Grid cells over the places where a person can stand, found with Recast (its only include).
//
// Recast voxelises the triangles, marks the tops of walkable spans, and takes away what has no
// headroom or lies within a person's radius of an obstacle. Then, here: roofs, and connected floors
// much smaller than the largest (ledges, the insides of closed buildings), are left out, and every
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
constexpr double kVoxel_m = 0.15;             // where the limit allows: a door is six of them
constexpr double kSmallestFloorShare = 0.01;  // of the largest connected floor

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
  const double affordable = std::sqrt(kMaxColumns / (across * up));
  field.per_square =
      std::max(1, static_cast<int>(std::min(std::ceil(request.size / kVoxel_m), affordable)));
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
// a hall. Fill the boxes the scene knows to be matter. Returns for every column, in Recast's order,
// how high boxes that overtop a person reach, 0 where there is none.
std::vector<unsigned short> fill_boxes(rcContext& context, const Scene& scene, const Field& field,
                                       int climb_voxels, rcHeightfield& solid) {
  std::vector<unsigned short> tops(static_cast<std::size_t>(field.width()) * field.depth(), 0);
  for (const Occluder& occluder : scene.occluders()) {
    if (!occluder.is_box) continue;
    const bool is_tall = occluder.box.size().z > kPersonHeight_m;
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
      for (int x = first(lo.x); x < last(hi.x, field.width()); ++x) {
        const int row = field.depth() - 1 - y;
        rcAddSpan(&context, solid, x, row, z_lo, z_hi, RC_NULL_AREA, climb_voxels);
        if (!is_tall) continue;
        unsigned short& column_top = tops[static_cast<std::size_t>(row) * field.width() + x];
        column_top = std::max(column_top, z_hi);
      }
  }
  return tops;
}

struct FreeHeightfield {
  void operator()(rcHeightfield* field) const { rcFreeHeightField(field); }
  void operator()(rcCompactHeightfield* field) const { rcFreeCompactHeightfield(field); }
};
struct OpenSpace {
  std::unique_ptr<rcCompactHeightfield, FreeHeightfield> field;
  std::vector<unsigned short> box_tops;  // see fill_boxes
};

struct Clearance {  // voxels
  int headroom, climb, radius;
};

Clearance clearance_of(const Field& field) {
  return {static_cast<int>(std::ceil(kPersonHeight_m / field.voxel_height)),
          static_cast<int>(std::ceil(field.step_m() / field.voxel_height)),
          static_cast<int>(std::ceil(kPersonRadius_m / field.voxel()))};
}

Error out_of_memory() { return runtime_error("cells grid: out of memory; use a larger SIZE"); }

Result<OpenSpace> find_open_space(const Scene& scene, const Field& field) {
  rcContext context(false);
  const std::unique_ptr<rcHeightfield, FreeHeightfield> solid(rcAllocHeightfield());
  // y of the scene runs against Recast's z: the field spans -depth to 0 there.
  const float lo[3] = {0, 0, static_cast<float>(-field.squares_y * field.size)};
  const float hi[3] = {static_cast<float>(field.squares_x * field.size),
                       static_cast<float>(scene.bounds().size().z + 2 * kPersonHeight_m), 0};
  const Clearance clearance = clearance_of(field);
  if (!solid || !rcCreateHeightfield(&context, *solid, field.width(), field.depth(), lo, hi,
                                     static_cast<float>(field.voxel()),
                                     static_cast<float>(field.voxel_height)))
    return out_of_memory();
  add_triangles(context, scene, field, clearance.climb, *solid);
  OpenSpace open{nullptr, fill_boxes(context, scene, field, clearance.climb, *solid)};
  rcFilterLowHangingWalkableObstacles(&context, clearance.climb, *solid);
  rcFilterWalkableLowHeightSpans(&context, clearance.headroom, *solid);
  if (rcGetHeightFieldSpanCount(&context, *solid) >= kMaxSpans)
    return invalid_input("cells grid: the scene has too many storeys for squares of " +
                         std::to_string(field.size) + "; use a larger SIZE, or a cells file");
  open.field.reset(rcAllocCompactHeightfield());
  if (!open.field || !rcBuildCompactHeightfield(&context, clearance.headroom, clearance.climb,
                                                *solid, *open.field))
    return out_of_memory();
  return open;
}

// The connected floors of the open space, doors and all: found before a person's radius is taken
// off, which closes any door only a few voxels wide.
struct Floors {
  std::vector<int> of_span;  // number of the floor; -1 where none can stand
  std::vector<int> area;     // of each floor, in voxels
  std::vector<int> roof;     // so many of them under the sky, over another floor or a tall box

  // A floor of mostly such voxels is a roof; what leads up to one joins it to the floor it came
  // from. Much smaller ones than the largest that is left are ledges and the like.
  std::vector<bool> worth_standing_on() const {
    int largest = 0;
    for (std::size_t f = 0; f < area.size(); ++f)
      if (2 * roof[f] <= area[f]) largest = std::max(largest, area[f]);
    std::vector<bool> worth;
    for (std::size_t f = 0; f < area.size(); ++f)
      worth.push_back(2 * roof[f] <= area[f] && area[f] >= kSmallestFloorShare * largest);
    return worth;
  }
};

class FloorFinder {
 public:
  explicit FloorFinder(const OpenSpace& space) : open_(*space.field), box_tops_(space.box_tops) {
    floors_.of_span.assign(static_cast<std::size_t>(open_.spanCount), -1);
  }

  Floors find() && {
    for (int y = 0; y < open_.height; ++y)
      for (int x = 0; x < open_.width; ++x) {
        const rcCompactCell& column = open_.cells[x + y * open_.width];
        for (int s = static_cast<int>(column.index), n = static_cast<int>(column.count); n > 0;
             ++s, --n) {
          if (open_.areas[s] == RC_NULL_AREA || floors_.of_span[s] >= 0) continue;
          floors_.area.push_back(0);
          floors_.roof.push_back(0);
          flood({x, y, s});
        }
      }
    return std::move(floors_);
  }

 private:
  struct Place {
    int x, y, span;
  };

  void visit(const Place& at) {
    if (open_.areas[at.span] == RC_NULL_AREA || floors_.of_span[at.span] >= 0) return;
    floors_.of_span[at.span] = static_cast<int>(floors_.area.size()) - 1;
    ++floors_.area.back();
    floors_.roof.back() += is_roof(at);
    pending_.push_back(at);
  }

  void flood(const Place& start) {
    visit(start);
    while (!pending_.empty()) {
      const Place at = pending_.back();
      pending_.pop_back();
      for (int direction = 0; direction < 4; ++direction) {
        const int connection = rcGetCon(open_.spans[at.span], direction);
        if (connection == RC_NOT_CONNECTED) continue;
        const int x = at.x + rcGetDirOffsetX(direction), y = at.y + rcGetDirOffsetY(direction);
        visit({x, y, static_cast<int>(open_.cells[x + y * open_.width].index) + connection});
      }
    }
  }

  bool is_roof(const Place& at) const {
    const rcCompactCell& column = open_.cells[at.x + at.y * open_.width];
    const int first = static_cast<int>(column.index);
    if (at.span + 1 < first + static_cast<int>(column.count)) return false;
    const int box_top = box_tops_[static_cast<std::size_t>(at.x + at.y * open_.width)];
    if (box_top > 0 && std::abs(open_.spans[at.span].y - box_top) <= 1) return true;
    for (int s = first; s < at.span; ++s)
      if (open_.areas[s] != RC_NULL_AREA) return true;
    return false;
  }

  const rcCompactHeightfield& open_;
  const std::vector<unsigned short>& box_tops_;
  Floors floors_;
  std::vector<Place> pending_;
};

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
  Result<OpenSpace> found = find_open_space(scene, field);
  if (!found) return found.error();
  rcCompactHeightfield& open = *found->field;
  const Floors floors = FloorFinder(*found).find();
  const std::vector<bool> worth = floors.worth_standing_on();
  rcContext context(false);
  if (!rcErodeWalkableArea(&context, clearance_of(field).radius, open)) return out_of_memory();

  std::vector<RootCell> cells;
  std::vector<Stand> stands;
  for (int sy = 0; sy < field.squares_y; ++sy)
    for (int sx = 0; sx < field.squares_x; ++sx) {
      stands.clear();
      for (int y = sy * field.per_square; y < (sy + 1) * field.per_square; ++y)
        for (int x = sx * field.per_square; x < (sx + 1) * field.per_square; ++x) {
          const auto& column = open.cells[x + (field.depth() - 1 - y) * open.width];
          for (unsigned s = column.index, end = s + column.count; s < end; ++s)
            if (open.areas[s] != RC_NULL_AREA && worth[floors.of_span[s]])
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
