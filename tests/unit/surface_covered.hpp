// What one surface covers of one occlusion map, and whether rays agree.
#pragma once

#include <algorithm>

#include "common/base/random.hpp"
#include "common/scene/scene_build.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/ray_oracle.hpp"
#include "worker/visibility/surface_cover.hpp"

namespace pvsfarm {

inline constexpr int kSide = 64;

// A cell of two metres around the origin, and a plane beyond its +x face: map x is y, map y is z.
inline const Cell kCell = Cell::aligned({{-1, -1, -1}, {1, 1, 1}});

class Covered {
 public:
  explicit Covered(const SourceObject& surface, double distance = 9, const Cell& cell = kCell,
                   double near_m = 0, Face face = {0, 1})
      : cell_(cell), frame_(cell) {
    source_.objects = {surface};
    const Result<std::shared_ptr<const Scene>> scene = build_scene(source_);
    SurfaceChainBuilder(**scene).build(cell, frame_, {.near_m = near_m}, chain_);
    map_.reset(square_plane(frame_, face, distance, 0.8, kSide));
    map_.build_pyramids();
    SurfaceCover().draw(chain_, frame_, TileMask().set(), map_);
  }

  const SurfaceChain& chain() const { return chain_; }
  float at(double y, double z) const {
    const ProjectionPlane& plane = map_.plane();
    return depth(static_cast<int>((y - plane.x0) / plane.px),
                 static_cast<int>((z - plane.y0) / plane.py));
  }
  bool covers(double y, double z) const { return at(y, z) < kUncovered; }
  int count() const {
    return static_cast<int>(std::count_if(map_.base(), map_.base() + kSide * kSide,
                                          [](float z) { return z < kUncovered; }));
  }

  // Rays from the cell to the covered pixels that meet nothing on their way, or only beyond Z.
  int broken_promises(int rays_a_pixel = 40) const {
    const RayOracle oracle(source_);
    Random random(7);
    const ProjectionPlane& plane = map_.plane();
    const double from_center = plane.hw + plane.distance;
    int broken = 0;
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        if (!(depth(i, j) < kUncovered)) continue;
        for (int r = 0; r < rays_a_pixel; ++r) {
          const Vec3 eye = sample_cell(cell_, random);
          const Vec3 end{from_center + kCell.center().x + offset().x,
                         plane.x0 + plane.px * (i + random.between(0, 1)) + offset().y,
                         plane.y0 + plane.py * (j + random.between(0, 1)) + offset().z};
          const double until = (end.x + depth(i, j) + 1e-6 - eye.x) / (end.x - eye.x);
          broken += oracle.clear_by({eye, eye + (end - eye) * until}, 1e-9) ? 1 : 0;
        }
      }
    return broken;
  }

 private:
  float depth(int i, int j) const { return map_.base()[j * kSide + i]; }
  Vec3 offset() const { return cell_.center(); }

  SceneSource source_;
  Cell cell_;
  CellFrame frame_;
  SurfaceChain chain_;
  OcclusionMap map_;
};

inline SourceObject quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 corners[] = {a, b, c, d};
  return polygon_object("quad", corners);
}

}  // namespace pvsfarm
