#include "worker/visibility/shaft_cover.hpp"

#include <algorithm>
#include <cmath>

#include "worker/visibility/cell_clearance.hpp"
#include "worker/visibility/segment_crossing.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMostActive = 4096;  // in a shaft that is searched

double size_of(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

}  // namespace

unsigned within_faces(const Box& world, const Cell& cell) {
  if (!has_world_coordinates(cell)) return 0;
  unsigned bits = 0;
  for (int a = 0; a < 3; ++a) {
    if (!(cell.lo[a] < cell.hi[a])) continue;
    bits |= (world.lo[a] >= cell.lo[a] ? 1u : 0u) << (2 * a);
    bits |= (world.hi[a] <= cell.hi[a] ? 1u : 0u) << (2 * a + 1);
  }
  return bits;
}

ShaftCover::Candidates ShaftCover::begin(const CellFrame& frame, const SurfaceChain& chain,
                                         double reach) {
  chain_ = &chain;
  work_ = 0;
  double largest = reach;
  for (const Vec3& p : chain.vertices) largest = std::max(largest, size_of(p));
  scale_ = frame.offset_scale() + 3 * largest + size_of(frame.half());
  margin_ = 0x1p-40 * scale_;
  planes_.clear();
  boxes_.clear();
  for (const ChainTriangle& triangle : chain.triangles) {
    const Vec3 &a = chain.vertices[triangle.vertex[0]], &b = chain.vertices[triangle.vertex[1]],
               &c = chain.vertices[triangle.vertex[2]];
    const Vec3 normal = cross(b - a, c - a);
    const double sides = size_of(b - a) + size_of(c - a);
    planes_.push_back({normal, dot(normal, a), 0x1p-42 * scale_ * sides * scale_});
    Box box;
    for (const Vec3* p : {&a, &b, &c}) box.add(*p);
    boxes_.push_back({box.lo - Vec3(margin_), box.hi + Vec3(margin_)});
  }
  finder_.begin(chain);
  edges_.clear();
  for (auto& column : ends_) column.clear();
  for (std::uint32_t e = 0; e < chain.edges.size(); ++e) push_edge(e);
  triangles_.clear();
  for (std::uint32_t t = 0; t < chain.triangles.size(); ++t) triangles_.push_back({.triangle = t});
  return {0, edges_.size(), 0, triangles_.size()};
}

void ShaftCover::drop_above(const Candidates& candidates) {
  edges_.resize(candidates.last_edge);
  for (auto& column : ends_) column.resize(candidates.last_edge);
  triangles_.resize(candidates.last_triangle);
}

bool ShaftCover::keeps_off(const Box& box, std::uint32_t triangle) const {
  if (!boxes_[triangle].meets(box)) return true;
  const Plane& plane = planes_[triangle];
  const Vec3 half = box.size() * 0.5;
  const double reach = std::abs(plane.normal.x) * half.x + std::abs(plane.normal.y) * half.y +
                       std::abs(plane.normal.z) * half.z;
  return std::abs(dot(plane.normal, box.center()) - plane.offset) > reach + plane.error;
}

bool ShaftCover::in_front(const Box& box, std::uint32_t triangle) const {
  const Plane& plane = planes_[triangle];
  const Vec3 half = box.size() * 0.5;
  const double reach = std::abs(plane.normal.x) * half.x + std::abs(plane.normal.y) * half.y +
                       std::abs(plane.normal.z) * half.z;
  return dot(plane.normal, box.center()) - plane.offset > reach + plane.error;
}

// No eye and no point of the matter is on it, and it blocks for all eyes.
bool ShaftCover::usable(const Ends& ends, std::uint32_t t) const {
  const ChainTriangle& triangle = chain_->triangles[t];
  if (!triangle.for_all && !(triangle.one_sided ? in_front(ends.eyes, t) : keeps_off(ends.eyes, t)))
    return false;
  return keeps_off(ends.matter, t);
}

void ShaftCover::push_edge(std::uint32_t edge) {
  edges_.push_back(edge);
  for (int k = 0; k < 6; ++k)
    ends_[k].push_back(chain_->vertices[chain_->edges[edge].vertex[k / 3]][k % 3]);
}

void ShaftCover::find_met(const Ends& ends, const Candidates& among) {
  const Shaft shaft(ends.eyes, ends.matter, margin_);
  const std::size_t first = among.first_edge, count = among.last_edge - first;
  work_ += count;
  beyond_.resize(std::max(beyond_.size(), count));
  std::array<const double*, 6> columns;
  for (int k = 0; k < 6; ++k) columns[k] = ends_[k].data() + first;
  shaft.find_beyond(columns, count, beyond_.data());
  for (std::size_t i = 0; i < count; ++i) {
    if (beyond_[i] != 0) continue;
    const std::uint32_t e = edges_[first + i];
    const ChainEdge& edge = chain_->edges[e];
    // Eyes inside the cell and matter within its face: at an edge beyond the face lines may end,
    // at most.
    const unsigned beyond = chain_->beyond[edge.vertex[0]] & chain_->beyond[edge.vertex[1]];
    if ((beyond & (ends.within | kBelowGround)) != 0) continue;
    if (shaft.misses(chain_->vertices[edge.vertex[0]], chain_->vertices[edge.vertex[1]])) continue;
    finder_.meet(e);
    push_edge(e);
  }
}

ShaftAnswer ShaftCover::ask(const Ends& ends, Candidates& candidates) {
  finder_.next();
  Candidates own{edges_.size(), 0, triangles_.size(), 0};
  find_met(ends, candidates);
  own.last_edge = edges_.size();
  bool hidden = false;
  for (std::size_t i = candidates.first_triangle; i < candidates.last_triangle && !hidden; ++i) {
    const std::uint32_t t = triangles_[i].triangle;
    bool active = false;
    for (const std::uint32_t e : chain_->triangles[t].edge) active = active || finder_.met(e);
    const bool usable = this->usable(ends, t);
    if (!active && usable) {
      hidden = crossing(ends, t).value_or(false);
      continue;
    }
    const auto at = static_cast<std::uint32_t>(triangles_.size() - own.first_triangle);
    triangles_.push_back({.triangle = t, .parent = at, .cut = !usable});
  }
  own.last_triangle = triangles_.size();
  candidates = own;
  return hidden ? ShaftAnswer::kHidden : search(ends, own);
}

std::optional<bool> ShaftCover::crossing(const Ends& ends, std::uint32_t t) const {
  const Box& box = boxes_[t];
  for (int a = 0; a < 3; ++a)
    if (std::max(ends.eye[a], ends.target[a]) < box.lo[a] ||
        std::min(ends.eye[a], ends.target[a]) > box.hi[a])
      return false;
  const auto& v = chain_->triangles[t].vertex;
  return crosses_triangle(ends.eye, ends.target,
                          {chain_->vertices[v[0]], chain_->vertices[v[1]], chain_->vertices[v[2]]},
                          scale_);
}

ShaftAnswer ShaftCover::search(const Ends& ends, const Candidates& own) {
  const std::span all = std::span(triangles_).subspan(own.first_triangle);
  if (all.size() > kMostActive) return ShaftAnswer::kUnknown;
  active_.assign(all.begin(), all.end());
  crossings_.clear();
  bool crossed = false, clear = true;
  for (const SheetFinder::Active& active : active_) {
    const auto own_crossing = crossing(ends, active.triangle);
    crossings_.push_back(own_crossing);
    crossed = crossed || own_crossing.value_or(false);
    // What coincides with the target does not block it.
    clear = clear && !own_crossing.value_or(!active.cut);
  }
  if (clear) return ShaftAnswer::kClear;
  if (!crossed) return ShaftAnswer::kUnknown;
  bool hidden = false;
  finder_.find(
      std::span(active_), [&](std::size_t i) { return crossings_[i]; },
      [](std::size_t) { return 0.0f; }, [&](float) { hidden = true; });
  return hidden ? ShaftAnswer::kHidden : ShaftAnswer::kUnknown;
}

}  // namespace pvsfarm
