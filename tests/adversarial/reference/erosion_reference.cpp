#include "tests/adversarial/reference/erosion_reference.hpp"

#include <limits>

#include "common/base/check.hpp"

namespace pvsfarm::reference {
namespace {

// A direction to the right: y over x, x > 0.
struct Slope {
  std::int64_t y, x;
  friend bool operator<(const Slope& a, const Slope& b) {
    return static_cast<__int128>(a.y) * b.x < static_cast<__int128>(b.y) * a.x;
  }
};
struct Slopes {
  Slope lo, hi;
};

// The directions in which `from` meets the rectangle. Requires: it lies to the right.
Slopes seen_from(FlatPoint from, const Rect& rect) {
  const std::int64_t x0 = rect.lo.x - from.x, x1 = rect.hi.x - from.x;
  const std::int64_t y0 = rect.lo.y - from.y, y1 = rect.hi.y - from.y;
  return {{y0, y0 < 0 ? x0 : x1}, {y1, y1 > 0 ? x0 : x1}};
}

// Whether closed intervals cover a closed interval.
bool covered(const Slopes& target, std::vector<Slopes> by) {
  std::sort(by.begin(), by.end(), [](const Slopes& a, const Slopes& b) { return a.lo < b.lo; });
  Slope reached = target.lo;
  bool any = false;
  for (const Slopes& s : by) {
    if (reached < s.lo) break;
    if (s.hi < reached) continue;
    reached = s.hi;
    any = true;
  }
  return any && !(reached < target.hi);
}

// Whether walls, all of each before the target, hide it from a point.
bool hidden_from_point(FlatPoint eye, const Rect& target, const std::vector<Rect>& walls) {
  if (target.lo.x <= eye.x) return false;
  std::vector<Slopes> blocked;
  for (const Rect& wall : walls)
    if (!wall.empty() && wall.lo.x > eye.x && wall.hi.x < target.lo.x)
      blocked.push_back(seen_from(eye, wall));
  return covered(seen_from(eye, target), blocked);
}

// {v : v + X in wall}; for a rectangle, X may be replaced by its bounds.
Rect eroded(const Rect& wall, const Rect& x) { return {wall.lo - x.lo, wall.hi - x.hi}; }

// An R with object in R + X, X a rectangle.
Rect shrunk(const Rect& object, const Rect& x) {
  Rect r = eroded(object, x);
  const auto repair = [](std::int64_t& lo, std::int64_t& hi) {
    if (lo > hi) lo = hi = (lo + hi) / 2;
  };
  repair(r.lo.x, r.hi.x);
  repair(r.lo.y, r.hi.y);
  return r;
}

FlatPoint middle(const Rect& r) { return {(r.lo.x + r.hi.x) / 2, (r.lo.y + r.hi.y) / 2}; }

// Corners of a and of b on their common outer tangent, above (side = 1) or below (-1).
std::pair<FlatPoint, FlatPoint> tangent(const Rect& a, const Rect& b, int side) {
  for (const FlatPoint p : a.corners())
    for (const FlatPoint q : b.corners()) {
      bool supports = true;
      for (const Rect* rect : {&a, &b})
        for (const FlatPoint c : rect->corners()) supports &= side * turn(p, q, c) <= 0;
      if (supports) return {p, q};
    }
  PVS_CHECK(false);
}

Rect bounds(FlatPoint p, FlatPoint q) {
  return {{std::min(p.x, q.x), std::min(p.y, q.y)}, {std::max(p.x, q.x), std::max(p.y, q.y)}};
}

bool is_segment_along_an_axis(const Rect& r) { return r.lo.x == r.hi.x || r.lo.y == r.hi.y; }

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }  // b > 0

// Where segments between corners of cell and object cross the line along the cell's right side;
// rounded outwards to even numbers.
Rect gate_of(const ErosionScene& scene) {
  const std::int64_t line = scene.cell.hi.x;
  Rect gate{{line, scene.cell.lo.y}, {line, scene.cell.hi.y}};
  for (const FlatPoint v : scene.cell.corners())
    for (const FlatPoint m : scene.object.corners()) {
      const std::int64_t y = v.y + floor_div((line - v.x) * (m.y - v.y), m.x - v.x);
      gate.lo.y = std::min(gate.lo.y, 2 * floor_div(y, 2));
      gate.hi.y = std::max(gate.hi.y, 2 * floor_div(y + 2, 2));
    }
  return gate;
}

}  // namespace

bool hides_by_erosion(const ErosionScene& scene, Source source) {
  PVS_CHECK_LT(scene.cell.hi.x, scene.object.lo.x);
  FlatPoint eye = middle(scene.cell);
  Rect stands_for = scene.cell;
  bool is_rectangle = true;
  std::vector<Rect> walls = scene.walls;
  if (source == Source::kSupportingSegment) {
    stands_for = bounds(tangent(scene.cell, scene.object, 1).first,
                        tangent(scene.cell, scene.object, -1).first);
    is_rectangle = is_segment_along_an_axis(stands_for);
  } else if (source == Source::kGate) {
    stands_for = gate_of(scene);
    eye = middle(stands_for);
    std::erase_if(walls, [&](const Rect& wall) { return wall.lo.x <= scene.cell.hi.x; });
  }
  const Rect x{stands_for.lo - eye, stands_for.hi - eye};
  for (Rect& wall : walls) wall = eroded(wall, x);
  // A segment aslant shrinks nothing that is a rectangle; then the object is only moved.
  const FlatPoint move = middle(x);
  const Rect r =
      is_rectangle ? shrunk(scene.object, x) : Rect{scene.object.lo - move, scene.object.hi - move};
  return hidden_from_point(eye, r, walls);
}

bool hides_by_stencil(const ErosionScene& scene) {
  PVS_CHECK_EQ(scene.cell.lo.x, scene.cell.hi.x);
  const FlatPoint eye = middle(scene.cell);
  const Rect x{scene.cell.lo - eye, scene.cell.hi - eye};
  const Rect support = bounds(tangent(scene.cell, scene.object, 1).second,
                              tangent(scene.cell, scene.object, -1).second);
  Rect seen = eroded(support, x);
  if (support.lo.x != support.hi.x || seen.empty()) seen.lo = seen.hi = middle(support);
  std::vector<Rect> walls;
  for (const Rect& wall : scene.walls)
    if (wall.hi.x < scene.object.lo.x) walls.push_back(eroded(wall, x));
  return hidden_from_point(eye, seen, walls);
}

bool is_clear(const ErosionScene& scene, const FlatSegment& s) {
  for (const Rect& wall : scene.walls)
    if (meets(wall, s.from, s.to)) return false;
  return scene.cell.contains(s.from) && scene.object.contains(s.to);
}

bool find_witness(const ErosionScene& scene, FlatSegment& witness) {
  constexpr int kSteps = 8;
  const Rect &cell = scene.cell, &object = scene.object;
  const auto part = [](std::int64_t lo, std::int64_t hi, int k) {
    return lo + (hi - lo) * k / kSteps;
  };
  for (int i = 0; i < (kSteps + 1) * (kSteps + 1); ++i) {
    const FlatPoint from{part(cell.lo.x, cell.hi.x, i / (kSteps + 1)),
                         part(cell.lo.y, cell.hi.y, i % (kSteps + 1))};
    const auto try_at = [&](std::int64_t x, std::int64_t y) {
      witness = {from, {x, y}};
      return is_clear(scene, witness);
    };
    for (int k = 0; k <= kSteps; ++k)
      if (try_at(object.lo.x, part(object.lo.y, object.hi.y, k))) return true;
    for (const Rect& wall : scene.walls)
      for (const FlatPoint corner : wall.corners())
        for (const std::int64_t beside : {-1, 1}) {
          if (corner.x <= from.x) continue;
          const std::int64_t rise = corner.y + beside - from.y, run = corner.x - from.x;
          for (const std::int64_t x : {object.lo.x, object.hi.x})
            if (try_at(x, from.y + floor_div(rise * (x - from.x), run))) return true;
          if (rise == 0) continue;
          for (const std::int64_t y : {object.lo.y, object.hi.y})
            if (try_at(from.x + (y - from.y) * run / rise, y)) return true;
        }
  }
  return false;
}

}  // namespace pvsfarm::reference
