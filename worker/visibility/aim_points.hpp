// Where to look from and what to look at: viewpoints of a cell, and points on objects' surfaces
// that lie inside a triangle by a margin, so that a line of sight to them is robust.
//
// Corners first, of cells and of objects: what shows at all shows most often at a corner, above or
// beside what hides the rest.
// Threads: one object, one thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/random.hpp"
#include "common/cells/cell.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

// A point of a surface, on a triangle of scene.all_triangles().
struct AimPoint {
  Vec3 point{0};
  std::uint32_t triangle = 0;
};

// Viewpoints of the cell: the 8 corners (k = 0..7, upper ones first), then the centre of its upper
// face, then seeded points: on edges, on faces and inside, in turn.
Vec3 viewpoint(const Cell& cell, std::uint64_t k, Random& random);

class AimPoints {
 public:
  explicit AimPoints(std::shared_ptr<const Scene> scene);

  // [limit] Corners kept of an object: four of its highest, four outer ones above, four below.
  static constexpr std::uint64_t kCorners = 12;

  // The k-th corner of the object, moved inside a triangle that meets there by `margin`; of several
  // triangles one that faces `eye`. None if there is no such triangle.
  std::optional<AimPoint> corner(ObjectId object, std::uint64_t k, Random& random, const Vec3& eye,
                                 double margin);
  // A random point of the edge that leads from the k-th corner to the highest neighbour, the same
  // way.
  std::optional<AimPoint> rim(ObjectId object, std::uint64_t k, Random& random, const Vec3& eye,
                              double margin);
  // A random point of a random triangle that faces `eye`; none after a few tries.
  std::optional<AimPoint> anywhere(ObjectId object, Random& random, const Vec3& eye,
                                   double margin) const;

 private:
  // [limit] Triangles kept of a corner.
  static constexpr std::uint32_t kFan = 6;
  struct Corner {
    std::uint32_t vertex = 0, count = 0;
    std::uint32_t triangle[kFan] = {};
  };
  const std::vector<Corner>& corners_of(ObjectId object);
  std::optional<AimPoint> at_corner(ObjectId object, std::uint64_t k, bool along_rim,
                                    Random& random, const Vec3& eye, double margin);
  std::optional<AimPoint> inside(std::uint32_t triangle, const Vec3& at, double margin) const;
  bool faces(std::uint32_t triangle, const Vec3& eye) const;

  std::shared_ptr<const Scene> scene_;
  std::vector<std::vector<Corner>> corners_;  // by object; filled when first asked for
};

}  // namespace pvsfarm
