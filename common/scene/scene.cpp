#include "common/scene/scene.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/scene/bundle.hpp"

namespace pvsfarm {

Scene::~Scene() {
  if (mapping_ != nullptr) ::munmap(mapping_, mapping_bytes_);
}

Result<std::shared_ptr<const Scene>> Scene::map(const std::string& path) {
  const auto failed = [&path](const char* what) {
    return io_error(path + ": cannot " + what + ": " + std::strerror(errno));
  };
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open the scene bundle");
  struct stat status {};
  const bool known = ::fstat(file, &status) == 0;
  const std::size_t size =
      known && status.st_size > 0 ? static_cast<std::size_t>(status.st_size) : 0;
  void* const memory = size == 0 ? nullptr : ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  const int map_errno = errno;
  ::close(file);
  errno = map_errno;
  if (!known || memory == MAP_FAILED) return failed("map the scene bundle");

  std::shared_ptr<Scene> scene(new Scene);
  scene->mapping_ = memory;
  scene->mapping_bytes_ = size;
  const Status status_of_bytes = scene->attach({static_cast<const std::byte*>(memory), size});
  if (!status_of_bytes.ok()) return invalid_input(path + ": " + status_of_bytes.error().text);
  return std::shared_ptr<const Scene>(std::move(scene));
}

Result<std::shared_ptr<const Scene>> Scene::from_bytes(std::vector<std::byte> bundle) {
  std::shared_ptr<Scene> scene(new Scene);
  scene->owned_ = std::move(bundle);
  const Status status = scene->attach(scene->owned_);
  if (!status.ok()) return status.error();
  return std::shared_ptr<const Scene>(std::move(scene));
}

Status Scene::attach(std::span<const std::byte> bytes) {
  const Result<BundleParts> parts = read_bundle(bytes);
  if (!parts) return parts.error();
  if (const Status status = check_bundle(*parts); !status.ok()) return status;
  bytes_ = bytes;
  objects_ = parts->objects;
  names_ = parts->names;
  vertices_ = parts->vertices;
  triangles_ = parts->triangles;
  occluders_ = parts->occluders;
  occluder_points_ = parts->occluder_points;
  occluder_owners_ = parts->occluder_owners;
  bvh_ = parts->bvh;
  surface_vertices_ = parts->surface_vertices;
  surface_edges_ = parts->surface_edges;
  surface_triangles_ = parts->surface_triangles;
  surface_components_ = parts->surface_components;
  bounds_ = parts->bounds;
  ground_ = parts->ground;
  file_up_ = parts->file_up;
  digest_ = digest_of(bytes);
  return {};
}

std::string_view Scene::name(ObjectId id) const {
  const ObjectRecord& o = object(id);
  return {names_.data() + o.name_offset, o.name_bytes};
}

std::span<const Triangle> Scene::triangles(ObjectId id) const {
  const ObjectRecord& o = object(id);
  return triangles_.subspan(o.first_triangle, o.triangle_count);
}

}  // namespace pvsfarm
