// Slices: what of a projection plane lies in solids that the cell is outside of, whatever their
// shape, holes included.
//
// Source: Durand 2000, 3.3; theory A.12; docs/algorithm.md A.12 (the rule and its proof). A point
// of the plane is blocked, no deeper than the plane, from every eye if the solid winds around it
// otherwise than around the eyes.
// Differs from Durand 2000: winding numbers instead of normals, so that solids may nest, touch and
// pass through themselves, and may hold the cell; the preconditions are checked.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "worker/visibility/occlusion_map.hpp"
#include "worker/visibility/slice_solids.hpp"

namespace pvsfarm {

struct SliceWork {
  std::uint32_t segments = 0;  // of contours
  std::uint32_t pixels = 0;    // covered anew
};

// Threads: one object, one thread. Keeps scratch memory from cell to cell.
class SliceCover {
 public:
  explicit SliceCover(const Scene& scene);

  // The solids that may serve this cell: none that a cell may touch, nor, for near_m > 0, that come
  // nearer than that.
  void begin(const Cell& cell, const CellFrame& frame, double near_m);
  // Lowers Z to 0 in the pixels wholly within a slice. Requires: `begin`, with a frame that is
  // still there; the map's pyramids up to date, as they are afterwards.
  SliceWork draw(OcclusionMap& map);

  std::size_t usable_solids() const { return used_.size(); }

 private:
  // A solid as the cell has it.
  struct Used {
    const SliceSolid* solid;
    Box local;
    int winding;  // around the cell
  };
  // Pixels along the scan lines and across them.
  struct Point {
    double along, across;
  };
  struct Window {
    int first_along, end_along, first_across, end_across;
    bool empty() const { return first_along >= end_along || first_across >= end_across; }
    int size() const { return end_along - first_along; }
  };
  struct Section;

  bool use_standing(const Cell& cell) const;
  bool find_winding(const SliceSolid& solid, const Cell& cell, double near_m, int& winding) const;
  bool winding_above(const SliceSolid& solid, const Vec3& eye, int& winding) const;
  bool serves(const Used& used, const Section& section) const;
  Window window_of(const Used& used, const Section& section, const OcclusionMap& map) const;
  void add_contour(const Used& used, const Section& section, const Window& window);
  void add_triangle(const SliceTriangle& triangle, const Section& section, const Window& window);
  void mark_near(const std::array<Vec3, 3>& v, const Section& section, const Window& window);
  void mark(const Point* points, int count, double margin, const Window& window);
  void count_crossing(const Point& up, const Point& down, int sign, const Window& window);
  void fill(const Used& used, const Section& section, const Window& window, OcclusionMap& map);

  const Scene& scene_;
  SliceSolids closed_, standing_;
  Box occludees_;
  const SliceSolids* solids_ = nullptr;
  const CellFrame* frame_ = nullptr;
  bool upright_ = false;  // the frame's third axis is the world's
  std::vector<Used> used_;
  double largest_ = 0;  // coordinate of any of them, locally
  SliceWork work_;
  // Of the pixels of a window, line by line along the scan; all 0 between solids.
  std::vector<std::int32_t> steps_;  // by how much the winding number grows at this pixel
  std::vector<std::uint8_t> touched_;
  struct Span {
    double lo, hi;
  };
  std::vector<Span> spans_;  // of one shape, by scan line
};

}  // namespace pvsfarm
