#include "worker/visibility/segment_crossing.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

}  // namespace

std::optional<bool> crosses_triangle(const Vec3& from, const Vec3& to,
                                     const std::array<Vec3, 3>& triangle, double scale) {
  const Vec3 a = triangle[0] - from, b = triangle[1] - from, c = triangle[2] - from;
  const Vec3 ray = to - from;
  const Vec3 ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
  const double sa = size_of(a), sb = size_of(b), sc = size_of(c), rounding = 0x1p-44 * scale;
  // Corners and ends are off by a part of `scale`, and so each product of three by that times the
  // sizes of the two others.
  const double ray_size = size_of(ray) + scale * 0x1p-20;
  const double products[3] = {dot(ab, ray), dot(bc, ray), dot(ca, ray)};
  const double errors[3] = {rounding * ((sa + sb) * ray_size + sa * sb),
                            rounding * ((sb + sc) * ray_size + sb * sc),
                            rounding * ((sc + sa) * ray_size + sc * sa)};
  int left = 0, right = 0;
  for (int k = 0; k < 3; ++k) {
    left += products[k] > errors[k] ? 1 : 0;
    right += products[k] < -errors[k] ? 1 : 0;
  }
  if (left > 0 && right > 0) return false;
  if (left < 3 && right < 3) return {};
  // The line crosses the triangle. The segment does if its ends are on two sides of it.
  const double sign = left == 3 ? 1 : -1;
  const double ahead = sign * dot(a, bc);
  const double through = sign * (products[0] + products[1] + products[2]);
  const double most = std::max({sa, sb, sc});
  const double error = rounding * 8 * (most * most + most * ray_size);
  if (ahead < -error || through - ahead < -error) return false;
  if (ahead > error && through - ahead > error) return true;
  return {};
}

}  // namespace pvsfarm
