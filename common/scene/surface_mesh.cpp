#include "common/scene/surface_mesh.hpp"

#include <algorithm>
#include <numeric>

#include "common/scene/convex_solid.hpp"
#include "common/scene/surface_parts.hpp"
#include "common/scene/surface_splits.hpp"
#include "common/scene/surface_tears.hpp"
#include "common/scene/surface_turns.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;
// A closed surface of so many triangles has kMaxSolidPoints vertices.
constexpr std::uint32_t kMaxSolidSheets = 2 * kMaxSolidPoints - 4;

// The number of each part among those kept, or kNone.
std::vector<std::uint32_t> choose_parts(const std::vector<SurfacePart>& parts) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t p = 0; p < parts.size(); ++p)
    if (parts[p].sheets > 1 && (!parts[p].is_convex || parts[p].sheets > kMaxSolidSheets))
      order.push_back(p);
  std::sort(order.begin(), order.end(), [&](std::uint32_t p, std::uint32_t q) {
    const double area_of_p = parts[p].area / parts[p].sheets;
    const double area_of_q = parts[q].area / parts[q].sheets;
    return area_of_p != area_of_q ? area_of_p > area_of_q : p < q;
  });
  std::size_t sheets = 0, kept = 0;
  while (kept < order.size() && sheets + parts[order[kept]].sheets <= kMaxSurfaceTriangles)
    sheets += parts[order[kept++]].sheets;
  order.resize(kept);
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> number(parts.size(), kNone);
  for (std::uint32_t k = 0; k < order.size(); ++k) number[order[k]] = k;
  return number;
}

// Triangles that share no edge cost as much to look after as a building, and are most often leaves.
void drop_loners_of_a_forest(SheetMesh& mesh) {
  std::vector<std::uint8_t> is_alone(mesh.sheets.size(), 1);
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.sheets);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last && last - first > 1; ++i) is_alone[uses[i].sheet] = 0;
  });
  const auto count = std::count(is_alone.begin(), is_alone.end(), 1);
  if (static_cast<std::size_t>(count) <= kMaxLoneTriangles) return;
  std::size_t kept = 0;
  for (std::size_t s = 0; s < mesh.sheets.size(); ++s)
    if (is_alone[s] == 0) mesh.sheets[kept++] = mesh.sheets[s];
  mesh.sheets.resize(kept);
}

// Fills the records part by part, in the order of the sheets.
class RecordWriter {
 public:
  RecordWriter(const SheetMesh& mesh, const SurfaceParts& parts,
               const std::vector<std::uint8_t>& fronts)
      : mesh_(mesh), parts_(parts), fronts_(fronts), number_(choose_parts(parts.parts)) {
    out_.components.resize(parts.parts.size() - static_cast<std::size_t>(std::count(
                                                    number_.begin(), number_.end(), kNone)));
    number_vertices();
  }

  SurfaceMesh write(const std::vector<EdgeUse>& uses) {
    for (std::size_t p = 0; p < number_.size(); ++p)
      if (number_[p] != kNone) {
        out_.components[number_[p]].area = parts_.parts[p].area;
        out_.components[number_[p]].triangle_count = parts_.parts[p].sheets;
      }
    for_each_edge(uses, [&](std::size_t first, std::size_t) {
      if (const std::uint32_t c = component_of(uses[first].sheet); c != kNone)
        ++out_.components[c].edge_count;
    });
    std::uint32_t triangles = 0, edges = 0;
    for (SurfaceComponent& c : out_.components) {
      c.first_triangle = triangles;
      c.first_edge = edges;
      triangles += c.triangle_count;
      edges += c.edge_count;
    }
    out_.triangles.resize(triangles);
    out_.edges.resize(edges);
    write_triangles();
    write_edges(uses);
    return std::move(out_);
  }

 private:
  std::uint32_t component_of(std::uint32_t sheet) const { return number_[parts_.of_sheet[sheet]]; }

  void number_vertices() {
    vertex_.assign(mesh_.vertices.size(), kNone);
    for (std::uint32_t s = 0; s < mesh_.sheets.size(); ++s)
      if (component_of(s) != kNone)
        for (const std::uint32_t v : mesh_.sheets[s].v) vertex_[v] = 0;
    for (std::size_t v = 0; v < vertex_.size(); ++v)
      if (vertex_[v] != kNone) {
        vertex_[v] = static_cast<std::uint32_t>(out_.vertices.size());
        out_.vertices.push_back(mesh_.vertices[v]);
      }
  }

  void write_triangles() {
    std::vector<std::uint32_t> next;
    for (const SurfaceComponent& c : out_.components) next.push_back(c.first_triangle);
    record_.assign(mesh_.sheets.size(), kNone);
    for (std::uint32_t s = 0; s < mesh_.sheets.size(); ++s) {
      const std::uint32_t c = component_of(s);
      if (c == kNone) continue;
      const Sheet& sheet = mesh_.sheets[s];
      SurfaceTriangle& t = out_.triangles[record_[s] = next[c]++];
      for (int k = 0; k < 3; ++k) {
        t.vertex[k] = vertex_[sheet.v[k]];
        out_.components[c].box.add(mesh_.vertices[sheet.v[k]]);
      }
      if (fronts_[s] == 1) std::swap(t.vertex[1], t.vertex[2]);
      t.one_sided = sheet.sides != Sheet::kBoth;
    }
  }

  void write_edges(const std::vector<EdgeUse>& uses) {
    std::vector<std::uint32_t> next;
    for (const SurfaceComponent& c : out_.components) next.push_back(c.first_edge);
    for_each_edge(uses, [&](std::size_t first, std::size_t last) {
      const std::uint32_t c = component_of(uses[first].sheet);
      if (c == kNone) return;
      const std::uint32_t low = vertex_[uses[first].low()], high = vertex_[uses[first].high()];
      const std::uint32_t e = next[c]++;
      out_.edges[e] = {{low, high}};
      for (std::size_t i = first; i < last; ++i) {
        SurfaceTriangle& t = out_.triangles[record_[uses[i].sheet]];
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t from = t.vertex[k], to = t.vertex[(k + 1) % 3];
          if (from == low && to == high) t.edge[k] = static_cast<std::int32_t>(e);
          if (from == high && to == low) t.edge[k] = ~static_cast<std::int32_t>(e);
        }
      }
    });
  }

  const SheetMesh& mesh_;
  const SurfaceParts& parts_;
  const std::vector<std::uint8_t>& fronts_;
  std::vector<std::uint32_t> number_;  // of each part, among those kept
  std::vector<std::uint32_t> vertex_;  // of each vertex, among those in use
  std::vector<std::uint32_t> record_;  // of each sheet
  SurfaceMesh out_;
};

}  // namespace

SurfaceMesh make_surfaces(std::span<const SurfaceInput> inputs) {
  // 1. Join what is equal.
  SheetMesh mesh = weld_surfaces(inputs);
  drop_party_walls(mesh.sheets);
  drop_loners_of_a_forest(mesh);

  // 2. Divide edges where somebody's vertex lies on them. What then is a party wall, is one.
  split_edges_at_vertices(mesh);
  drop_party_walls(mesh.sheets);
  close_overlapping_tears(mesh);

  // 3. What hangs together, and is worth it.
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.sheets);
  const SurfaceParts parts = find_parts(mesh, uses);
  return RecordWriter(mesh, parts, choose_fronts(mesh, uses)).write(uses);
}

}  // namespace pvsfarm
