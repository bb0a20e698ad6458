#include "tests/support/aimed_rays.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

constexpr int kTargetsPerEscape = 4;
constexpr int kEscapesPerBlockedRay = 2;

struct Interval {
  double lo, hi;
};

// The parameters t in `range` for which from + t d lies in [lo, hi].
std::optional<Interval> inside(const Vec3& from, const Vec3& d, const Vec3& lo, const Vec3& hi,
                               Interval range) {
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (from[a] < lo[a] || from[a] > hi[a]) return {};
      continue;
    }
    const double p = (lo[a] - from[a]) / d[a], q = (hi[a] - from[a]) / d[a];
    range.lo = std::max(range.lo, std::min(p, q));
    range.hi = std::min(range.hi, std::max(p, q));
  }
  if (!(range.lo <= range.hi)) return {};
  return range;
}

Vec3 clamped(const Vec3& p, const Vec3& lo, const Vec3& hi) {
  Vec3 r;
  for (int a = 0; a < 3; ++a) r[a] = std::clamp(p[a], lo[a], hi[a]);
  return r;
}

// `p` in the coordinates of the cell's axes.
Vec3 cell_from_world(const Cell& cell, const Vec3& p) {
  const Vec3 d = p - cell.origin;
  return {dot(d, cell.axes[0]), dot(d, cell.axes[1]), dot(d, cell.axes[2])};
}

// A point of [lo, hi]: each coordinate at an end, or anywhere.
Vec3 sample_box(const Vec3& lo, const Vec3& hi, int ends, Random& random) {
  Vec3 p;
  const int first = static_cast<int>(random.below(3));
  for (int k = 0; k < 3; ++k) {
    const int a = (first + k) % 3;
    p[a] = k < ends ? (random.next() & 1 ? hi[a] : lo[a])
                    : std::clamp(random.between(lo[a], hi[a]), lo[a], hi[a]);
  }
  return p;
}

// Where a ray counts as one that sees an object: the box of one of its triangles, in the frame of
// the cell; or all of the box of what moves.
struct Target {
  Box box;       // in the world, around
  Box in_frame;  // empty: all of `box`

  bool counts(const Cell& cell, const Vec3& point) const {
    return in_frame.empty() || in_frame.contains(cell_from_world(cell, point));
  }
};

Target pick_target(const SourceObject& object, const Box& box, const Cell& cell, Random& random) {
  if (object.dynamic || object.triangles.empty()) return {box, {}};
  const bool turned = cell.axes != Cell{}.axes;
  Target target;
  for (const std::uint32_t vertex : object.triangles[random.below(object.triangles.size())]) {
    target.box.add(object.vertices[vertex]);
    if (turned) target.in_frame.add(cell_from_world(cell, object.vertices[vertex]));
  }
  return target;
}

Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 d{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double n = length(d);
    if (n > 0.1 && n < 1) return d / n;
  }
}

}  // namespace

std::string to_string(const Violation& v) {
  char text[256];
  std::snprintf(text, sizeof text,
                "object %u is seen from (%.17g, %.17g, %.17g) at (%.17g, %.17g, %.17g)", v.object,
                v.witness.from.x, v.witness.from.y, v.witness.from.z, v.witness.to.x,
                v.witness.to.y, v.witness.to.z);
  return text;
}

Vec3 sample_cell(const Cell& cell, Random& random) {
  // 3 of 8 a corner, then an edge, a face, inside.
  constexpr int kEnds[8] = {3, 3, 3, 2, 2, 1, 0, 0};
  return cell.point(sample_box(cell.lo, cell.hi, kEnds[random.below(8)], random));
}

Vec3 sample_surface(const SourceObject& object, Random& random) {
  const auto& index = object.triangles[random.below(object.triangles.size())];
  const Vec3 a = object.vertices[index[0]], b = object.vertices[index[1]],
             c = object.vertices[index[2]];
  if (random.below(4) == 0) return a;
  double u = random.unit(), v = random.unit();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return a + (b - a) * u + (c - a) * v;
}

AimedRays::AimedRays(const SceneSource& source, const RayOracle& oracle)
    : source_(source), oracle_(oracle) {
  for (const SourceObject& object : source.objects) boxes_.push_back(box_of(object));
}

bool escape(const BlockedAim& aim, Random& random, Segment& segment) {
  const SourceObject& object = aim.blocker;
  const std::size_t pick = random.next() & 1 ? aim.triangle : random.below(object.triangles.size());
  const auto& index = object.triangles[pick];
  const std::size_t k = random.below(3);
  const Vec3 a = object.vertices[index[k]], b = object.vertices[index[(k + 1) % 3]];
  const double reach = length(b - a) * std::pow(10.0, -random.between(1, 8));
  const Vec3 beside = a + (b - a) * random.unit() + direction(random) * reach;

  const Vec3 from = aim.segment.from, ahead = beside - from;
  if (const auto hit = inside(from, ahead, aim.target.lo, aim.target.hi, {1, 1e6})) {
    const Vec3 p = from + ahead * random.between(hit->lo, hit->hi);
    segment = {from, clamped(p, aim.target.lo, aim.target.hi)};
    return true;
  }
  const Vec3 to = aim.segment.to;
  const Vec3 origin = cell_from_world(aim.cell, to);
  const Vec3 back = cell_from_world(aim.cell, beside) - origin;
  if (const auto hit = inside(origin, back, aim.cell.lo, aim.cell.hi, {1, 1e6})) {
    const Vec3 p = origin + back * random.between(hit->lo, hit->hi);
    segment = {aim.cell.point(clamped(p, aim.cell.lo, aim.cell.hi)), to};
    return true;
  }
  return false;
}

AimedReport AimedRays::search(const Cell& cell, std::span<const std::uint32_t> hidden,
                              std::uint64_t rays, Random& random) const {
  AimedReport report;
  if (hidden.empty()) return report;
  const double margin = oracle_.margin_for(cell.bounds());
  std::vector<char> refuted(source_.objects.size(), 0);
  const auto cast = [&](std::uint32_t object, const Segment& segment) {
    ++report.rays;
    const auto blocker = oracle_.blocker(segment, margin, object);
    if (!blocker && !refuted[object] && report.violations.size() < kMaxViolations) {
      refuted[object] = 1;
      report.violations.push_back({object, segment});
    }
    return blocker;
  };
  for (std::size_t turn = 0; report.rays < rays; ++turn) {
    const std::uint32_t object = hidden[turn % hidden.size()];
    const Target target = pick_target(source_.objects[object], boxes_[object], cell, random);
    const Box& box = target.box;
    Segment segment;
    segment.from = sample_cell(cell, random);
    const std::uint64_t kind = random.below(8);
    segment.to = kind < 3   ? box.corner(static_cast<int>(random.below(8)))
                 : kind < 5 ? sample_surface(source_.objects[object], random)
                            : sample_box(box.lo, box.hi, static_cast<int>(kind) - 5, random);
    if (!target.counts(cell, segment.to))
      segment.to = sample_surface(source_.objects[object], random);
    auto blocker = cast(object, segment);
    for (int k = 0; blocker && k < kEscapesPerBlockedRay; ++k) {
      // Whatever triangle of the object the new line comes by will do.
      for (int attempt = 0; blocker && attempt < kTargetsPerEscape; ++attempt) {
        const Target other = pick_target(source_.objects[object], boxes_[object], cell, random);
        const BlockedAim aim{cell, other.box, segment, source_.objects[blocker->object],
                             blocker->triangle};
        Segment past;
        if (!escape(aim, random, past) || !other.counts(cell, past.to)) continue;
        segment = past;
        blocker = cast(object, segment);
        break;
      }
    }
  }
  return report;
}

}  // namespace pvsfarm
