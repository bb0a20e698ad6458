#include "common/scene/coplanar_faces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace pvsfarm {
namespace {

constexpr double kMaxFlatness = 1e-6;    // of the polygon's size
constexpr double kMaxReflexSine = 1e-6;  // of a corner that counts as straight
constexpr double kSameFacingCosine = 0.99999;
constexpr double kRounding = 0x1p-49;
constexpr std::size_t kMaxLoop = 1024;  // vertices of a loop, collinear ones included

struct Region {
  std::vector<std::uint32_t> loop;     // counter-clockwise seen from the front
  std::vector<std::uint32_t> members;  // every vertex of its triangles
  Vec3 area{0.0};                      // normal times twice the area
  bool alive = true;
};

std::uint64_t directed(std::uint32_t a, std::uint32_t b) { return std::uint64_t{a} << 32 | b; }

class Merger {
 public:
  Merger(const Mesh& mesh, std::span<const MeshTriangle> triangles) : mesh_(mesh) {
    for (const MeshTriangle& t : triangles) {
      const Vec3 area = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      if (area == Vec3(0.0)) continue;
      Region region;
      region.loop = region.members = {t.begin(), t.end()};
      region.area = area;
      regions_.push_back(std::move(region));
    }
    for (std::uint32_t r = 0; r < regions_.size(); ++r) add_edges(r);
  }

  std::vector<FlatPolygon> merge() {
    const std::vector<std::pair<std::uint32_t, std::uint32_t>> edges = shared_edges();
    for (bool merged = true; merged;) {
      merged = false;
      for (const auto& [a, b] : edges) merged = merge_across(a, b) || merged;
    }
    std::vector<FlatPolygon> polygons;
    for (const Region& region : regions_) {
      if (!region.alive) continue;
      FlatPolygon polygon = polygon_of(region);
      // A needle may have some area by rounding, and a corner without any turn.
      if (polygon.points.size() >= 3) polygons.push_back(std::move(polygon));
    }
    return polygons;
  }

 private:
  const Vec3& at(std::uint32_t v) const { return mesh_.vertices[v]; }

  void add_edges(std::uint32_t r) {
    const std::vector<std::uint32_t>& loop = regions_[r].loop;
    for (std::size_t i = 0; i < loop.size(); ++i)
      by_edge_.emplace(directed(loop[i], loop[(i + 1) % loop.size()]), r);
  }
  void remove_edges(std::uint32_t r) {
    const std::vector<std::uint32_t>& loop = regions_[r].loop;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      auto [it, end] = by_edge_.equal_range(directed(loop[i], loop[(i + 1) % loop.size()]));
      while (it != end && it->second != r) ++it;
      if (it != end) by_edge_.erase(it);
    }
  }
  // Regions along the directed edge, ascending.
  std::vector<std::uint32_t> regions_at(std::uint32_t a, std::uint32_t b) const {
    std::vector<std::uint32_t> found;
    for (auto [it, end] = by_edge_.equal_range(directed(a, b)); it != end; ++it)
      found.push_back(it->second);
    std::sort(found.begin(), found.end());
    return found;
  }

  // Edges with a region on both sides, longest first.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> shared_edges() const {
    std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> edges;
    for (const Region& region : regions_)
      for (std::size_t i = 0; i < region.loop.size(); ++i) {
        const std::uint32_t a = region.loop[i], b = region.loop[(i + 1) % region.loop.size()];
        if (a < b && by_edge_.count(directed(b, a)) > 0)
          edges.emplace_back(-length(at(b) - at(a)), a, b);
      }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ordered;
    for (const auto& [key, a, b] : edges) ordered.emplace_back(a, b);
    return ordered;
  }

  bool merge_across(std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t p : regions_at(a, b))
      for (const std::uint32_t q : regions_at(b, a)) {
        std::optional<Region> joined = join(regions_[p], regions_[q], a, b);
        if (!joined) continue;
        remove_edges(p);
        remove_edges(q);
        regions_[q].alive = false;
        regions_[q].members.clear();
        regions_[p] = std::move(*joined);
        add_edges(p);
        return true;
      }
    return false;
  }

  // The union, if its boundary is one convex loop and it is flat. `p` runs a to b, `q` b to a.
  std::optional<Region> join(const Region& p, const Region& q, std::uint32_t a,
                             std::uint32_t b) const {
    if (&p == &q || dot(p.area, q.area) < kSameFacingCosine * length(p.area) * length(q.area))
      return std::nullopt;
    // Turn both loops to start behind the common chain around a..b, as long as it reaches.
    std::vector<std::uint32_t> from_b = p.loop, from_a = q.loop;
    std::rotate(from_b.begin(), std::find(from_b.begin(), from_b.end(), b), from_b.end());
    std::rotate(from_a.begin(), std::find(from_a.begin(), from_a.end(), a), from_a.end());
    // p: b .. a, then the edge to b. q: a .. b, then the edge to a.
    while (from_b.size() > 1 && from_a.size() > 1 && from_b[1] == from_a[from_a.size() - 2]) {
      from_b.erase(from_b.begin());  // the chain goes on beyond b
      from_a.pop_back();
    }
    while (from_b.size() > 1 && from_a.size() > 1 && from_a[1] == from_b[from_b.size() - 2]) {
      from_a.erase(from_a.begin());  // and before a
      from_b.pop_back();
    }
    if (from_b.size() < 2 || from_a.size() < 2) return std::nullopt;
    Region joined;
    joined.area = p.area + q.area;
    joined.loop = from_b;
    joined.loop.insert(joined.loop.end(), from_a.begin() + 1, from_a.end() - 1);
    const std::uint32_t seam[2] = {from_b.front(), from_b.back()};
    if (!is_simple(joined.loop) || !is_convex_at(joined, seam[0]) || !is_convex_at(joined, seam[1]))
      return std::nullopt;
    joined.members = p.members;
    joined.members.insert(joined.members.end(), q.members.begin(), q.members.end());
    std::sort(joined.members.begin(), joined.members.end());
    joined.members.erase(std::unique(joined.members.begin(), joined.members.end()),
                         joined.members.end());
    if (flatness_of(joined) > kMaxFlatness * size_of(joined)) return std::nullopt;
    return joined;
  }

  bool is_simple(const std::vector<std::uint32_t>& loop) const {
    if (loop.size() < 3 || loop.size() > kMaxLoop) return false;
    std::size_t corners = 0;
    for (std::size_t i = 0; i < loop.size(); ++i)
      if (!is_collinear(loop, i)) ++corners;
    std::vector<std::uint32_t> sorted(loop);
    std::sort(sorted.begin(), sorted.end());
    return corners >= 3 && corners <= kMaxPolygonPoints &&
           std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  }

  bool is_collinear(const std::vector<std::uint32_t>& loop, std::size_t i) const {
    const Vec3 in = at(loop[i]) - at(loop[(i + loop.size() - 1) % loop.size()]);
    const Vec3 out = at(loop[(i + 1) % loop.size()]) - at(loop[i]);
    return cross(in, out) == Vec3(0.0) && dot(in, out) > 0;
  }

  bool is_convex_at(const Region& region, std::uint32_t v) const {
    const std::vector<std::uint32_t>& loop = region.loop;
    const auto i = static_cast<std::size_t>(std::find(loop.begin(), loop.end(), v) - loop.begin());
    const Vec3 in = at(v) - at(loop[(i + loop.size() - 1) % loop.size()]);
    const Vec3 out = at(loop[(i + 1) % loop.size()]) - at(v);
    const double sine =
        dot(cross(in, out), region.area) / (length(in) * length(out) * length(region.area));
    return sine >= -kMaxReflexSine && (sine > kMaxReflexSine || dot(in, out) > 0);
  }

  double size_of(const Region& region) const {
    double size = 0;
    for (const std::uint32_t v : region.loop)
      size = std::max(size, length(at(v) - at(region.loop[0])));
    return size;
  }

  // Half the thickness along the mean normal.
  double flatness_of(const Region& region) const {
    const Vec3 normal = region.area / length(region.area), origin = at(region.loop[0]);
    double low = 0, high = 0, reach = 0;
    for (const std::uint32_t v : region.members) {
      const double height = dot(normal, at(v) - origin);
      low = std::min(low, height);
      high = std::max(high, height);
      reach = std::max(reach, length(at(v) - origin));
    }
    const bool on_axis = (normal.x != 0) + (normal.y != 0) + (normal.z != 0) == 1;
    if (low == high && on_axis) return 0;  // nothing was rounded
    return (high - low) / 2 + kRounding * reach;
  }

  FlatPolygon polygon_of(const Region& region) const {
    FlatPolygon polygon;
    for (std::size_t i = 0; i < region.loop.size(); ++i)
      if (!is_collinear(region.loop, i)) polygon.points.push_back(at(region.loop[i]));
    polygon.flatness = region.members.size() == 3 ? 0 : flatness_of(region);
    return polygon;
  }

  const Mesh& mesh_;
  std::vector<Region> regions_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> by_edge_;
};

}  // namespace

std::vector<FlatPolygon> merge_coplanar(const Mesh& mesh, std::span<const MeshTriangle> triangles) {
  return Merger(mesh, triangles).merge();
}

}  // namespace pvsfarm
