// STORE.hints: the hints of every leaf of a store, in a file of its own, bound to the store by its
// digest. The store does not know of it and is the same without it. Format: docs/store_format.md.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/atomic_file.hpp"
#include "common/base/digest.hpp"
#include "common/base/result.hpp"
#include "common/pvs/hints.hpp"
#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

inline std::string hints_path(const std::string& store) { return store + ".hints"; }

// Threads: one object, one thread.
class HintsWriter {
 public:
  // Errors of all: kIo, naming the path.
  static Result<std::unique_ptr<HintsWriter>> create(const std::string& path,
                                                     std::uint32_t viewpoints);
  // The row of the next node, in the store's order; of an inner node an empty one.
  Status add(std::span<const std::byte> row);
  // `store`: its digest. Once.
  Status finish(const Digest& store);

 private:
  HintsWriter(std::unique_ptr<AtomicFile> file) : file_(std::move(file)) {}
  Status write(std::span<const std::byte> bytes);

  std::unique_ptr<AtomicFile> file_;
  DigestBuilder digest_;
  std::vector<std::uint64_t> ends_;  // of the rows, in bytes of all rows together
};

class HintsReader {
 public:
  // Reads and verifies all of it. Errors: kIo, kInvalidInput (damaged, or not such a file),
  // kUnsupported (another version).
  static Result<HintsReader> open(const std::string& path);

  const Digest& store() const { return store_; }
  std::uint32_t viewpoints() const { return viewpoints_; }
  std::uint32_t node_count() const { return static_cast<std::uint32_t>(ends_.size()); }
  // Empty for an inner node. Requires: node < node_count()
  std::span<const std::byte> row(std::uint32_t node) const;

 private:
  std::vector<std::byte> rows_;
  std::vector<std::uint64_t> ends_;
  Digest store_;
  std::uint32_t viewpoints_ = 0;
};

// Those of a store. Errors: also kInvalidInput, of another store.
Result<HintsReader> read_hints(const StoreReader& store);

}  // namespace pvsfarm
