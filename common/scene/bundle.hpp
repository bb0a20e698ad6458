// The scene bundle as bytes: one header, then the sections of scene.hpp's records.
//
//   bundle   := preamble head section*            everything little endian, all padding zero
//   preamble := magic "PVSSCENE", u32 version, u32 sections, u64 bytes of the bundle,
//               u8[32] checksum (BLAKE2b-256 of all that follows the preamble), u64 zero
//   head     := f64[6] bounds (lo, hi), f64 ground, u32 file_up, u32 zero,
//               u64 bytes of each section
//   section  := its records, from the next multiple of 16, in the order of enum Section
//
// Offsets follow from the sizes, so there is nothing in the file that could contradict them.
// Drawback: not patchable; a changed scene is a new bundle with a new digest.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

inline constexpr std::uint32_t kBundleVersion = 2;

// What a bundle holds, as views of memory that somebody else keeps.
struct BundleParts {
  Box bounds;
  double ground = 0;
  UpAxis file_up = UpAxis::kZ;
  std::span<const ObjectRecord> objects;
  std::span<const char> names;
  std::span<const Vec3> vertices;
  std::span<const Triangle> triangles;
  std::span<const Occluder> occluders;
  std::span<const Vec3> occluder_points;
  std::span<const ObjectId> occluder_owners;
  std::span<const BvhNode> bvh;
  std::span<const Vec3> surface_vertices;
  std::span<const SurfaceEdge> surface_edges;
  std::span<const SurfaceTriangle> surface_triangles;
  std::span<const SurfaceComponent> surface_components;
};

std::vector<std::byte> write_bundle(const BundleParts& parts);

// Views of `bytes`, which must be 16-byte aligned and outlive them. Checks sizes and checksum.
// Errors: kInvalidInput; the text is to be prefixed with the name of the file.
Result<BundleParts> read_bundle(std::span<const std::byte> bytes);

// Every index, range and number of the records: what passes can be used without further checks.
// Errors: kInvalidInput, as above.
Status check_bundle(const BundleParts& parts);

}  // namespace pvsfarm
