// An independent judge of visibility: casts segments in double precision over the raw triangles of
// a scene, as its file or its test gave them. It shares no code with the building of scenes, with
// occluder models or with worker/.
//
// Objects are named by their position in the SceneSource. Opaque are the triangles of objects that
// occlude and do not move; a one-sided triangle blocks only what meets its front.
// Threads: const after construction.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

struct Segment {
  Vec3 from, to;
};

class RayOracle {
 public:
  static constexpr std::uint32_t kNoObject = std::numeric_limits<std::uint32_t>::max();

  struct Hit {
    double t = 0;  // along the segment, 0 .. 1
    std::uint32_t object = kNoObject;
    std::uint32_t triangle = 0;  // of the object
  };

  explicit RayOracle(const SceneSource& source);

  // The opaque triangle that the segment meets first; no margin.
  std::optional<Hit> first_hit(const Segment& segment) const;

  // An opaque triangle within `margin` of the segment, any one; none if the segment clears all
  // matter by more than that. Triangles of the object `ignored` do not count: they cannot hide
  // their own object. Touching counts as blocked, so "none" is a proof of sight up to rounding far
  // below `margin`.
  std::optional<Hit> blocker(const Segment& segment, double margin,
                             std::uint32_t ignored = kNoObject) const;
  // The same for a segment that ends on `target`, object `position`, and what does not count
  // besides: triangles that the one it ends on is nowhere behind, by more than a thousandth of the
  // margin. What coincides with a surface does not hide it.
  std::optional<Hit> blocker_before(const Segment& segment, double margin, std::uint32_t position,
                                    const SourceObject& target) const;
  bool clear_by(const Segment& segment, double margin, std::uint32_t ignored = kNoObject) const {
    return !blocker(segment, margin, ignored);
  }

  // The margin within which a ray proves nothing: 1e-9 of the extent of scene and viewpoint box
  // together, plus what rounding at these coordinates can move a sample point.
  double margin_for(const Box& viewpoints) const;

  std::size_t triangle_count() const { return triangles_.size(); }

 private:
  struct Triangle {
    Vec3 corner[3];
    Vec3 normal;           // unit
    Vec3 edge_outward[3];  // unit, in the plane, at corner[k] -> corner[k + 1]
    std::uint32_t object, index;
    bool two_sided;
  };
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  // count == 0: inner, children `first` and `first + 1`
  };
  struct Range {
    std::uint32_t node, first, count;
  };

  void build();
  template <class Visit>
  void traverse(const Segment& segment, double margin, Visit&& visit) const;
  using Corners = std::array<Vec3, 3>;
  static bool not_behind(const Corners& end, const Triangle& t, const Vec3& eye, double margin);
  static bool within(const Triangle& t, const Segment& segment, double margin);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
  Box bounds_;  // of every object, opaque or not
};

}  // namespace pvsfarm
