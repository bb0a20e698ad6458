#include "common/scene/occluder_models.hpp"

#include <algorithm>

#include "common/scene/box_runs.hpp"
#include "common/scene/convex_solid.hpp"
#include "common/scene/coplanar_faces.hpp"
#include "common/scene/mesh_components.hpp"
#include "common/scene/prism_pieces.hpp"

namespace pvsfarm {
namespace {

Occluder solid_kind(const ConvexSolid& solid) {
  Occluder kind;
  kind.shape = OccluderShape::kSolid;
  kind.flatness = solid.shrink;
  kind.base_points = static_cast<std::uint32_t>(solid.base_points);
  kind.is_box = solid.is_box;
  kind.is_prism = solid.is_prism;
  kind.closed = 1;
  return kind;
}

void add_faces(const Mesh& mesh, std::span<const MeshTriangle> triangles, Occluder kind,
               ObjectId owner, OccluderSet& set) {
  for (const FlatPolygon& polygon : merge_coplanar(mesh, triangles)) {
    kind.flatness = polygon.flatness;
    set.add(kind, polygon.points, {&owner, 1});
  }
}

}  // namespace

void model_object(const Mesh& mesh, std::span<const MeshComponent> components, ObjectId owner,
                  bool two_sided, double ground, OccluderSet& set) {
  for (const MeshComponent& component : components) {
    Occluder face;
    face.one_sided = !two_sided;
    bool is_entered_by_fronts = component.closed_outward && is_star_shaped(mesh, component);
    if (const auto solid = convex_solid(mesh, component, ground)) {
      face.face_of = set.add(solid_kind(*solid), solid->points, {&owner, 1});
    } else {
      for (const ConvexSolid& piece : prism_pieces(mesh, component, ground)) {
        Occluder kind = solid_kind(piece);
        kind.closed = 0;  // its neighbours are the same matter
        set.add(kind, piece.points, {&owner, 1});
        is_entered_by_fronts = component.closed_outward;  // winding numbers are never negative
      }
    }
    face.closed = face.one_sided && is_entered_by_fronts;
    add_faces(mesh, component.triangles, face, owner, set);
  }
}

void model_box_runs(double ground, OccluderSet& set) {
  std::vector<Box> boxes;
  std::vector<ObjectId> owners;
  for (const Occluder& occluder : set.occluders) {
    if (!occluder.is_box) continue;
    boxes.push_back(occluder.box);
    owners.push_back(set.owners[occluder.first_owner]);
  }
  for (const BoxRun& run : find_box_runs(boxes)) {
    ConvexSolid solid;
    for (int k = 0; k < 8; ++k) solid.points.push_back(run.box.corner(k));
    solid.base_points = run.box.lo.z <= ground ? 4 : 0;
    solid.is_box = solid.is_prism = true;
    std::vector<ObjectId> run_owners;
    for (const std::uint32_t member : run.members) run_owners.push_back(owners[member]);
    std::sort(run_owners.begin(), run_owners.end());
    run_owners.erase(std::unique(run_owners.begin(), run_owners.end()), run_owners.end());
    Occluder kind = solid_kind(solid);
    kind.closed = 0;  // its members reach farther
    set.add(kind, solid.points, run_owners);
  }
}

}  // namespace pvsfarm
