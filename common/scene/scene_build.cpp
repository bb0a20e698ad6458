#include "common/scene/scene_build.hpp"

#include <cmath>
#include <utility>

#include "common/scene/bundle.hpp"
#include "common/scene/hierarchy.hpp"
#include "common/scene/mesh.hpp"
#include "common/scene/occluder_models.hpp"
#include "common/scene/surface_mesh.hpp"

namespace pvsfarm {
namespace {

// [limit] [scene units] A coordinate beyond this is a mistake, and its cube must stay finite.
constexpr double kMaxCoordinate = 1e12;

std::string object_text(const SceneSource& source, std::size_t file_index) {
  return "object " + std::to_string(file_index) + " '" + source.objects[file_index].name + "'";
}

Status check_object(const SceneSource& source, std::size_t file_index) {
  const SourceObject& object = source.objects[file_index];
  if (object.triangles.empty() || object.vertices.empty())
    return invalid_input(object_text(source, file_index) + " has no triangles; leave it out");
  for (std::size_t v = 0; v < object.vertices.size(); ++v)
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(object.vertices[v][a]) <= kMaxCoordinate))
        return invalid_input(object_text(source, file_index) + ": vertex " + std::to_string(v) +
                             " is not a finite point within 1e12 units; repair the mesh");
  for (std::size_t t = 0; t < object.triangles.size(); ++t)
    for (const std::uint32_t v : object.triangles[t])
      if (v >= object.vertices.size())
        return invalid_input(object_text(source, file_index) + ": triangle " + std::to_string(t) +
                             " names vertex " + std::to_string(v) + " of " +
                             std::to_string(object.vertices.size()) + "; repair the mesh");
  return {};
}

Status check_source(const SceneSource& source) {
  if (source.objects.empty())
    return invalid_input("the scene has no objects; export at least one mesh");
  if (source.objects.size() > kMaxObjects)
    return invalid_input("the scene has " + std::to_string(source.objects.size()) +
                         " objects, the limit is " + std::to_string(kMaxObjects) + "; join some");
  std::uint64_t triangles = 0, vertices = 0;
  bool any_occludee = false;
  for (std::size_t i = 0; i < source.objects.size(); ++i) {
    if (const Status status = check_object(source, i); !status.ok()) return status;
    triangles += source.objects[i].triangles.size();
    vertices += source.objects[i].vertices.size();
    any_occludee = any_occludee || source.objects[i].occludee;
  }
  if (!any_occludee)
    return invalid_input(
        "no object of the scene is an occludee, so nothing could be visible; "
        "tag at least one with \"occludee\": true");
  if (triangles > kMaxTriangles || vertices > UINT32_MAX)
    return invalid_input("the scene has " + std::to_string(triangles) + " triangles and " +
                         std::to_string(vertices) + " vertices, the limits are " +
                         std::to_string(kMaxTriangles) + " and " + std::to_string(UINT32_MAX) +
                         "; bake it in parts");
  return {};
}

// The sections of the bundle while they grow.
struct Sections {
  std::vector<ObjectRecord> objects;
  std::vector<char> names;
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  Box bounds;
  double ground = std::numeric_limits<double>::infinity();

  void add(const SourceObject& source, const Mesh& mesh, std::uint32_t file_index) {
    ObjectRecord record;
    for (const Vec3& p : mesh.vertices) record.box.add(p);
    record.name_offset = names.size();
    record.name_bytes = static_cast<std::uint32_t>(source.name.size());
    record.first_triangle = triangles.size();
    record.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
    record.file_index = file_index;
    record.occluder = source.occluder;
    record.occludee = source.occludee;
    record.dynamic = source.dynamic;
    record.two_sided = source.two_sided;
    const auto base = static_cast<std::uint32_t>(vertices.size());
    for (const MeshTriangle& t : mesh.triangles)
      triangles.push_back({{base + t[0], base + t[1], base + t[2]}});
    names.insert(names.end(), source.name.begin(), source.name.end());
    vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    objects.push_back(record);
    bounds.add(record.box);
    if (record.occludee) ground = std::min(ground, record.box.lo.z);
  }
};

struct Models {
  OccluderSet occluders;
  SurfaceMesh surfaces;
};

// Of the objects in the order of their ids. Surfaces first: what they take for a while is as much
// as all occluders are later. Meshes, and the parts they fall into, go as soon as they are used.
Models make_models(const Sections& sections, std::vector<Mesh> meshes) {
  std::vector<SurfaceInput> opaque;
  for (std::uint32_t id = 0; id < meshes.size(); ++id) {
    const ObjectRecord& object = sections.objects[id];
    if (!object.occluder || object.dynamic) continue;
    const bool two_sided = object.two_sided != 0;
    opaque.push_back({&meshes[id], split_components(meshes[id], two_sided), two_sided});
  }
  Models models{.occluders = {}, .surfaces = make_surfaces(opaque)};
  for (SurfaceInput& input : opaque) {
    const auto id = static_cast<std::uint32_t>(input.mesh - meshes.data());
    model_object(meshes[id], input.components, ObjectId{id}, input.two_sided, sections.ground,
                 models.occluders);
    input.components = {};
    meshes[id] = {};
  }
  model_box_runs(sections.ground, models.occluders);
  return models;
}

}  // namespace

Result<std::vector<std::byte>> build_bundle(SceneSource source) {
  if (const Status status = check_source(source); !status.ok()) return status.error();

  // 1. Number the objects.
  std::vector<Box> boxes(source.objects.size());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (const Vec3& p : source.objects[i].vertices) boxes[i].add(p);
  const ObjectOrder order = morton_order(boxes);

  // 2. Geometry.
  Sections sections;
  std::vector<Mesh> meshes;
  for (const std::uint32_t i : order.file_index) {
    meshes.push_back(weld(source.objects[i]));
    sections.add(source.objects[i], meshes.back(), i);
    source.objects[i] = {};
  }

  // 3. Occluder models.
  const Models models = make_models(sections, std::move(meshes));
  const OccluderSet& set = models.occluders;
  const SurfaceMesh& surfaces = models.surfaces;

  // 4. Hierarchy, and all of it as bytes.
  const std::vector<BvhNode> bvh = build_bvh(sections.objects, order.morton);
  return write_bundle({.bounds = sections.bounds,
                       .ground = sections.ground,
                       .file_up = source.file_up,
                       .objects = sections.objects,
                       .names = sections.names,
                       .vertices = sections.vertices,
                       .triangles = sections.triangles,
                       .occluders = set.occluders,
                       .occluder_points = set.points,
                       .occluder_owners = set.owners,
                       .bvh = bvh,
                       .surface_vertices = surfaces.vertices,
                       .surface_edges = surfaces.edges,
                       .surface_triangles = surfaces.triangles,
                       .surface_components = surfaces.components});
}

Result<std::shared_ptr<const Scene>> build_scene(SceneSource source) {
  Result<std::vector<std::byte>> bundle = build_bundle(std::move(source));
  if (!bundle) return bundle.error();
  return Scene::from_bytes(std::move(bundle).value());
}

}  // namespace pvsfarm
