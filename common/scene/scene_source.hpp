// A scene before it is built: plain triangles by object, as an importer, a generator or a test
// makes them. build_scene() (scene_build.hpp) turns it into the immutable bundle.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/geometry/vec.hpp"

namespace pvsfarm {

// The up axis of the file the scene came from. Inside pvsfarm z is always up:
// a y-up point (x, y, z) becomes (x, -z, y), exactly.
enum class UpAxis : std::uint8_t { kZ = 0, kY = 1 };

inline Vec3 internal_from_file(UpAxis up, const Vec3& p) {
  return up == UpAxis::kZ ? p : Vec3{p.x, -p.z, p.y};
}
inline Vec3 file_from_internal(UpAxis up, const Vec3& p) {
  return up == UpAxis::kZ ? p : Vec3{p.x, p.z, -p.y};
}

struct SourceObject {
  std::string name{};
  std::vector<Vec3> vertices{};  // z up
  std::vector<std::array<std::uint32_t, 3>> triangles{};  // counter-clockwise seen from the front
  bool occluder = true;    // may block rays: opaque, static, never removed by the renderer
  bool occludee = true;    // appears in visible sets; false: geometry that only occludes
  bool dynamic = false;    // moves inside its vertices' box: never an occluder
  bool two_sided = true;   // false: the renderer culls back faces
};

struct SceneSource {
  std::vector<SourceObject> objects;  // in file order
  UpAxis file_up = UpAxis::kZ;
};

}  // namespace pvsfarm
