#include "worker/visibility/slice_solids.hpp"

#include <algorithm>
#include <compare>
#include <limits>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kBlockTriangles = 32;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

std::uint32_t edge_of(std::int32_t use) {
  return static_cast<std::uint32_t>(use >= 0 ? use : ~use);
}

// Where the triangle lies along a curve through the scene, so that blocks are compact.
std::uint32_t place_of(const Scene& scene, const SurfaceTriangle& triangle) {
  constexpr std::uint32_t kSteps = 1024;
  const auto vertices = scene.surface_vertices();
  const Vec3 middle =
      (vertices[triangle.vertex[0]] + vertices[triangle.vertex[1]] + vertices[triangle.vertex[2]]) /
      3.0;
  const Vec3 lo = scene.bounds().lo, size = scene.bounds().size();
  std::uint32_t place = 0;
  for (int a = 0; a < 3; ++a) {
    if (!(size[a] > 0)) continue;
    const double share = std::clamp((middle[a] - lo[a]) / size[a], 0.0, 1.0);
    const auto step = std::min(static_cast<std::uint32_t>(share * kSteps), kSteps - 1);
    for (int bit = 0; bit < 10; ++bit) place |= ((step >> bit) & 1u) << (3 * bit + a);
  }
  return place;
}

// Finds the solids: takes away what dangles, turns neighbours alike, keeps what cancels.
class SolidFinder {
 public:
  SolidFinder(const Scene& scene, SolidRule rule)
      : scene_(scene), triangles_(scene.surface_triangles()), around_(occludee_bounds(scene)) {
    if (rule == SolidRule::kStanding) allow_borders();
    find_uses(rule == SolidRule::kStanding);
    take_away_what_dangles();
    join_parts();
    turn_alike();
    find_faults();
  }

  bool in_solid(std::uint32_t t) const { return alive_[t] != 0 && faulty_[root_of_[t]] == 0; }
  std::uint32_t part(std::uint32_t t) const { return root_of_[t]; }
  std::int32_t turn(std::uint32_t t) const { return turn_[t]; }
  bool on_ground(std::uint32_t part) const { return (allowed_in_[part] & kGround) != 0; }
  bool at_sides(std::uint32_t part) const { return (allowed_in_[part] & kSide) != 0; }

 private:
  static constexpr std::uint8_t kGround = 1, kSide = 2;

  // Which edges may be border: both ends at or beyond one side of all that may be seen.
  void allow_borders() {
    allowed_.resize(scene_.surface_edges().size());
    const bool flat = !(around_.lo.x < around_.hi.x && around_.lo.y < around_.hi.y);
    for (std::size_t e = 0; e < allowed_.size(); ++e) {
      const SurfaceEdge& edge = scene_.surface_edges()[e];
      const Vec3 &p = scene_.surface_vertices()[edge.vertex[0]],
                 &q = scene_.surface_vertices()[edge.vertex[1]];
      if (p.z <= scene_.ground() && q.z <= scene_.ground()) allowed_[e] = kGround;
      for (int a = 0; a < 2 && !flat && allowed_[e] == 0; ++a)
        if ((p[a] <= around_.lo[a] && q[a] <= around_.lo[a]) ||
            (p[a] >= around_.hi[a] && q[a] >= around_.hi[a]))
          allowed_[e] = kSide;
    }
  }

  bool below_ground(const SurfaceTriangle& t) const {
    for (const std::uint32_t v : t.vertex)
      if (scene_.surface_vertices()[v].z > scene_.ground()) return false;
    return true;
  }

  // The triangles of each edge, one list after the other.
  void find_uses(bool without_ground) {
    alive_.assign(triangles_.size(), 1);
    first_use_.assign(scene_.surface_edges().size() + 1, 0);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (without_ground && below_ground(triangles_[t])) alive_[t] = 0;
      if (alive_[t] == 0) continue;
      for (const std::int32_t use : triangles_[t].edge) ++first_use_[edge_of(use) + 1];
    }
    for (std::size_t e = 1; e < first_use_.size(); ++e) first_use_[e] += first_use_[e - 1];
    uses_.resize(first_use_.back());
    std::vector<std::uint32_t> next(first_use_.begin(), first_use_.end() - 1);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (alive_[t] != 0)
        for (const std::int32_t use : triangles_[t].edge) uses_[next[edge_of(use)]++] = t;
  }
  std::span<const std::uint32_t> uses(std::uint32_t edge) const {
    return std::span(uses_).subspan(first_use_[edge], first_use_[edge + 1] - first_use_[edge]);
  }
  std::uint8_t allowed(std::uint32_t edge) const { return allowed_.empty() ? 0 : allowed_[edge]; }

  // A triangle with an edge of its own is in no solid; without it, its neighbours may be in none.
  void take_away_what_dangles() {
    std::vector<std::uint32_t> left(first_use_.size() - 1), loose;
    for (std::uint32_t e = 0; e < left.size(); ++e) {
      left[e] = static_cast<std::uint32_t>(uses(e).size());
      if (left[e] == 1 && allowed(e) == 0) loose.push_back(e);
    }
    while (!loose.empty()) {
      const std::uint32_t edge = loose.back();
      loose.pop_back();
      for (const std::uint32_t t : uses(edge)) {
        if (alive_[t] == 0) continue;
        alive_[t] = 0;
        for (const std::int32_t use : triangles_[t].edge) {
          const std::uint32_t e = edge_of(use);
          if (--left[e] == 1 && allowed(e) == 0) loose.push_back(e);
        }
      }
    }
  }

  std::uint32_t root(std::uint32_t t) {
    while (root_of_[t] != t) t = root_of_[t] = root_of_[root_of_[t]];
    return t;
  }
  void join_parts() {
    root_of_.resize(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) root_of_[t] = t;
    for (std::uint32_t e = 0; e + 1 < first_use_.size(); ++e) {
      std::uint32_t first = kNone;
      for (const std::uint32_t t : uses(e)) {
        if (alive_[t] == 0) continue;
        if (first == kNone) first = t;
        const std::uint32_t a = root(first), b = root(t);
        root_of_[std::max(a, b)] = std::min(a, b);
      }
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) root_of_[t] = root(t);
  }

  static int along(const SurfaceTriangle& t, std::uint32_t edge) {
    for (const std::int32_t use : t.edge)
      if (edge_of(use) == edge) return use >= 0 ? 1 : -1;
    return 0;
  }

  // Over edges with two triangles. One-sided ones have the front they have.
  void turn_alike() {
    turn_.assign(triangles_.size(), 0);
    std::vector<std::uint32_t> to_visit;
    const auto spread = [&] {
      while (!to_visit.empty()) {
        const std::uint32_t t = to_visit.back();
        to_visit.pop_back();
        for (const std::int32_t use : triangles_[t].edge) {
          const std::uint32_t e = edge_of(use);
          std::uint32_t other = kNone, count = 0;
          for (const std::uint32_t u : uses(e))
            if (alive_[u] != 0) {
              ++count;
              if (u != t) other = u;
            }
          if (count != 2 || other == kNone || turn_[other] != 0) continue;
          turn_[other] = -turn_[t] * along(triangles_[t], e) * along(triangles_[other], e);
          to_visit.push_back(other);
        }
      }
    };
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (alive_[t] != 0 && triangles_[t].one_sided != 0) turn_[t] = 1, to_visit.push_back(t);
    spread();
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (alive_[t] != 0 && turn_[t] == 0) {
        turn_[t] = 1;
        to_visit.push_back(t);
        spread();
      }
  }

  // Parts with an edge that does not cancel and may be no border.
  void find_faults() {
    faulty_.assign(triangles_.size(), 0);
    allowed_in_.assign(triangles_.size(), 0);
    for (std::uint32_t e = 0; e + 1 < first_use_.size(); ++e) {
      int sum = 0;
      std::uint32_t part = kNone;
      for (const std::uint32_t t : uses(e)) {
        if (alive_[t] == 0) continue;
        part = root_of_[t];
        sum += turn_[t] * along(triangles_[t], e);
      }
      if (sum == 0) continue;
      if (allowed(e) == 0) faulty_[part] = 1;
      allowed_in_[part] |= allowed(e);
    }
  }

  const Scene& scene_;
  std::span<const SurfaceTriangle> triangles_;
  Box around_;
  std::vector<std::uint8_t> allowed_;  // of an edge; empty: none
  std::vector<std::uint8_t> alive_;    // of a triangle
  std::vector<std::uint32_t> first_use_, uses_;
  std::vector<std::uint32_t> root_of_;  // of a triangle: the lowest one of its part
  std::vector<std::int32_t> turn_;
  std::vector<std::uint8_t> faulty_, allowed_in_;  // of a part, at its root
};

}  // namespace

SliceSolids::SliceSolids(const Scene& scene, SolidRule rule) {
  const SolidFinder finder(scene, rule);
  const auto all = scene.surface_triangles();
  struct Placed {
    std::uint32_t part, place, triangle;
    auto operator<=>(const Placed&) const = default;
  };
  std::vector<Placed> placed;
  for (std::uint32_t t = 0; t < all.size(); ++t)
    if (finder.in_solid(t)) placed.push_back({finder.part(t), place_of(scene, all[t]), t});
  std::sort(placed.begin(), placed.end());
  for (const auto& [part, place, t] : placed) {
    const bool begins = triangles_.empty() || finder.part(triangles_.back().index) != part;
    if (begins) {
      solids_.push_back({.first_block = static_cast<std::uint32_t>(blocks_.size()),
                         .on_ground = finder.on_ground(part),
                         .at_sides = finder.at_sides(part)});
    }
    SliceSolid& solid = solids_.back();
    if (begins || blocks_.back().count == kBlockTriangles) {
      blocks_.push_back({.first = static_cast<std::uint32_t>(triangles_.size())});
      ++solid.block_count;
    }
    SliceBlock& block = blocks_.back();
    for (const std::uint32_t v : all[t].vertex) {
      block.box.add(scene.surface_vertices()[v]);
      solid.box.add(scene.surface_vertices()[v]);
    }
    solid.two_sided = solid.two_sided && all[t].one_sided == 0;
    triangles_.push_back({t, finder.turn(t)});
    ++block.count;
  }
}

Box occludee_bounds(const Scene& scene) {
  Box box;
  for (const ObjectRecord& object : scene.objects())
    if (object.occludee != 0) box.add(object.box);
  return box;
}

}  // namespace pvsfarm
