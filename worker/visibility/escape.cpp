#include "worker/visibility/escape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pvsfarm {
namespace {

// [limit] Triangles of a target that are tried against a line.
constexpr std::uint32_t kMaxTried = 256;
// [limit] Lines drawn until one meets cell and target.
constexpr int kDraws = 12;

Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 d{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double n = length(d);
    if (n > 0.1 && n < 1) return d / n;
  }
}

// Where on the edge from a along e the line from the eye along d comes nearest, 0 .. 1.
double nearest_on_edge(const Vec3& a, const Vec3& e, const Vec3& eye, const Vec3& d) {
  const Vec3 across = cross(d, e), w = cross(across, d);  // normal to d, in the plane of both
  const double n = dot(e, w);
  return n == 0 ? 0.5 : std::clamp(dot(eye - a, w) / n, 0.0, 1.0);
}

// A point beside an edge of the blocking triangle, or now and then of another of its object: on the
// far side of the edge as seen along the line, by between half the edge's length and `margin`,
// every size as likely as its double.
Vec3 beside_edge(const Scene& scene, const BlockedAim& blocked, double margin, Random& random) {
  const ObjectRecord& object = scene.object(blocked.blocker.object);
  const auto other =
      static_cast<std::uint32_t>(object.first_triangle + random.below(object.triangle_count));
  const Triangle& t =
      scene.all_triangles()[random.below(4) != 0 ? blocked.blocker.triangle : other];
  const std::uint64_t k = random.below(3);
  const Vec3 a = scene.vertices()[t.vertex[k]], e = scene.vertices()[t.vertex[(k + 1) % 3]] - a;
  const Vec3 d = blocked.aim.point - blocked.eye;
  const double s = random.next() & 1 ? random.unit() : nearest_on_edge(a, e, blocked.eye, d);
  const Vec3 at = a + e * s;
  const Vec3 off = (at - blocked.eye) - d * (dot(at - blocked.eye, d) / dot(d, d));
  const double n = length(off);
  Vec3 out = direction(random);
  if (n > 0) out = out * 0.5 + off / n;
  const int octaves = std::clamp(std::ilogb(length(e) / (margin + 1e-300)), 1, 40);
  const double part = std::ldexp(
      random.between(0.5, 1), -static_cast<int>(random.below(static_cast<std::uint64_t>(octaves))));
  return at + out * (length(e) * part);
}

bool meets_box(const Box& box, const Vec3& eye, const Vec3& d) {
  double t0 = 0, t1 = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (eye[a] < box.lo[a] || eye[a] > box.hi[a]) return false;
      continue;
    }
    const double p = (box.lo[a] - eye[a]) / d[a], q = (box.hi[a] - eye[a]) / d[a];
    t0 = std::max(t0, std::min(p, q));
    t1 = std::min(t1, std::max(p, q));
  }
  return t0 <= t1;
}

// The point nearest to the eye where the line along d meets the object.
bool meet(const Scene& scene, ObjectId target, const Vec3& eye, const Vec3& d, AimPoint& aim) {
  const ObjectRecord& object = scene.object(target);
  if (!meets_box(object.box, eye, d)) return false;
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

bool escape(const Scene& scene, const Cell& cell, double margin, Random& random,
            BlockedAim& blocked) {
  for (int k = 0; k < kDraws; ++k) {
    const Vec3 beside = beside_edge(scene, blocked, margin, random), from = blocked.aim.point;
    if (random.next() & 1) {
      if (back_into(cell, from, beside - from, random, blocked.eye)) return true;
    } else if (meet(scene, blocked.target, blocked.eye, beside - blocked.eye, blocked.aim)) {
      return true;
    }
  }
  return false;
}

}  // namespace pvsfarm
