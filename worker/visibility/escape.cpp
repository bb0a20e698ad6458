#include "worker/visibility/escape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pvsfarm {
namespace {

// [limit] Triangles of a target that are tried against a line.
constexpr std::uint32_t kMaxTried = 256;

Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 d{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double n = length(d);
    if (n > 0.1 && n < 1) return d / n;
  }
}

// A point beside an edge of the blocking triangle, or of another of its object: by a part of the
// edge's length between a third and 2^-30.
Vec3 beside_edge(const Scene& scene, const SightCheck::Hit& blocker, Random& random) {
  const ObjectRecord& object = scene.object(blocker.object);
  const auto other =
      static_cast<std::uint32_t>(object.first_triangle + random.below(object.triangle_count));
  const Triangle& t = scene.all_triangles()[random.next() & 1 ? blocker.triangle : other];
  const std::uint64_t k = random.below(3);
  const Vec3 a = scene.vertices()[t.vertex[k]], b = scene.vertices()[t.vertex[(k + 1) % 3]];
  const double part = std::ldexp(random.between(0.5, 1), -1 - static_cast<int>(random.below(29)));
  return a + (b - a) * random.unit() + direction(random) * (length(b - a) * part);
}

// Some point where the line from the eye along d meets the object.
bool meet(const Scene& scene, ObjectId target, const Vec3& eye, const Vec3& d, AimPoint& aim) {
  const ObjectRecord& object = scene.object(target);
  const std::uint32_t step = object.triangle_count / kMaxTried + 1;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < object.triangle_count; i += step) {
    const auto number = static_cast<std::uint32_t>(object.first_triangle) + i;
    const SeenTriangle t(scene, number, eye);
    const double rise = dot(t.normal, d);
    if (rise == 0 || t.degenerate() || (!object.two_sided && rise > 0)) continue;
    const double at = dot(t.normal, t.corner[0]) / rise;
    if (!(at > 0 && at < nearest) || !(t.depth_inside(d * at) > 0)) continue;
    nearest = at;
    aim = {eye + d * at, number};
  }
  return nearest < std::numeric_limits<double>::infinity();
}

// The part of the line from + t d, t >= 1, inside the cell; a random point of it.
bool back_into(const Cell& cell, const Vec3& from, const Vec3& d, Random& random, Vec3& eye) {
  constexpr double kFar = 1e6;
  double t0 = 1, t1 = kFar;
  Vec3 start, along;
  for (int a = 0; a < 3; ++a) {
    start[a] = dot(from - cell.origin, cell.axes[a]);
    along[a] = dot(d, cell.axes[a]);
    if (along[a] == 0) {
      if (start[a] < cell.lo[a] || start[a] > cell.hi[a]) return false;
      continue;
    }
    const double p = (cell.lo[a] - start[a]) / along[a], q = (cell.hi[a] - start[a]) / along[a];
    t0 = std::max(t0, std::min(p, q));
    t1 = std::min(t1, std::max(p, q));
  }
  if (!(t0 <= t1)) return false;
  Vec3 at = start + along * random.between(t0, t1);
  for (int a = 0; a < 3; ++a) at[a] = std::clamp(at[a], cell.lo[a], cell.hi[a]);
  eye = cell.point(at);
  return true;
}

}  // namespace

bool escape(const Scene& scene, const Cell& cell, Random& random, BlockedAim& blocked) {
  const Vec3 beside = beside_edge(scene, blocked.blocker, random);
  const bool eye_first = random.next() & 1;
  for (const bool move_eye : {eye_first, !eye_first}) {
    if (move_eye) {
      const Vec3 from = blocked.aim.point;
      if (back_into(cell, from, beside - from, random, blocked.eye)) return true;
    } else if (meet(scene, blocked.target, blocked.eye, beside - blocked.eye, blocked.aim)) {
      return true;
    }
  }
  return false;
}

}  // namespace pvsfarm
