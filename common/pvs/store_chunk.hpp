// Builds one chunk of a store: a run of nodes as columns of numbers, and the sets of its leaves in
// groups of 32 (docs/store_format.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/pvs/store_bytes.hpp"
#include "common/pvs/store_writer.hpp"

namespace pvsfarm {

// What bounds the writer's memory.
inline constexpr std::uint32_t kMaxChunkNodes = 1024;
inline constexpr std::size_t kMaxChunkWords = std::size_t{1} << 20;  // non-zero, of all its sets

// What a leaf says of its sets without their rows.
struct NodeSizes {
  std::uint32_t visible_objects = 0, visible_triangles = 0;
  std::uint32_t seen_objects = 0, seen_triangles = 0;
};

class ChunkBuilder {
 public:
  // `index`: of the node in the store; `parent`: likewise, or PVS_NO_PARENT.
  void add(const StoreNode& node, std::uint32_t index, std::uint32_t parent,
           const NodeSizes& sizes);
  bool full() const { return nodes_.size() >= kMaxChunkNodes || words_held_ >= kMaxChunkWords; }
  bool empty() const { return nodes_.empty(); }
  // The payload of the block; the builder is empty again.
  ByteWriter take();

 private:
  struct Word {
    std::uint32_t position = 0;
    std::uint64_t visible = 0, seen = 0;
  };
  struct Node {
    std::array<std::uint64_t, 16> fields;  // of the format, in its order, but for the box
    std::array<double, 6> box;
    std::vector<Word> words;  // of a leaf: where its set holds anything
    bool leaf = false;
  };
  using Frame = std::array<std::uint64_t, 12>;  // bit patterns: -0 and NaN are kept apart

  std::uint32_t frame_of(const Cell& cell);
  // The distinct bit patterns of all boxes, ascending, and each box as numbers of them.
  std::vector<std::uint64_t> number_coordinates();
  void put_columns(ByteWriter& heads, ByteWriter& numbers) const;
  void put_group(std::span<const Node* const> leaves, ByteWriter& out) const;

  std::vector<Node> nodes_;
  std::uint32_t universe_ = 0;
  std::map<Frame, std::uint32_t> frame_numbers_;
  std::vector<Frame> frames_;
  std::size_t words_held_ = 0;
  std::uint32_t leaf_count_ = 0;
  bool has_seen_ = false;
};

}  // namespace pvsfarm
