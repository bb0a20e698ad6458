#include "common/scene/surface_splits.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/geometry/box.hpp"
#include "common/geometry/collinear.hpp"
#include "common/scene/point_tree.hpp"

namespace pvsfarm {
namespace {

// A vertex in the interior of an edge.
struct Split {
  std::uint64_t edge;
  double way;  // from the edge's low vertex, in steps that only order
  std::uint32_t vertex;
};

// By edge, along each. Exactly collinear points differ by as much on the edge's longest axis as
// doubles can tell, so that coordinate orders them.
std::vector<Split> find_splits(const SheetMesh& mesh, const std::vector<EdgeUse>& uses) {
  const PointTree tree(mesh.vertices, ends_of_edges(open_edges(uses)));
  std::vector<Split> splits;
  for_each_edge(uses, [&](std::size_t first, std::size_t) {
    if (splits.size() > kMaxSplitsPerTriangle * mesh.sheets.size()) return;
    const Vec3 &a = mesh.vertices[uses[first].low()], &b = mesh.vertices[uses[first].high()];
    const Vec3 d(std::abs(b.x - a.x), std::abs(b.y - a.y), std::abs(b.z - a.z));
    const int axis = d.x >= d.y && d.x >= d.z ? 0 : (d.y >= d.z ? 1 : 2);
    const double sign = b[axis] > a[axis] ? 1 : -1;
    tree.for_each_near_segment(a, b, 0, [&](std::uint32_t v) {
      const Vec3& p = mesh.vertices[v];
      if (is_inside_edge(p, a, b)) splits.push_back({uses[first].edge, sign * p[axis], v});
    });
  });
  std::sort(splits.begin(), splits.end(), [](const Split& p, const Split& q) {
    return std::tie(p.edge, p.way, p.vertex) < std::tie(q.edge, q.way, q.vertex);
  });
  return splits;
}

class Divider {
 public:
  explicit Divider(const std::vector<Split>& splits) : splits_(splits) {}

  // Appends the parts of `sheet`, in its orientation. A fan from the corner opposite to a divided
  // side; its first and last part may have further divided sides of their own.
  void divide(const Sheet& sheet, std::vector<Sheet>& parts) const {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = sheet.v[k], b = sheet.v[(k + 1) % 3], apex = sheet.v[(k + 2) % 3];
      const std::vector<std::uint32_t> points = points_along(a, b);
      if (points.empty()) continue;
      std::uint32_t from = a;
      for (std::size_t i = 0; i <= points.size(); ++i) {
        const std::uint32_t to = i < points.size() ? points[i] : b;
        divide(sheet.part(from, to, apex), parts);
        from = to;
      }
      return;
    }
    parts.push_back(sheet);
  }

 private:
  std::vector<std::uint32_t> points_along(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t edge = edge_key(a, b);
    auto at = std::lower_bound(splits_.begin(), splits_.end(), edge,
                               [](const Split& s, std::uint64_t key) { return s.edge < key; });
    std::vector<std::uint32_t> points;
    for (; at != splits_.end() && at->edge == edge; ++at) points.push_back(at->vertex);
    if (a > b) std::reverse(points.begin(), points.end());
    return points;
  }

  const std::vector<Split>& splits_;
};

// Whether anything was divided.
bool split_once(SheetMesh& mesh) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.sheets);
  const std::vector<Split> splits = find_splits(mesh, uses);
  if (splits.empty()) return false;
  const Divider divider(splits);
  std::vector<Sheet> parts;
  parts.reserve(mesh.sheets.size() + 2 * splits.size());
  for (const Sheet& sheet : mesh.sheets) divider.divide(sheet, parts);
  mesh.sheets = std::move(parts);
  sort_sheets(mesh.sheets);
  return true;
}

}  // namespace

std::vector<EdgeUse> sorted_edge_uses(const std::vector<Sheet>& sheets) {
  std::vector<EdgeUse> uses;
  uses.reserve(sheets.size() * 3);
  for (std::uint32_t s = 0; s < sheets.size(); ++s) {
    const std::uint32_t* const v = sheets[s].v;
    uses.push_back({edge_key(v[0], v[1]), s});
    uses.push_back({edge_key(v[1], v[2]), s});
    uses.push_back({edge_key(v[0], v[2]), s});
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.edge, a.sheet) < std::tie(b.edge, b.sheet);
  });
  return uses;
}

std::vector<std::uint64_t> open_edges(const std::vector<EdgeUse>& uses) {
  std::vector<std::uint64_t> edges;
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if ((last - first) % 2 != 0) edges.push_back(uses[first].edge);
  });
  return edges;
}

std::vector<std::uint32_t> ends_of_edges(const std::vector<std::uint64_t>& edges) {
  std::vector<std::uint32_t> ends;
  for (const std::uint64_t edge : edges) {
    ends.push_back(static_cast<std::uint32_t>(edge >> 32));
    ends.push_back(static_cast<std::uint32_t>(edge));
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

void split_edges_at_vertices(SheetMesh& mesh) {
  for (int round = 0; round < kMaxSplitRounds && split_once(mesh); ++round) {
  }
}

}  // namespace pvsfarm
