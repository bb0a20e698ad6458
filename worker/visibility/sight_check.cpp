#include "worker/visibility/sight_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/check.hpp"
#include "common/geometry/collinear.hpp"
#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/triangle_distance.hpp"

namespace pvsfarm {
namespace {

#define PVSFARM_INLINE inline __attribute__((always_inline))

using Four = double __attribute__((vector_size(32)));
using FourFloats = float __attribute__((vector_size(16)));
using FourMasks = std::int64_t __attribute__((vector_size(32)));

// A segment made ready for boxes: the offset of the planes it meets first and last, by axis.
struct BoxQuery {
  double first[3], last[3], inverse[3];
  int side[3];  // which of a node's planes is met first
};

BoxQuery box_query(const Vec3& from, const Vec3& d, double margin) {
  BoxQuery q;
  for (int a = 0; a < 3; ++a) {
    q.inverse[a] = d[a] == 0 ? 1e300 : 1 / d[a];
    q.side[a] = q.inverse[a] < 0;
    q.first[a] = from[a] + (q.side[a] ? -margin : margin);
    q.last[a] = from[a] - (q.side[a] ? -margin : margin);
  }
  return q;
}

// Where the segment enters the children of a node, and which of them it meets before t_max.
PVSFARM_INLINE void enter(const TriangleTree::Node& node, const BoxQuery& q, double t_max,
                          double (&entry)[4], bool (&met)[4]) {
  constexpr double kSlack = 1e-12;
  Four t0 = {0, 0, 0, 0}, t1 = {t_max, t_max, t_max, t_max};
  for (int a = 0; a < 3; ++a) {
    FourFloats first, last;
    __builtin_memcpy(&first, node.plane[q.side[a]][a], sizeof first);
    __builtin_memcpy(&last, node.plane[1 - q.side[a]][a], sizeof last);
    const Four p = (__builtin_convertvector(first, Four) - q.first[a]) * q.inverse[a];
    const Four r = (__builtin_convertvector(last, Four) - q.last[a]) * q.inverse[a];
    t0 = p > t0 ? p : t0;
    t1 = r < t1 ? r : t1;
  }
  const FourMasks hit = t0 <= t1 + kSlack;
  for (int k = 0; k < 4; ++k) entry[k] = t0[k], met[k] = hit[k] != 0;
}

// Calls visit(triangle) for those of every leaf the segment comes within the margin of; visit
// returns the parameter up to which the segment is still of interest, negative to stop.
// `kNearestFirst`: children are walked in the order in which they are entered.
template <bool kNearestFirst, class Visit>
PVSFARM_INLINE void walk(const TriangleTree& tree, const BoxQuery& query, Visit&& visit) {
  if (tree.empty()) return;
  struct Open {
    double entry;
    std::uint32_t child, count;
  };
  Open stack[TriangleTree::kMaxStack];
  int depth = 0;
  double t_max = 1;
  stack[depth++] = {0, 0, 0};
  while (depth > 0) {
    const Open now = stack[--depth];
    if (kNearestFirst && now.entry > t_max) continue;
    for (std::uint32_t i = 0; i < now.count; ++i) {
      t_max = visit(tree.order()[now.child + i]);
      if (t_max < 0) return;
    }
    if (now.count > 0) continue;
    const TriangleTree::Node& node = tree.nodes()[now.child];
    double entry[4];
    bool met[4];
    enter(node, query, t_max, entry, met);
    const int bottom = depth;
    for (int k = 0; k < 4; ++k) {
      if (!met[k]) continue;
      int at = depth++;
      if (kNearestFirst)
        for (; at > bottom && stack[at - 1].entry < entry[k]; --at) stack[at] = stack[at - 1];
      stack[at] = {entry[k], node.child[k], node.count[k]};
    }
  }
}

PVSFARM_INLINE double squared(double x) { return x * x; }

// Does the segment 0 .. d, seen from the eye, come near to the triangle?
PVSFARM_INLINE bool near_triangle(const SeenTriangle& t, bool one_sided, const Vec3& d,
                                  double margin) {
  if (t.degenerate()) return segment_distance(Vec3{0}, d, t.corner) <= margin + t.height();
  const double a = -dot(t.normal, t.corner[0]), rise = dot(t.normal, d), b = a + rise;
  const double slab = margin * t.normal_length;
  if ((a > slab && b > slab) || (a < -slab && b < -slab)) return false;
  if (one_sided && t.back_met(d, margin)) return false;
  double t0 = 0, t1 = 1;  // the part of the segment inside the slab
  if (rise != 0) {
    const double p = (-slab - a) / rise, q = (slab - a) / rise;
    t0 = std::max(t0, std::min(p, q));
    t1 = std::min(t1, std::max(p, q));
  }
  const Vec3 p0 = d * t0, p1 = d * t1;
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = t.corner[(k + 1) % 3] - t.corner[k], out = cross(edge, t.normal);
    const double o0 = dot(out, p0 - t.corner[k]), o1 = dot(out, p1 - t.corner[k]);
    if (!(o0 > 0 && o1 > 0)) continue;
    const double limit = squared(slab) * dot(edge, edge);
    if (squared(o0) > limit && squared(o1) > limit) return false;
  }
  return true;
}

// The parameter at which the segment 0 .. d meets the triangle, or infinity.
PVSFARM_INLINE double meeting(const SeenTriangle& t, bool one_sided, const Vec3& d) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const double rise = dot(t.normal, d);
  if (t.degenerate() || rise == 0 || (one_sided && rise > 0)) return kNever;
  const double at = dot(t.normal, t.corner[0]) / rise;
  if (!(at >= 0 && at <= 1)) return kNever;
  const Vec3 p = d * at;
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = t.corner[(k + 1) % 3] - t.corner[k];
    if (dot(cross(edge, t.normal), p - t.corner[k]) > 0) return kNever;
  }
  return at;
}

bool bit(const std::vector<std::uint8_t>& bits, std::uint32_t i) {
  return bits[i >> 3] >> (i & 7) & 1;
}

// What the queries run on. Free functions of plain data, so that they can be compiled for several
// instruction sets.
struct Matter {
  const Scene& scene;
  const TriangleTree& tree;
  const std::vector<std::uint8_t>& one_sided;
};

// See SightCheck::in_front_of.
bool lies_in_front(const Scene& scene, std::uint32_t target, std::uint32_t other, const Vec3& eye,
                   double margin) {
  const SeenTriangle o(scene, other, eye), t(scene, target, eye);
  const double eye_height = -dot(o.normal, o.corner[0]), slab = margin * o.normal_length;
  if (o.degenerate() || !(std::abs(eye_height) > slab)) return false;
  const auto at = [&](std::uint32_t triangle, int k) -> const Vec3& {
    return scene.vertices()[scene.all_triangles()[triangle].vertex[k]];
  };
  for (int k = 0; k < 3; ++k) {
    const double height = dot(o.normal, t.corner[k] - o.corner[0]);
    if (eye_height > 0 ? height > slab : height < -slab) continue;
    if (std::abs(height) > slab) return false;
    if (!is_coplanar(at(other, 0), at(other, 1), at(other, 2), at(target, k))) return false;
  }
  return true;
}

PVSFARM_DISPATCH bool clear_of_all(const Matter& m, const Sightline& line, std::uint32_t first,
                                   std::uint32_t count, double margin, std::uint32_t target) {
  const Vec3 d = line.point - line.eye;
  bool clear = true;
  walk<false>(m.tree, box_query(line.eye - m.tree.origin(), d, margin), [&](std::uint32_t t) {
    if (t - first < count) return 1.0;
    clear =
        !near_triangle(SeenTriangle(m.scene, t, line.eye), bit(m.one_sided, t), d, margin) ||
        (target != SightCheck::kNoTriangle && lies_in_front(m.scene, target, t, line.eye, margin));
    return clear ? 1.0 : -1.0;
  });
  return clear;
}

PVSFARM_DISPATCH void find_first(const Matter& m, const Sightline& line, double margin,
                                 double& nearest, std::uint32_t& triangle) {
  const Vec3 d = line.point - line.eye;
  walk<true>(m.tree, box_query(line.eye - m.tree.origin(), d, margin), [&](std::uint32_t t) {
    const double at = meeting(SeenTriangle(m.scene, t, line.eye), bit(m.one_sided, t), d);
    // Of equals the lowest number, whatever the order of the walk.
    if (at < nearest || (at == nearest && t < triangle)) nearest = at, triangle = t;
    return std::min(nearest, 1.0);
  });
}

std::vector<std::uint32_t> triangles_of(const Scene& scene, bool opaque) {
  std::vector<std::uint32_t> chosen;
  for (const ObjectRecord& object : scene.objects()) {
    if ((object.occluder && !object.dynamic) != opaque) continue;
    for (std::uint32_t i = 0; i < object.triangle_count; ++i)
      chosen.push_back(static_cast<std::uint32_t>(object.first_triangle) + i);
  }
  return chosen;
}

Vec3 center_of(const Scene& scene) {
  return scene.bounds().empty() ? Vec3{0} : scene.bounds().center();
}

}  // namespace

SeenTriangle::SeenTriangle(const Scene& scene, std::uint32_t triangle, const Vec3& eye) {
  const Triangle& t = scene.all_triangles()[triangle];
  for (int k = 0; k < 3; ++k) corner[k] = scene.vertices()[t.vertex[k]] - eye;
  const Vec3 e0 = corner[1] - corner[0], e1 = corner[2] - corner[1], e2 = corner[0] - corner[2];
  normal = cross(e0, -e2);
  normal_length = length(normal);
  longest = std::sqrt(std::max({dot(e0, e0), dot(e1, e1), dot(e2, e2)}));
}

double SeenTriangle::depth_inside(const Vec3& p) const {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = corner[(k + 1) % 3] - corner[k];
    const double inside = -dot(cross(edge, normal), p - corner[k]);
    least = std::min(least, inside / (length(edge) * normal_length));
  }
  return least;
}

SightCheck::SightCheck(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)),
      tree_(*scene_, triangles_of(*scene_, true), center_of(*scene_)),
      one_sided_(scene_->all_triangles().size() / 8 + 1) {
  for (const ObjectRecord& object : scene_->objects()) {
    if (object.two_sided) continue;
    for (std::uint64_t i = 0; i < object.triangle_count; ++i)
      one_sided_[(object.first_triangle + i) >> 3] |= 1u << ((object.first_triangle + i) & 7);
  }
  if (!scene_->bounds().empty()) radius_ = 0.5 * length(scene_->bounds().size());
}

bool SightCheck::clear_of_all_but(const Sightline& line, std::uint32_t first, std::uint32_t count,
                                  double margin, std::uint32_t target) const {
  return clear_of_all({*scene_, tree_, one_sided_}, line, first, count, margin, target);
}

bool SightCheck::clear(const Sightline& line, ObjectId ignored, double margin,
                       std::uint32_t target) const {
  if (ignored == kNoObject) return clear_of_all_but(line, 0, 0, margin, target);
  const ObjectRecord& object = scene_->object(ignored);
  return clear_of_all_but(line, static_cast<std::uint32_t>(object.first_triangle),
                          object.triangle_count, margin, target);
}

bool SightCheck::in_front_of(std::uint32_t target, std::uint32_t other, const Vec3& eye,
                             double margin) const {
  return lies_in_front(*scene_, target, other, eye, margin);
}

bool SightCheck::clear_but_for(const Sightline& line, std::uint32_t triangle, double margin) const {
  return clear_of_all_but(line, triangle, 1, margin, kNoTriangle);
}

std::optional<SightCheck::Hit> SightCheck::first_hit(const Sightline& line) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  double nearest = kNever;
  std::uint32_t triangle = 0;
  find_first({*scene_, tree_, one_sided_}, line, margin_for(length(line.eye - origin())), nearest,
             triangle);
  if (nearest == kNever) return {};
  return Hit{object_of(triangle), triangle, nearest};
}

bool SightCheck::meets(const Sightline& line, std::uint32_t triangle) const {
  const Vec3 d = line.point - line.eye;
  return meeting(SeenTriangle(*scene_, triangle, line.eye), bit(one_sided_, triangle), d) <= 1;
}

void SightCheck::passed(const Sightline& line, double t_max, std::vector<Hit>& hits) {
  if (!passable_) passable_.emplace(*scene_, triangles_of(*scene_, false), center_of(*scene_));
  const Vec3 from = line.eye - origin(), d = line.point - line.eye;
  walk<false>(*passable_, box_query(from, d, margin_for(length(from))), [&](std::uint32_t t) {
    const double at = meeting(SeenTriangle(*scene_, t, line.eye), bit(one_sided_, t), d);
    if (at < t_max) hits.push_back({object_of(t), t, at});
    return t_max;
  });
}

std::vector<SightCheck::Near> SightCheck::nearest(const Sightline& line, ObjectId ignored,
                                                  std::size_t count) const {
  const Vec3 from = line.eye - origin(), d = line.point - line.eye;
  const double farthest = 4 * (radius_ + length(from) + length(d));
  std::vector<Near> found;
  for (double reach = 1e-6 * farthest; !tree_.empty(); reach *= 4) {
    found.clear();
    walk<false>(tree_, box_query(from, d, reach), [&](std::uint32_t t) {
      const ObjectId object = object_of(t);
      const double clearance =
          triangle_distance(Vec3{0}, d, SeenTriangle(*scene_, t, line.eye).corner);
      if (object != ignored && clearance <= reach) found.push_back({object, t, clearance});
      return 1.0;
    });
    // Of each object its nearest triangle, then the nearest objects.
    std::sort(found.begin(), found.end(), [](const Near& a, const Near& b) {
      return std::tuple(a.object, a.clearance, a.triangle) <
             std::tuple(b.object, b.clearance, b.triangle);
    });
    const auto same = [](const Near& a, const Near& b) { return a.object == b.object; };
    found.erase(std::unique(found.begin(), found.end(), same), found.end());
    if (found.size() >= count || reach > farthest) break;
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Near& a, const Near& b) { return a.clearance < b.clearance; });
  if (found.size() > count) found.resize(count);
  return found;
}

double SightCheck::margin_for(double reach) const {
  const Vec3 o = origin();
  return 1e-9 * (radius_ + reach) + 32 * 0x1p-53 * (length(o) + radius_ + reach);
}

ObjectId SightCheck::object_of(std::uint32_t triangle) const {
  const auto objects = scene_->objects();
  const auto after =
      std::upper_bound(objects.begin(), objects.end(), triangle,
                       [](std::uint32_t t, const ObjectRecord& o) { return t < o.first_triangle; });
  return ObjectId{static_cast<std::uint32_t>(after - objects.begin() - 1)};
}

}  // namespace pvsfarm
