// Lines of sight in double precision, without any package: does a segment clear all opaque matter
// by a margin, what does it meet first, what does it pass nearest.
//
// Opaque are the triangles of objects that occlude and do not move. A one-sided triangle that a
// segment clearly meets from its back does not block. All else within the margin blocks: touching,
// grazing, and what is too thin to have a normal. The part of space that a triangle blocks is the
// slab of the margin about its plane, cut by its edges moved outwards by the margin; it holds every
// point within the margin of the triangle, and more at sharp corners.
// Only +, -, *, / and square roots, uncontracted: the same answer on every machine.
// Threads: const after construction but for passed(). No query that gives a bool allocates.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/ids.hpp"
#include "common/geometry/vec.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/triangle_tree.hpp"

namespace pvsfarm {

// From an eye to a point.
struct Sightline {
  Vec3 eye{0}, point{0};
};

// A triangle as the checks see it: its corners relative to an eye.
struct SeenTriangle {
  Vec3 corner[3];
  Vec3 normal;  // not of unit length
  double normal_length = 0, longest = 0;

  SeenTriangle(const Scene& scene, std::uint32_t triangle, const Vec3& eye);
  // Too thin to have a normal in double precision.
  bool degenerate() const { return !(normal_length > 1e-12 * longest * longest); }
  // [units] scene units. The least height.
  double height() const { return longest > 0 ? normal_length / longest : 0; }
  // Along `d` its front (direction < 0) or its back is met, beyond doubt within `margin`.
  bool front_met(const Vec3& d, double margin) const { return clearly(-dot(normal, d), d, margin); }
  bool back_met(const Vec3& d, double margin) const { return clearly(dot(normal, d), d, margin); }
  // How far `p` of its plane lies inside the nearest edge; negative outside.
  double depth_inside(const Vec3& p) const;

 private:
  bool clearly(double rise, const Vec3& d, double margin) const {
    return rise > margin * normal_length && rise > margin * length(d) * longest;
  }
};

class SightCheck {
 public:
  static constexpr ObjectId kNoObject{0xffffffffu};
  static constexpr std::uint32_t kNoTriangle = 0xffffffffu;

  struct Hit {
    ObjectId object{};
    std::uint32_t triangle = 0;  // in scene.all_triangles()
    double t = 0;                // along the segment, 0 .. 1
  };
  struct Near {
    ObjectId object{};
    std::uint32_t triangle = 0;
    double clearance = 0;  // [units] scene units; 0: it meets the segment
  };

  explicit SightCheck(std::shared_ptr<const Scene> scene);

  // No opaque triangle comes within `margin` of the segment; those of the object `ignored` do not
  // count, for they cannot hide their own object. Nor, if the segment ends on `target`, do those
  // that it is in_front_of(): what coincides with a surface does not hide it.
  bool clear(const Sightline& line, ObjectId ignored, double margin,
             std::uint32_t target = kNoTriangle) const;
  // The same but for one triangle, which alone does not count; what coincides with it does.
  bool clear_but_for(const Sightline& line, std::uint32_t triangle, double margin) const;
  // Beyond doubt no point of the target is strictly behind the other's plane, as seen from the eye,
  // so that the other blocks no segment between them. Its corners may lie in that plane, exactly.
  bool in_front_of(std::uint32_t target, std::uint32_t other, const Vec3& eye, double margin) const;
  // The segment meets this triangle, which is opaque; no margin. Then it is not clear().
  bool meets(const Sightline& line, std::uint32_t triangle) const;
  // The opaque triangle that the segment meets first, with no margin.
  std::optional<Hit> first_hit(const Sightline& line) const;
  // Appends the triangles of all other matter, which one sees through, that the segment meets
  // before t_max; in no order. The first call sorts that matter, of which there may be more than of
  // all else.
  void passed(const Sightline& line, double t_max, std::vector<Hit>& hits);
  // The `count` opaque triangles nearest to the segment, nearest first, one an object; slow.
  std::vector<Near> nearest(const Sightline& line, ObjectId ignored, std::size_t count) const;

  // [units] scene units. For cells within `reach` of the scene's centre: rounding in this class
  // stays far below it.
  double margin_for(double reach) const;
  ObjectId object_of(std::uint32_t triangle) const;
  bool two_sided(std::uint32_t triangle) const {
    return scene_->object(object_of(triangle)).two_sided;
  }
  const Vec3& origin() const { return tree_.origin(); }
  double radius() const { return radius_; }  // half the diagonal of the scene

 private:
  struct Query;
  bool clear_of_all_but(const Sightline& line, std::uint32_t first, std::uint32_t count,
                        double margin, std::uint32_t target) const;

  std::shared_ptr<const Scene> scene_;
  TriangleTree tree_;
  std::optional<TriangleTree> passable_;
  std::vector<std::uint8_t> one_sided_;  // a bit a triangle
  double radius_ = 0;
};

}  // namespace pvsfarm
