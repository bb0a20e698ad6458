// Writes a .pvs store (docs/store_format.md), node by node in canonical order, atomically: the
// file appears complete, or not at all. No time stamps, no host names: equal input, equal bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.hpp"
#include "common/base/ids.hpp"
#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/leaf_reason.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"

namespace pvsfarm {

struct StoreHeader {
  UpAxis up = UpAxis::kZ;  // of the scene file: exports use its coordinates
  Digest scene_digest;
  Digest bake_digest;         // scene, cells, settings and kernel: equal means equal bytes
  std::string settings_json;  // for people: `inspect` prints it
};

// What a store keeps of an object, so that it can be read without the scene.
struct StoreObject {
  std::string_view name;
  Box box;
  std::uint32_t triangle_count = 0;
  std::uint32_t file_index = 0;
  bool occluder = true, occludee = true, dynamic = false;
};

// One cell of the hierarchy. Nodes come in CellKey order: a parent before its children.
struct StoreNode {
  CellKey key;
  std::int64_t root_id = 0;  // the id given in the cells file
  bool leaf = true;
  LeafReason reason = LeafReason::kNoBudget;  // of a leaf that is not quarantined
  bool quarantined = false;  // never evaluated: keeps its parent's PVS, the bake is incomplete
  Cell cell;
  // Of a leaf. An inner node's sets are not kept: they are the unions of its leaves'.
  VisibleSet visible;
  // Certified seen; none(n) where no witnesses were sought. What is not visible is not kept, but
  // counted, and found by validate_store.
  VisibleSet seen;
};

class StoreWriter {
 public:
  // Writes beside `path` under a temporary name. Errors: kIo, naming the path.
  static Result<std::unique_ptr<StoreWriter>> create(const std::string& path,
                                                     const StoreHeader& header, const Scene& scene);
  static Result<std::unique_ptr<StoreWriter>> create(const std::string& path,
                                                     const StoreHeader& header,
                                                     std::span<const StoreObject> objects);
  virtual ~StoreWriter() = default;  // without finish(): removes the temporary file
  // Requires: nodes in canonical order, whole hierarchies, leaf exactly where no child follows.
  virtual Status add(const StoreNode& node) = 0;
  virtual Status finish() = 0;  // checksums, fsync, rename, fsync of the folder
};

}  // namespace pvsfarm
