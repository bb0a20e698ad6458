// Builds one chunk of a store: a run of nodes, and their sets as rows over a dictionary of distinct
// (position, word) pairs, where a word is 64 objects (docs/store_format.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "common/pvs/store_bytes.hpp"
#include "common/pvs/store_writer.hpp"

namespace pvsfarm {

// What bounds the writer's memory. Larger chunks share more words and cost more to hold.
inline constexpr std::uint32_t kMaxChunkNodes = 1024;
inline constexpr std::size_t kMaxChunkWords = std::size_t{1} << 20;  // non-zero, of all its sets

// What a node says of its sets without their rows.
struct NodeSizes {
  std::uint32_t visible_objects = 0, visible_triangles = 0;
  std::uint32_t seen_objects = 0, seen_triangles = 0;
};

class ChunkBuilder {
 public:
  void add(const StoreNode& node, std::uint32_t parent, const NodeSizes& sizes);
  bool full() const { return nodes_.size() >= kMaxChunkNodes || words_held_ >= kMaxChunkWords; }
  bool empty() const { return nodes_.empty(); }
  // The payload of the block; the builder is empty again.
  ByteWriter take();

 private:
  struct Entry {
    std::uint32_t position = 0;
    std::uint64_t word = 0;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };
  struct EntryHash {
    std::size_t operator()(const Entry& entry) const;
  };
  struct Node {
    CellKey key;
    std::int64_t root_id;
    std::uint32_t parent, frame, flags;
    NodeSizes sizes;
    Vec3 lo, hi;
  };
  using Frame = std::array<std::uint64_t, 12>;  // bit patterns: -0 and NaN are kept apart
  using Row = std::vector<std::uint32_t>;       // entries, in order of first use

  std::uint32_t frame_of(const Cell& cell);
  Row row_of(const VisibleSet& set);
  // Where each entry stands once the dictionary is sorted.
  std::vector<std::uint32_t> sorted_places(std::vector<Entry>& sorted) const;

  std::vector<Node> nodes_;
  std::map<Frame, std::uint32_t> frame_numbers_;
  std::vector<Frame> frames_;
  std::unordered_map<Entry, std::uint32_t, EntryHash> entry_numbers_;
  std::vector<Row> visible_, seen_;
  std::size_t words_held_ = 0;
};

}  // namespace pvsfarm
