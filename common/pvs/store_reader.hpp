// Reads a .pvs store: the C++ face of the run-time reader (pvs_reader.h), for the commands.
//
// Every block is checked against its checksum when it is first touched, so an answer is the one
// that was written, or an error. [limit] the file must not be cut while it is open. Threads: one
// object, one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/store_writer.hpp"
#include "common/pvs/visible_set.hpp"

struct pvs_store;

namespace pvsfarm {

struct SetSize {
  std::uint32_t objects = 0, triangles = 0;
  friend bool operator==(const SetSize&, const SetSize&) = default;
};

// A cell of the hierarchy. `index` is its number in canonical order, the "cell N" of the commands.
struct StoredNode {
  std::uint32_t index = 0;
  CellKey key;
  std::int64_t root_id = 0;
  std::int64_t parent = -1;  // an index, or -1
  std::uint32_t end = 0;     // the index after its last descendant
  bool leaf = true, quarantined = false;
  LeafReason reason = LeafReason::kNone;  // why it is a leaf
  SetSize visible, seen;                  // of a leaf's sets; 0 of an inner node
  Cell cell;
};

struct StoredSets {
  VisibleSet visible, seen;
};

struct StoreSizes {
  std::uint64_t geometry_bytes = 0;  // the cells themselves, and finding them
  std::uint64_t set_bytes = 0;       // their sets
};

class StoreReader {
 public:
  // Errors: kIo, kInvalidInput (no store, damaged, truncated), kUnsupported (another version).
  static Result<std::unique_ptr<StoreReader>> open(const std::string& path);
  ~StoreReader();
  StoreReader(const StoreReader&) = delete;
  StoreReader& operator=(const StoreReader&) = delete;

  const std::string& path() const { return path_; }
  const StoreHeader& header() const { return header_; }
  const Digest& digest() const { return digest_; }  // as the file states it; see validate_store
  std::uint64_t file_bytes() const;
  std::uint32_t node_count() const;
  std::uint32_t leaf_count() const;
  std::uint32_t root_count() const;
  std::uint32_t object_count() const;
  StoreSizes sizes() const;

  // Names are views of the file. Errors of this and all that follow: kInvalidInput (damaged).
  Result<std::vector<StoreObject>> objects();
  Result<StoredNode> node(std::uint32_t index);  // Requires: index < node_count()
  // The same. An inner node's are the unions of its leaves'.
  Result<StoredSets> sets(std::uint32_t index);
  // All leaf cells that hold `point` (z up), ascending.
  Result<std::vector<std::uint32_t>> leaves_at(const Vec3& point);

  const pvs_store& raw() const { return *store_; }
  Error damage(const std::string& what, std::uint64_t offset_bytes) const;

 private:
  StoreReader() = default;
  Status verify(std::uint32_t block);
  Status verify_all();
  Status verify_node(std::uint32_t index);
  Error node_damage(std::uint32_t index) const;

  std::string path_;
  std::unique_ptr<pvs_store> store_;
  std::vector<bool> verified_;
  std::vector<std::uint64_t> scratch_;
  StoreHeader header_;
  Digest digest_;
};

// The sum of the objects' triangles.
std::uint64_t triangles_of(const VisibleSet& set, const std::vector<StoreObject>& objects);

}  // namespace pvsfarm
