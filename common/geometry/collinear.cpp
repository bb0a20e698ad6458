#include "common/geometry/collinear.hpp"

#include <algorithm>
#include <cmath>

namespace pvsfarm {
namespace {

// Shewchuk's ccwerrboundA, rounded up.
constexpr double kFilter = 3.5 * 0x1p-53;
// Below this a product's rounding error may be lost.
constexpr double kSmallest = 0x1p-400;

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
  bool is_zero() const {
    return std::all_of(parts_, parts_ + count_, [](double part) { return part == 0; });
  }

 private:
  double parts_[12];
  int count_ = 0;
};

bool underflows(double v) { return v != 0 && std::abs(v) < kSmallest; }

// Of the points (ax, ay), (bx, by), (cx, cy).
bool is_collinear(double ax, double ay, double bx, double by, double cx, double cy) {
  const double left = (ax - cx) * (by - cy), right = (ay - cy) * (bx - cx);
  if (std::abs(left - right) > kFilter * (std::abs(left) + std::abs(right))) return false;
  if (underflows(ax) || underflows(ay) || underflows(bx) || underflows(by) || underflows(cx) ||
      underflows(cy))
    return false;
  ExactSum determinant;
  determinant.add_product(ax, by);
  determinant.add_product(-ay, bx);
  determinant.add_product(bx, cy);
  determinant.add_product(-by, cx);
  determinant.add_product(cx, ay);
  determinant.add_product(-cy, ax);
  return determinant.is_zero();
}

bool is_between(double p, double a, double b) { return (a <= p && p <= b) || (b <= p && p <= a); }

}  // namespace

bool is_collinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  return is_collinear(a.x, a.y, b.x, b.y, c.x, c.y) && is_collinear(a.y, a.z, b.y, b.z, c.y, c.z) &&
         is_collinear(a.z, a.x, b.z, b.x, c.z, c.x);
}

bool is_inside_edge(const Vec3& p, const Vec3& a, const Vec3& b) {
  return is_between(p.x, a.x, b.x) && is_between(p.y, a.y, b.y) && is_between(p.z, a.z, b.z) &&
         p != a && p != b && is_collinear(p, a, b);
}

}  // namespace pvsfarm
