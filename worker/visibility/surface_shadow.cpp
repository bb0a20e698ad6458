#include "worker/visibility/surface_shadow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pvsfarm {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNearShare = 1.0 / 64;  // of the distance: views of what is nearer have no end

Vec3 at_depth(const Vec3& a, const Vec3& b, double z) {
  const double t = std::clamp((z - a.z) / (b.z - a.z), 0.0, 1.0);
  return a + (b - a) * t;
}

}  // namespace

// Rectangles around `center`, of half sides (hu, hv) times `factor`, whose hull is the shadow; from
// those with an `origin` it may go on in the directions from the cell to that point, for ever.
struct ShadowMaker::Spread {
  struct Rectangle {
    double x, y, factor;
    bool endless;
    double origin_x, origin_y;
  };
  std::array<Rectangle, 8> rectangles;
  int count = 0;
  double alpha = 1;  // the largest magnification
  unsigned beyond = 0;
};

ShadowMaker::ShadowMaker(const ProjectionPlane& plane, double frame_scale, double largest)
    : plane_(plane),
      scale_(frame_scale + plane.hu + plane.hv + plane.distance + 2 * plane.hw + largest),
      tolerance_(0x1p-44 * scale_),
      far_from_(-plane.distance * (1 - kNearShare)) {}

// Views from the front and from the back face; those from between lie between.
void ShadowMaker::add_far(const Vec3& point, Spread& spread) const {
  const double front = plane_.distance, back = plane_.distance + 2 * plane_.hw;
  for (const double from : {front, back}) {
    const double alpha = from / (point.z + from);
    spread.rectangles[spread.count++] = {
        point.x * alpha, point.y * alpha, std::abs(alpha - 1), false, 0, 0};
    spread.alpha = std::max(spread.alpha, alpha);
  }
}

void ShadowMaker::add_near(const Vec3& point, double alpha, Spread& spread) const {
  spread.rectangles[spread.count++] = {point.x * alpha, point.y * alpha, alpha - 1, true,
                                       point.x,         point.y};
  spread.alpha = std::max(spread.alpha, alpha);
}

// (dx, dy): along the views. One fitted strip runs along them, one along the line from the middle.
Shadow ShadowMaker::bound(const Spread& spread, double dx, double dy) const {
  Shadow shadow;
  if (spread.count == 0) return shadow;
  double x = 0, y = 0;
  for (int i = 0; i < spread.count; ++i) {
    x += spread.rectangles[i].x;
    y += spread.rectangles[i].y;
  }
  shadow.nx = {-dy, -y};
  shadow.ny = {dx, x};
  const double rounding = 0x1p-44 * (1 + spread.alpha) * (1 + spread.alpha) * scale_;
  const double margin = rounding + 1e-6 * (plane_.px + plane_.py);
  const double direction_error = 0x1p-44 * scale_;
  for (int k = 0; k < 4; ++k) {
    const double nx = k == 0 ? 1 : k == 1 ? 0 : shadow.nx[k - 2];
    const double ny = k == 0 ? 0 : k == 1 ? 1 : shadow.ny[k - 2];
    const double size = std::abs(nx) + std::abs(ny);
    const double reach = std::abs(nx) * plane_.hu + std::abs(ny) * plane_.hv;
    double lo = kInfinity, hi = -kInfinity;
    for (int i = 0; i < spread.count; ++i) {
      const Spread::Rectangle& r = spread.rectangles[i];
      const double at = nx * r.x + ny * r.y;
      lo = std::min(lo, at - reach * r.factor);
      hi = std::max(hi, at + reach * r.factor);
      if (!r.endless) continue;
      // It goes on from the cell to the point and further: never down if all of the cell is below.
      const double away = nx * r.origin_x + ny * r.origin_y;
      const bool surely_above = k < 2 && (spread.beyond & (2u << (2 * k))) != 0;
      const bool surely_below = k < 2 && (spread.beyond & (1u << (2 * k))) != 0;
      if (!surely_above && !(away - reach > direction_error * size)) lo = -kInfinity;
      if (!surely_below && !(away + reach < -direction_error * size)) hi = kInfinity;
    }
    shadow.lo[k] = lo - margin * size;
    shadow.hi[k] = hi + margin * size;
  }
  return shadow;
}

Shadow ShadowMaker::of_edge(const Vec3& a, const Vec3& b, unsigned beyond) const {
  const Vec3 &low = a.z <= b.z ? a : b, &high = a.z <= b.z ? b : a;
  const double behind = -plane_.distance - 2 * plane_.hw - tolerance_;
  Spread spread;
  spread.beyond = beyond;
  if (!(low.z <= tolerance_) || !(high.z >= behind)) return {};
  const Vec3 end = high.z > tolerance_ ? at_depth(low, high, tolerance_) : high;
  double dx = end.x - low.x, dy = end.y - low.y;
  if (end.z > far_from_) {
    const Vec3 start = low.z < far_from_ ? at_depth(low, high, far_from_) : low;
    add_far(start, spread);
    add_far(end, spread);
    const double front = plane_.distance;
    dx = end.x * front / (end.z + front) - start.x * front / (start.z + front);
    dy = end.y * front / (end.z + front) - start.y * front / (start.z + front);
  }
  if (low.z <= far_from_) {
    const Vec3 nearest = low.z < behind ? at_depth(low, high, behind) : low;
    const Vec3 farthest = high.z > far_from_ ? at_depth(low, high, far_from_) : high;
    // No eye of the cell is farther from the point than the back face: t is at least this.
    const double back = plane_.distance + 2 * plane_.hw + 2 * tolerance_;
    const double t = std::min(64.0, -farthest.z / std::max(farthest.z + back, tolerance_));
    const double alpha = 1 + std::max(0.0, t * (1 - 0x1p-30));
    add_near(nearest, alpha, spread);
    add_near(farthest, alpha, spread);
  }
  return bound(spread, dx, dy);
}

Shadow ShadowMaker::of_section(const Vec3 (&triangle)[3]) const {
  Spread spread;
  const auto add = [&spread](const Vec3& p) {
    if (spread.count < static_cast<int>(spread.rectangles.size()))
      spread.rectangles[spread.count++] = {p.x, p.y, 0, false, 0, 0};
  };
  // At most six: no edge gives more than two, and a corner counts for one of its edges.
  for (int k = 0; k < 3; ++k) {
    const Vec3 &p = triangle[k], &q = triangle[(k + 1) % 3];
    if (std::abs(p.z) <= tolerance_) add(p);
    for (const double cut : {-tolerance_, tolerance_})
      if ((p.z < cut) != (q.z < cut)) add(at_depth(p, q, cut));
  }
  const Vec3 n = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  return bound(spread, -n.y, n.x);
}

}  // namespace pvsfarm
