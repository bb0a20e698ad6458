#include "common/scene/surface_tears.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/geometry/collinear.hpp"
#include "common/scene/point_tree.hpp"

namespace pvsfarm {
namespace {

double largest_coordinate(const std::vector<Vec3>& vertices) {
  double largest = 0;
  for (const Vec3& p : vertices)
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return largest;
}

// A triangle with the edge from `a` to `b` to itself; a, b, apex is its order or the other way
// round.
struct Rim {
  std::uint32_t a, b, apex;
  int axis;  // of the plane: the axis its normal leans to
  int side;  // turn(a, b, apex, axis), not 0
};

class Mender {
 public:
  explicit Mender(SheetMesh& mesh)
      : mesh_(mesh),
        uses_(sorted_edge_uses(mesh.sheets)),
        open_(open_edges(uses_)),
        tree_(mesh.vertices, ends_of_edges(open_)),
        width_(kTearWidth * largest_coordinate(mesh.vertices)) {}

  // Whether anything was mended.
  bool mend() {
    std::vector<std::vector<std::uint32_t>> path(mesh_.sheets.size());  // a, vertices, b
    std::vector<std::uint32_t> apex(mesh_.sheets.size());
    bool any = false;
    for_each_edge(uses_, [&](std::size_t first, std::size_t last) {
      const std::uint32_t s = uses_[first].sheet;
      if (last - first != 1 || !path[s].empty()) return;
      const Rim rim = rim_of(uses_[first]);
      if (rim.side == 0) return;
      path[s] = path_beside(rim);
      apex[s] = rim.apex;
      any = any || !path[s].empty();
    });
    if (any) replace(path, apex);
    return any;
  }

 private:
  const Vec3& at(std::uint32_t v) const { return mesh_.vertices[v]; }

  Rim rim_of(const EdgeUse& use) const {
    const Sheet& sheet = mesh_.sheets[use.sheet];
    Rim rim{use.low(), use.high(), 0, 0, 0};
    for (const std::uint32_t v : sheet.v)
      if (v != rim.a && v != rim.b) rim.apex = v;
    const Vec3 normal = cross(at(rim.b) - at(rim.a), at(rim.apex) - at(rim.a));
    const Vec3 n(std::abs(normal.x), std::abs(normal.y), std::abs(normal.z));
    rim.axis = n.x >= n.y && n.x >= n.z ? 0 : (n.y >= n.z ? 1 : 2);
    rim.side = turn(at(rim.a), at(rim.b), at(rim.apex), rim.axis);
    return rim;
  }

  // Exactly: not on the border, not beside the plane.
  bool is_inside(const Rim& rim, const Vec3& p) const {
    const Vec3 &a = at(rim.a), &b = at(rim.b), &c = at(rim.apex);
    return turn(a, b, p, rim.axis) == rim.side && turn(b, c, p, rim.axis) == rim.side &&
           turn(c, a, p, rim.axis) == rim.side && is_coplanar(a, b, c, p);
  }

  bool is_open(std::uint32_t p, std::uint32_t q) const {
    return std::binary_search(open_.begin(), open_.end(), edge_key(p, q));
  }

  // From a over vertices inside the triangle to b; empty: there is nothing to mend.
  std::vector<std::uint32_t> path_beside(const Rim& rim) const {
    const Vec3 &a = at(rim.a), along = at(rim.b) - a;
    const double size = dot(along, along);
    std::vector<std::pair<double, std::uint32_t>> near;
    tree_.for_each_near_segment(a, at(rim.b), width_, [&](std::uint32_t v) {
      const double way = dot(at(v) - a, along) / size;
      if (way > 0 && way < 1 && length(at(v) - a - along * way) <= width_ && is_inside(rim, at(v)))
        near.emplace_back(way, v);
    });
    if (near.empty()) return {};
    std::sort(near.begin(), near.end());
    std::vector<std::uint32_t> all{rim.a}, path{rim.a};
    for (const auto& [way, v] : near) all.push_back(v);
    all.push_back(rim.b);
    for (std::size_t i = 1; i + 1 < all.size(); ++i)
      if (is_open(all[i - 1], all[i]) || is_open(all[i], all[i + 1])) path.push_back(all[i]);
    path.push_back(rim.b);
    for (std::size_t i = 0; i + 1 < path.size(); ++i)
      if (turn(at(path[i]), at(path[i + 1]), at(rim.apex), rim.axis) != rim.side) return {};
    return path.size() > 2 ? path : std::vector<std::uint32_t>{};
  }

  void replace(const std::vector<std::vector<std::uint32_t>>& path,
               const std::vector<std::uint32_t>& apex) {
    std::vector<Sheet> sheets;
    for (std::size_t s = 0; s < mesh_.sheets.size(); ++s) {
      const Sheet& sheet = mesh_.sheets[s];
      if (path[s].empty()) {
        sheets.push_back(sheet);
        continue;
      }
      // Against the order of the record: the way from its low end to its high end goes backwards.
      const bool backwards = sheet.v[1] == apex[s];
      for (std::size_t i = 0; i + 1 < path[s].size(); ++i)
        sheets.push_back(backwards ? sheet.part(path[s][i + 1], path[s][i], apex[s])
                                   : sheet.part(path[s][i], path[s][i + 1], apex[s]));
    }
    mesh_.sheets = std::move(sheets);
    sort_sheets(mesh_.sheets);
  }

  SheetMesh& mesh_;
  std::vector<EdgeUse> uses_;
  std::vector<std::uint64_t> open_;
  PointTree tree_;
  double width_;
};

}  // namespace

void close_overlapping_tears(SheetMesh& mesh) {
  for (int round = 0; round < kMaxTearRounds && Mender(mesh).mend(); ++round)
    split_edges_at_vertices(mesh);
}

}  // namespace pvsfarm
