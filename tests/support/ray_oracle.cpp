#include "tests/support/ray_oracle.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;
constexpr int kMaxStack = 128;
// A triangle thinner than this part of its length is no matter that could hide anything.
constexpr double kThinnest = 1e-14;

// Does the segment pass within `margin` of the box, before parameter t_max?
bool meets(const Box& box, const Vec3& from, const Vec3& inverse, double margin, double t_max) {
  double t0 = 0, t1 = t_max;
  for (int a = 0; a < 3; ++a) {
    const double p = (box.lo[a] - margin - from[a]) * inverse[a];
    const double q = (box.hi[a] + margin - from[a]) * inverse[a];
    t0 = std::max(t0, std::min(p, q));
    t1 = std::min(t1, std::max(p, q));
  }
  return t0 <= t1 + 1e-12;
}

Vec3 inverse_of(const Vec3& d) {
  Vec3 r;
  for (int a = 0; a < 3; ++a) r[a] = d[a] == 0 ? 1e300 : 1 / d[a];
  return r;
}

}  // namespace

RayOracle::RayOracle(const SceneSource& source) {
  for (std::uint32_t o = 0; o < source.objects.size(); ++o) {
    const SourceObject& object = source.objects[o];
    for (const Vec3& v : object.vertices) bounds_.add(v);
    if (!object.occluder || object.dynamic) continue;
    for (std::uint32_t i = 0; i < object.triangles.size(); ++i) {
      const auto& index = object.triangles[i];
      Triangle t;
      for (int k = 0; k < 3; ++k) t.corner[k] = object.vertices[index[k]];
      const Vec3 n = cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
      double longest = 0;
      for (int k = 0; k < 3; ++k)
        longest = std::max(longest, length(t.corner[(k + 1) % 3] - t.corner[k]));
      if (!(length(n) > kThinnest * longest * longest)) continue;
      t.normal = n / length(n);
      for (int k = 0; k < 3; ++k) {
        const Vec3 out = cross(t.corner[(k + 1) % 3] - t.corner[k], t.normal);
        t.edge_outward[k] = out / length(out);
      }
      t.object = o;
      t.index = i;
      t.two_sided = object.two_sided;
      triangles_.push_back(t);
    }
  }
  build();
}

// Splits at the median of the longest axis of the centroids until few triangles are left.
void RayOracle::build() {
  nodes_.emplace_back();
  std::vector<Range> open{{0, 0, static_cast<std::uint32_t>(triangles_.size())}};
  while (!open.empty()) {
    const Range range = open.back();
    open.pop_back();
    Box box, centroids;
    const auto begin = triangles_.begin() + range.first, end = begin + range.count;
    for (auto t = begin; t != end; ++t) {
      for (const Vec3& c : t->corner) box.add(c);
      centroids.add((t->corner[0] + t->corner[1] + t->corner[2]) / 3.0);
    }
    nodes_[range.node].box = box;
    if (range.count <= kLeafTriangles) {
      nodes_[range.node].first = range.first;
      nodes_[range.node].count = range.count;
      continue;
    }
    const Vec3 size = centroids.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t half = range.count / 2;
    std::nth_element(begin, begin + half, end, [axis](const Triangle& a, const Triangle& b) {
      return a.corner[0][axis] + a.corner[1][axis] + a.corner[2][axis] <
             b.corner[0][axis] + b.corner[1][axis] + b.corner[2][axis];
    });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[range.node].first = child;
    nodes_.resize(nodes_.size() + 2);
    open.push_back({child, range.first, half});
    open.push_back({child + 1, range.first + half, range.count - half});
  }
}

// Calls visit(triangle) for the triangles of every leaf the segment comes near to; visit returns
// the parameter up to which the segment is still of interest, negative to stop.
template <class Visit>
void RayOracle::traverse(const Segment& segment, double margin, Visit&& visit) const {
  if (triangles_.empty()) return;
  const Vec3 inverse = inverse_of(segment.to - segment.from);
  std::array<std::uint32_t, kMaxStack> stack;
  int depth = 0;
  double t_max = 1;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!meets(node.box, segment.from, inverse, margin, t_max)) continue;
    if (node.count == 0) {
      PVS_CHECK_LT(depth + 2, kMaxStack);
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      t_max = visit(triangles_[node.first + i]);
      if (t_max < 0) return;
    }
  }
}

std::optional<RayOracle::Hit> RayOracle::first_hit(const Segment& segment) const {
  std::optional<Hit> best;
  const Vec3 d = segment.to - segment.from;
  traverse(segment, 0, [&](const Triangle& t) {
    const double t_max = best ? best->t : 1;
    const double slope = dot(t.normal, d);
    if (slope == 0 || (!t.two_sided && slope > 0)) return t_max;
    const double at = dot(t.normal, t.corner[0] - segment.from) / slope;
    if (!(at >= 0 && at <= t_max)) return t_max;
    const Vec3 p = segment.from + d * at;
    for (int k = 0; k < 3; ++k)
      if (dot(t.edge_outward[k], p - t.corner[k]) > 0) return t_max;
    best = Hit{at, t.object, t.index};
    return at;
  });
  return best;
}

// The triangle thickened by `margin` is the slab around its plane, cut by its three edges moved
// outwards; it holds every point within `margin` of the triangle.
bool RayOracle::within(const Triangle& t, const Segment& segment, double margin) {
  // A segment in the triangle's own plane may pass beside it and yet be inside of each edge with
  // one of its ends: at least their boxes must come near.
  for (int axis = 0; axis < 3; ++axis) {
    const auto [lo, hi] = std::minmax({t.corner[0][axis], t.corner[1][axis], t.corner[2][axis]});
    if (std::min(segment.from[axis], segment.to[axis]) > hi + margin ||
        std::max(segment.from[axis], segment.to[axis]) < lo - margin)
      return false;
  }
  const double a = dot(t.normal, segment.from - t.corner[0]);
  const double b = dot(t.normal, segment.to - t.corner[0]);
  if ((a > margin && b > margin) || (a < -margin && b < -margin)) return false;
  if (!t.two_sided && b - a > margin) return false;
  // The part of the segment inside the slab.
  double t0 = 0, t1 = 1;
  if (std::abs(b - a) > 0) {
    const double p = (-margin - a) / (b - a), q = (margin - a) / (b - a);
    t0 = std::max(t0, std::min(p, q));
    t1 = std::min(t1, std::max(p, q));
  }
  const Vec3 d = segment.to - segment.from;
  const Vec3 p0 = segment.from + d * t0, p1 = segment.from + d * t1;
  for (int k = 0; k < 3; ++k)
    if (dot(t.edge_outward[k], p0 - t.corner[k]) > margin &&
        dot(t.edge_outward[k], p1 - t.corner[k]) > margin)
      return false;
  return true;
}

std::optional<RayOracle::Hit> RayOracle::blocker(const Segment& segment, double margin,
                                                 std::uint32_t ignored) const {
  std::optional<Hit> found;
  traverse(segment, margin, [&](const Triangle& t) -> double {
    if (t.object == ignored || !within(t, segment, margin)) return 1;
    found = Hit{0, t.object, t.index};
    return -1;
  });
  return found;
}

bool RayOracle::not_behind(const Corners& end, const Triangle& t, const Vec3& eye, double margin) {
  const double eye_height = dot(t.normal, eye - t.corner[0]);
  if (std::abs(eye_height) <= margin) return false;
  return std::all_of(end.begin(), end.end(), [&](const Vec3& corner) {
    const double height = dot(t.normal, corner - t.corner[0]);
    return (eye_height > 0 ? height : -height) > -1e-3 * margin;
  });
}

std::optional<RayOracle::Hit> RayOracle::blocker_before(const Segment& segment, double margin,
                                                        std::uint32_t position,
                                                        const SourceObject& target) const {
  // The triangles that it may end on.
  std::vector<Corners> ends;
  for (const auto& t : target.triangles) {
    const Corners c{target.vertices[t[0]], target.vertices[t[1]], target.vertices[t[2]]};
    const Vec3 normal = cross(c[1] - c[0], c[2] - c[0]);
    bool over = std::abs(dot(normal, segment.to - c[0])) <= margin * length(normal);
    for (int k = 0; k < 3; ++k)
      over = over && dot(cross(c[(k + 1) % 3] - c[k], normal), segment.to - c[k]) <= 0;
    if (over) ends.push_back(c);
  }
  std::optional<Hit> found;
  traverse(segment, margin, [&](const Triangle& t) -> double {
    if (t.object == position || !within(t, segment, margin)) return 1;
    for (const Corners& end : ends)
      if (not_behind(end, t, segment.from, margin)) return 1;
    found = Hit{0, t.object, t.index};
    return -1;
  });
  return found;
}

double RayOracle::margin_for(const Box& viewpoints) const {
  Box all = bounds_;
  all.add(viewpoints);
  const Vec3 size = all.size();
  double largest = 0;
  for (int k = 0; k < 8; ++k) largest = std::max(largest, length(all.corner(k)));
  return 1e-9 * length(size) + 16 * 0x1p-53 * largest;
}

}  // namespace pvsfarm
