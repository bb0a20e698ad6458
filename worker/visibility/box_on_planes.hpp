// Rule P for one box on all planes before one face at once: the arithmetic of occludee_test.hpp,
// a lane a plane. Same answers as test_box, plane by plane (held together by a test).
#pragma once

#include <optional>
#include <span>

#include "worker/visibility/occludee_test.hpp"

namespace pvsfarm {

inline constexpr int kMaxPlanesAtOnce = 16;

// Maps of planes before one face, laid out in columns. Valid until a map changes.
// Threads: const after `set`; `place` and `answer` are one object, one thread.
class BoxOnPlanes {
 public:
  // As many of the leading maps as have the first one's face and fit. Returns how many.
  std::size_t set(std::span<const OcclusionMap> maps);
  // The same for planes whose maps are not drawn yet: `place` and `pixels`, but no `answer`.
  std::size_t set(std::span<const ProjectionPlane> planes);
  const ProjectionPlane& nearest_plane() const { return first_; }

  // Where the box falls on each of them.
  void place(const Box& local_box);
  // The pixels of map `k` that the box last placed falls on, cut to the map; none where it does
  // not.
  std::optional<PixelRange> pixels(std::size_t k) const;
  // What map `k` says of the box last placed.
  PlaneAnswer answer(std::size_t k) const;
  // The same, a bit a map, as far as no pixel need be looked at: those that can hide no part of the
  // box, and those that its whole Projection falls on. The others do not tell.
  unsigned futile() const { return futile_; }
  unsigned falls() const { return falls_; }
  // Of a map that the box falls on.
  PlaneAnswer answer_of_pixels(std::size_t k) const;
  // Whether some of the box may lie before the plane of map `k`, which it falls on.
  bool before_plane(std::size_t k) const { return places_.nearest[k] < 0; }

  // Unused lanes are copies of the last plane.
  struct Columns {
    alignas(64) double distance[kMaxPlanesAtOnce], back[kMaxPlanesAtOnce];
    alignas(64) double x0[kMaxPlanesAtOnce], y0[kMaxPlanesAtOnce];
    alignas(64) double px[kMaxPlanesAtOnce], py[kMaxPlanesAtOnce];
    alignas(64) double per_px[kMaxPlanesAtOnce], per_py[kMaxPlanesAtOnce];
    alignas(64) double side[kMaxPlanesAtOnce], lowest[kMaxPlanesAtOnce];
  };
  struct Places {
    alignas(64) double nearest[kMaxPlanesAtOnce], deepest[kMaxPlanesAtOnce];  // depths of the box
    alignas(32) float before[kMaxPlanesAtOnce];  // `nearest`, not above it
    alignas(32) std::int32_t i0[kMaxPlanesAtOnce], j0[kMaxPlanesAtOnce];
    alignas(32) std::int32_t i1[kMaxPlanesAtOnce], j1[kMaxPlanesAtOnce];
  };

 private:
  template <class PlaneOf>
  std::size_t set_columns(std::size_t most, PlaneOf&& plane_of);

  std::span<const OcclusionMap> maps_;
  ProjectionPlane first_;
  int lanes_ = 0;  // rounded up
  Columns columns_;
  Places places_;
  unsigned futile_ = 0, falls_ = 0;
};

}  // namespace pvsfarm
