#include "worker/visibility/triangle_distance.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

// Of p to the segment a-b.
double point_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double n = dot(d, d);
  const double t = n > 0 ? std::clamp(dot(p - a, d) / n, 0.0, 1.0) : 0.0;
  return length(p - a - d * t);
}

// The least of the four ends against the other segment, and of the lines if their common
// perpendicular lies within both.
double segment_to_segment(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& e) {
  double least = std::min({point_to_segment(a, c, e), point_to_segment(b, c, e),
                           point_to_segment(c, a, b), point_to_segment(e, a, b)});
  const Vec3 u = b - a, v = e - c, w = c - a, n = cross(u, v);
  const double nn = dot(n, n);
  if (nn > 0) {
    const double s = dot(cross(w, v), n) / nn, t = dot(cross(w, u), n) / nn;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
      least = std::min(least, length(a + u * s - c - v * t));
  }
  return least;
}

bool above_triangle(const Vec3& p, const Vec3 (&t)[3], const Vec3& normal) {
  for (int k = 0; k < 3; ++k)
    if (dot(cross(t[(k + 1) % 3] - t[k], normal), p - t[k]) > 0) return false;
  return true;
}

}  // namespace

double segment_distance(const Vec3& a, const Vec3& b, const Vec3 (&t)[3]) {
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if (length(t[(k + 1) % 3] - t[k]) > length(t[(longest + 1) % 3] - t[longest])) longest = k;
  return segment_to_segment(a, b, t[longest], t[(longest + 1) % 3]);
}

double triangle_distance(const Vec3& a, const Vec3& b, const Vec3 (&t)[3]) {
  double least =
      std::min({segment_to_segment(a, b, t[0], t[1]), segment_to_segment(a, b, t[1], t[2]),
                segment_to_segment(a, b, t[2], t[0])});
  const Vec3 normal = cross(t[1] - t[0], t[2] - t[0]);
  const double n = length(normal);
  if (!(n > 0)) return least;
  const double ha = dot(normal, a - t[0]) / n, hb = dot(normal, b - t[0]) / n;
  if (above_triangle(a, t, normal)) least = std::min(least, std::abs(ha));
  if (above_triangle(b, t, normal)) least = std::min(least, std::abs(hb));
  if ((ha > 0) != (hb > 0) && above_triangle(a + (b - a) * (ha / (ha - hb)), t, normal)) return 0;
  return least;
}

}  // namespace pvsfarm
