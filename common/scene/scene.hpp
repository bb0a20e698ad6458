// The immutable scene a bake works on: a view of one content-addressed bundle of bytes, mapped from
// a file or held in memory. Coordinator and workers see the same bytes.
//
// Everything is z up, in the units of the file, in double precision.
// [limit] kMaxObjects objects, kMaxTriangles triangles.
// Threads: const after construction; share freely.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.hpp"
#include "common/base/ids.hpp"
#include "common/base/result.hpp"
#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"
#include "common/scene/surface.hpp"

namespace pvsfarm {

inline constexpr std::uint32_t kMaxObjects = 1u << 31;
inline constexpr std::uint64_t kMaxTriangles = 1ull << 31;

// Records of the bundle: plain data, little endian, mapped as they are.
struct ObjectRecord {
  Box box;                        // of the object's vertices, exact
  std::uint64_t name_offset = 0;  // into the name bytes
  std::uint64_t first_triangle = 0;
  std::uint32_t name_bytes = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t file_index = 0;  // position in the source file
  std::uint8_t occluder = 0, occludee = 0, dynamic = 0, two_sided = 0;
};
static_assert(sizeof(ObjectRecord) == 80);

struct Triangle {
  std::uint32_t vertex[3];  // into Scene::vertices()
};

// What an occluder's points mean.
enum class OccluderShape : std::uint32_t {
  // A flat convex polygon, or a disc of triangles within `flatness` of a plane: the points are its
  // boundary in order, counter-clockwise seen from the front, seen convex.
  kPolygon = 0,
  // A convex solid: the hull of the points lies in matter. Legal for cells that do not meet that
  // matter: see `flatness` and `closed`.
  kSolid = 1,
};

// A convex piece of matter that may block rays (theory 0.2, A.4). It never depends on a visible
// set: leaving an occluder out is always safe.
struct Occluder {
  Box box = {};                    // of its points, without any ground extension
  // kPolygon: largest distance of its matter from one plane.
  // kSolid, closed: how far its matter may reach beyond its points; a cell that keeps this far off
  // the points does not meet the matter.
  double flatness = 0;
  std::uint64_t first_point = 0;   // into Scene::occluder_points()
  std::uint64_t first_owner = 0;   // into Scene::occluder_owners()
  std::uint32_t point_count = 0;
  // Objects whose matter it is; several where exact boxes were merged.
  std::uint32_t owner_count = 0;
  // kSolid: so many leading points are its base, at height box.lo.z <= ground(), and the solid has
  // no overhang: lowering copies of them to any depth adds only phantom matter (theory 0.3). 0: no.
  std::uint32_t base_points = 0;
  OccluderShape shape = OccluderShape::kPolygon;
  // kSolid: 1 if the solid is an axis-aligned box, points = Box::corner order.
  std::uint8_t is_box = 0;
  std::uint8_t one_sided = 0;      // kPolygon: blocks only rays that meet its front
  // kPolygon: one_sided, and part of a closed, outward oriented mesh (0.2 (c)).
  // kSolid: 1 if its matter is all there is to it, within `flatness`; 0 if it is part of a larger
  // solid or a union of several, legal only for cells that meet no owner's box.
  std::uint8_t closed = 0;
  std::uint8_t is_prism = 0;       // kSolid: upright, every wall vertical; the base may be replaced
  // kPolygon: a face of this solid, of use only where the cell meets that solid; -1: on its own.
  std::int32_t face_of = -1;
};
static_assert(sizeof(Occluder) == 96);

// A node of the hierarchy over the objects in id order. A leaf has child == 0.
struct BvhNode {
  Box box;                  // of the occludees in the range; empty() if there are none
  std::uint32_t first = 0;  // objects [first, first + count)
  std::uint32_t count = 0;
  std::uint32_t child = 0;  // children are `child` and `child + 1`; both follow their parent
  std::uint32_t reserved = 0;
};
static_assert(sizeof(BvhNode) == 64);

class Scene {
 public:
  // Maps the bundle at `path`, read-only. Verifies the digest unless told that a caller just did.
  // Errors: kIo, kInvalidInput (not a bundle, other version, damaged).
  static Result<std::shared_ptr<const Scene>> map(const std::string& path);
  // Takes over bytes of a bundle (see scene_build.hpp).
  static Result<std::shared_ptr<const Scene>> from_bytes(std::vector<std::byte> bundle);

  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  std::uint32_t object_count() const { return static_cast<std::uint32_t>(objects_.size()); }
  const ObjectRecord& object(ObjectId id) const { return objects_[index_of(id)]; }
  std::span<const ObjectRecord> objects() const { return objects_; }
  std::string_view name(ObjectId id) const;
  std::span<const Triangle> triangles(ObjectId id) const;
  std::span<const Triangle> all_triangles() const { return triangles_; }
  std::span<const Vec3> vertices() const { return vertices_; }

  std::span<const Occluder> occluders() const { return occluders_; }
  std::span<const Vec3> points(const Occluder& o) const {
    return occluder_points_.subspan(o.first_point, o.point_count);
  }
  std::span<const ObjectId> owners(const Occluder& o) const {
    return occluder_owners_.subspan(o.first_owner, o.owner_count);
  }
  std::span<const BvhNode> bvh() const { return bvh_; }  // node 0 is the root

  std::span<const Vec3> surface_vertices() const { return surface_vertices_; }
  std::span<const SurfaceEdge> surface_edges() const { return surface_edges_; }
  std::span<const SurfaceTriangle> surface_triangles() const { return surface_triangles_; }
  std::span<const SurfaceComponent> surface_components() const { return surface_components_; }

  const Box& bounds() const { return bounds_; }  // of all geometry
  double ground() const { return ground_; }      // lowest z of any occludee
  UpAxis file_up() const { return file_up_; }

  const Digest& digest() const { return digest_; }            // of bundle()
  std::span<const std::byte> bundle() const { return bytes_; }

 private:
  Scene() = default;
  Status attach(std::span<const std::byte> bytes);

  std::vector<std::byte> owned_;
  void* mapping_ = nullptr;
  std::size_t mapping_bytes_ = 0;
  std::span<const std::byte> bytes_;
  std::span<const ObjectRecord> objects_;
  std::span<const char> names_;
  std::span<const Vec3> vertices_;
  std::span<const Triangle> triangles_;
  std::span<const Occluder> occluders_;
  std::span<const Vec3> occluder_points_;
  std::span<const ObjectId> occluder_owners_;
  std::span<const BvhNode> bvh_;
  std::span<const Vec3> surface_vertices_;
  std::span<const SurfaceEdge> surface_edges_;
  std::span<const SurfaceTriangle> surface_triangles_;
  std::span<const SurfaceComponent> surface_components_;
  Box bounds_;
  double ground_ = 0;
  UpAxis file_up_ = UpAxis::kZ;
  Digest digest_;
};

}  // namespace pvsfarm
