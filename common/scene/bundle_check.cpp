// What must hold between the records of a bundle, beyond their sizes.
#include <cmath>
#include <string>
#include <vector>

#include "common/scene/bundle.hpp"

namespace pvsfarm {
namespace {

bool finite(const Vec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}
bool same(const Box& a, const Box& b) { return a.lo == b.lo && a.hi == b.hi; }
bool is_flag(std::uint8_t value) { return value <= 1; }

// [first, first + count) inside [0, size), without overflow.
bool in_range(std::uint64_t first, std::uint64_t count, std::uint64_t size) {
  return first <= size && count <= size - first;
}

Error broken(const char* what, std::size_t index) {
  return invalid_input("not a usable scene bundle: broken " + std::string(what) + " " +
                       std::to_string(index) + "; remove it and import the scene again");
}

Status check_objects(const BundleParts& p) {
  Box bounds;
  double ground = std::numeric_limits<double>::infinity();
  std::uint64_t next_triangle = 0;
  for (std::size_t i = 0; i < p.objects.size(); ++i) {
    const ObjectRecord& o = p.objects[i];
    const bool fits = in_range(o.name_offset, o.name_bytes, p.names.size()) &&
                      o.first_triangle == next_triangle && o.triangle_count > 0 &&
                      in_range(o.first_triangle, o.triangle_count, p.triangles.size()) &&
                      o.file_index < p.objects.size() && is_flag(o.occluder) &&
                      is_flag(o.occludee) && is_flag(o.dynamic) && is_flag(o.two_sided) &&
                      !o.box.empty() && finite(o.box.lo) && finite(o.box.hi);
    if (!fits) return broken("object", i);
    for (const Triangle& t : p.triangles.subspan(o.first_triangle, o.triangle_count))
      for (const std::uint32_t v : t.vertex)
        if (v >= p.vertices.size() || !o.box.contains(p.vertices[v])) return broken("object", i);
    next_triangle += o.triangle_count;
    bounds.add(o.box);
    if (o.occludee) ground = std::min(ground, o.box.lo.z);
  }
  if (next_triangle != p.triangles.size()) return broken("triangle", next_triangle);
  for (std::size_t i = 0; i < p.vertices.size(); ++i)
    if (!finite(p.vertices[i])) return broken("vertex", i);
  if (!same(bounds, p.bounds) || ground != p.ground) return broken("bounds of object", 0);
  return {};
}

bool occluder_fits(const BundleParts& p, const Occluder& o) {
  if (o.shape != OccluderShape::kPolygon && o.shape != OccluderShape::kSolid) return false;
  const bool solid = o.shape == OccluderShape::kSolid;
  return in_range(o.first_point, o.point_count, p.occluder_points.size()) &&
         in_range(o.first_owner, o.owner_count, p.occluder_owners.size()) && o.owner_count > 0 &&
         o.point_count >= (solid ? 4u : 3u) && o.base_points <= o.point_count &&
         is_flag(o.is_box) && is_flag(o.one_sided) && is_flag(o.closed) && is_flag(o.is_prism) &&
         (!o.is_box || o.point_count == 8) && o.flatness >= 0 && std::isfinite(o.flatness) &&
         (solid ? o.face_of == -1 && !o.one_sided
                : !o.is_box && !o.is_prism && o.base_points == 0 && o.face_of >= -1) &&
         (o.face_of < 0 || (static_cast<std::size_t>(o.face_of) < p.occluders.size() &&
                            p.occluders[o.face_of].shape == OccluderShape::kSolid)) &&
         (o.base_points == 0 || o.box.lo.z <= p.ground);
}

Status check_occluders(const BundleParts& p) {
  for (std::size_t i = 0; i < p.occluders.size(); ++i) {
    const Occluder& o = p.occluders[i];
    if (!occluder_fits(p, o)) return broken("occluder", i);
    Box box;
    bool sound = true;
    for (const Vec3& point : p.occluder_points.subspan(o.first_point, o.point_count)) {
      sound = sound && finite(point);
      box.add(point);
    }
    for (const Vec3& point : p.occluder_points.subspan(o.first_point, o.base_points))
      sound = sound && point.z == o.box.lo.z;
    if (!sound || !same(box, o.box)) return broken("occluder", i);
  }
  for (std::size_t i = 0; i < p.occluder_owners.size(); ++i) {
    const std::uint32_t owner = index_of(p.occluder_owners[i]);
    if (owner >= p.objects.size() || !p.objects[owner].occluder || p.objects[owner].dynamic)
      return broken("owner of an occluder", i);
  }
  return {};
}

Status check_surface_triangle(const BundleParts& p, const SurfaceComponent& c, std::size_t i) {
  const SurfaceTriangle& t = p.surface_triangles[i];
  if (t.one_sided > 1) return broken("surface triangle", i);
  for (int k = 0; k < 3; ++k) {
    const bool forward = t.edge[k] >= 0;
    const auto e = static_cast<std::uint32_t>(forward ? t.edge[k] : ~t.edge[k]);
    if (e < c.first_edge || e - c.first_edge >= c.edge_count)
      return broken("surface triangle", i);
    const SurfaceEdge& edge = p.surface_edges[e];
    if (edge.vertex[forward ? 0 : 1] != t.vertex[k] ||
        edge.vertex[forward ? 1 : 0] != t.vertex[(k + 1) % 3] || edge.vertex[0] >= edge.vertex[1])
      return broken("surface triangle", i);
  }
  return {};
}

Status check_surfaces(const BundleParts& p) {
  for (std::size_t i = 0; i < p.surface_vertices.size(); ++i)
    if (!finite(p.surface_vertices[i])) return broken("surface vertex", i);
  for (std::size_t i = 0; i < p.surface_edges.size(); ++i)
    if (p.surface_edges[i].vertex[1] >= p.surface_vertices.size() ||
        p.surface_edges[i].vertex[0] >= p.surface_edges[i].vertex[1])
      return broken("surface edge", i);
  std::uint64_t next_triangle = 0, next_edge = 0;
  for (std::size_t i = 0; i < p.surface_components.size(); ++i) {
    const SurfaceComponent& c = p.surface_components[i];
    if (c.first_triangle != next_triangle || c.first_edge != next_edge || !(c.area >= 0) ||
        !in_range(c.first_triangle, c.triangle_count, p.surface_triangles.size()) ||
        !in_range(c.first_edge, c.edge_count, p.surface_edges.size()))
      return broken("surface", i);
    next_triangle += c.triangle_count;
    next_edge += c.edge_count;
    for (std::size_t t = c.first_triangle; t < next_triangle; ++t)
      if (const Status s = check_surface_triangle(p, c, t); !s.ok()) return s;
  }
  if (next_triangle != p.surface_triangles.size() || next_edge != p.surface_edges.size())
    return broken("surface", p.surface_components.size());
  return {};
}

// Children follow their parent, so one backward pass sees every node after its children.
Status check_bvh(const BundleParts& p) {
  if (p.bvh.empty() || p.bvh[0].first != 0 || p.bvh[0].count != p.objects.size())
    return broken("node of the hierarchy", 0);
  std::vector<std::uint8_t> parents(p.bvh.size(), 0);
  for (std::size_t i = p.bvh.size(); i-- > 0;) {
    const BvhNode& n = p.bvh[i];
    Box box;
    bool fits = n.count > 0 && in_range(n.first, n.count, p.objects.size()) && n.reserved == 0;
    if (fits && n.child == 0) {
      for (const ObjectRecord& o : p.objects.subspan(n.first, n.count))
        if (o.occludee) box.add(o.box);
    } else if (fits) {
      fits = n.child > i && n.child < p.bvh.size() - 1;
      if (!fits) return broken("node of the hierarchy", i);
      const BvhNode& low = p.bvh[n.child];
      const BvhNode& high = p.bvh[n.child + 1];
      fits = low.first == n.first && high.first == low.first + low.count &&
             std::uint64_t{low.count} + high.count == n.count && ++parents[n.child] == 1 &&
             ++parents[n.child + 1] == 1;
      box = low.box;
      box.add(high.box);
    }
    if (!fits || !same(box, n.box)) return broken("node of the hierarchy", i);
  }
  for (std::size_t i = 1; i < p.bvh.size(); ++i)
    if (parents[i] != 1) return broken("node of the hierarchy", i);
  return {};
}

}  // namespace

Status check_bundle(const BundleParts& parts) {
  if (parts.objects.empty() || parts.objects.size() > kMaxObjects) return broken("object", 0);
  if (parts.triangles.size() > kMaxTriangles) return broken("triangle", kMaxTriangles);
  if (const Status s = check_objects(parts); !s.ok()) return s;
  if (const Status s = check_occluders(parts); !s.ok()) return s;
  if (const Status s = check_surfaces(parts); !s.ok()) return s;
  return check_bvh(parts);
}

}  // namespace pvsfarm
