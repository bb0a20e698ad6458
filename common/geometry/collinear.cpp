#include "common/geometry/collinear.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

// Shewchuk's ccwerrboundA, rounded up.
constexpr double kFilter = 3.5 * 0x1p-53;
// Below this a product's rounding error may be lost.
constexpr double kSmallest = 0x1p-300;

// The exact sum of the terms added so far: components of growing size that do not overlap.
class ExactSum {
 public:
  void add(double term) {
    for (int i = 0; i < count_; ++i) {
      const double sum = term + parts_[i];
      const double shadow = sum - term;
      parts_[i] = (term - (sum - shadow)) + (parts_[i] - shadow);  // what the sum lost
      term = sum;
    }
    parts_[count_++] = term;
  }
  void add_product(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  void add_product(double a, double b, double c) {
    const double product = a * b;
    add_product(std::fma(a, b, -product), c);
    add_product(product, c);
  }
  // Of the largest part: all others together are less.
  int sign() const {
    for (int i = count_; i-- > 0;)
      if (parts_[i] != 0) return parts_[i] > 0 ? 1 : -1;
    return 0;
  }

 private:
  double parts_[96];
  int count_ = 0;
};

bool underflows(double v) { return v != 0 && std::abs(v) < kSmallest; }
bool underflows(const Vec3& p) { return underflows(p.x) || underflows(p.y) || underflows(p.z); }

enum class Turn { kRight = -1, kStraight = 0, kLeft = 1, kUnknown };

// From (ax, ay) over (bx, by) to (cx, cy).
Turn turn_in_plane(double ax, double ay, double bx, double by, double cx, double cy) {
  const double left = (ax - cx) * (by - cy), right = (ay - cy) * (bx - cx);
  if (std::abs(left - right) > kFilter * (std::abs(left) + std::abs(right)) + kSmallest)
    return left > right ? Turn::kLeft : Turn::kRight;
  if (underflows(ax) || underflows(ay) || underflows(bx) || underflows(by) || underflows(cx) ||
      underflows(cy))
    return Turn::kUnknown;
  ExactSum determinant;
  determinant.add_product(ax, by);
  determinant.add_product(-ay, bx);
  determinant.add_product(bx, cy);
  determinant.add_product(-by, cx);
  determinant.add_product(cx, ay);
  determinant.add_product(-cy, ax);
  return static_cast<Turn>(determinant.sign());
}

Turn turn_seen_along(const Vec3& a, const Vec3& b, const Vec3& c, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  return turn_in_plane(a[u], a[v], b[u], b[v], c[u], c[v]);
}

// The determinant of the rows a, b, c.
void add_determinant(ExactSum& sum, const Vec3& a, const Vec3& b, const Vec3& c) {
  sum.add_product(a.x, b.y, c.z);
  sum.add_product(-a.x, b.z, c.y);
  sum.add_product(a.y, b.z, c.x);
  sum.add_product(-a.y, b.x, c.z);
  sum.add_product(a.z, b.x, c.y);
  sum.add_product(-a.z, b.y, c.x);
}

bool is_between(double p, double a, double b) { return (a <= p && p <= b) || (b <= p && p <= a); }

}  // namespace

bool is_collinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  for (int axis = 0; axis < 3; ++axis)
    if (turn_seen_along(a, b, c, axis) != Turn::kStraight) return false;
  return true;
}

bool is_inside_edge(const Vec3& p, const Vec3& a, const Vec3& b) {
  return is_between(p.x, a.x, b.x) && is_between(p.y, a.y, b.y) && is_between(p.z, a.z, b.z) &&
         p != a && p != b && is_collinear(p, a, b);
}

bool is_coplanar(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  for (int axis = 0; axis < 3; ++axis)
    if (a[axis] == b[axis] && b[axis] == c[axis] && c[axis] == d[axis]) return true;
  const Vec3 p = a - d, q = b - d, r = c - d;
  const double volume = dot(p, cross(q, r));
  const auto size = [](const Vec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
  if (std::abs(volume) > 0x1p-48 * size(p) * size(q) * size(r) + kSmallest) return false;
  if (underflows(a) || underflows(b) || underflows(c) || underflows(d)) return false;
  ExactSum determinant;
  add_determinant(determinant, a, b, c);
  add_determinant(determinant, a, d, b);
  add_determinant(determinant, a, c, d);
  add_determinant(determinant, b, d, c);
  return determinant.sign() == 0;
}

int turn(const Vec3& a, const Vec3& b, const Vec3& c, int axis) {
  const Turn found = turn_seen_along(a, b, c, axis);
  return found == Turn::kUnknown ? 0 : static_cast<int>(found);
}

}  // namespace pvsfarm
