#include "common/pvs/store_chunk.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/check.hpp"
#include "common/pvs/pvs_format.h"
#include "common/pvs/pvs_sets.h"

namespace pvsfarm {
namespace {

static_assert(PVS_NODE_FIELDS == 16 && PVS_NODE_BOX == 0);

// What pvs_group points to.
struct Rows {
  std::vector<std::uint32_t> members;
  std::size_t words = 0;
  std::vector<std::uint64_t> visible, seen, work;
};

}  // namespace

std::uint32_t ChunkBuilder::frame_of(const Cell& cell) {
  static const Cell kAligned;
  const auto bits_of = [](const Cell& c) {
    Frame frame;
    for (int a = 0; a < 3; ++a) {
      frame[a] = std::bit_cast<std::uint64_t>(c.origin[a]);
      for (int b = 0; b < 3; ++b) frame[3 + 3 * a + b] = std::bit_cast<std::uint64_t>(c.axes[a][b]);
    }
    return frame;
  };
  const Frame frame = bits_of(cell);
  if (frame == bits_of(kAligned)) return 0;
  const auto [at, is_new] =
      frame_numbers_.try_emplace(frame, static_cast<std::uint32_t>(frames_.size() + 1));
  if (is_new) frames_.push_back(frame);
  return at->second;
}

void ChunkBuilder::add(const StoreNode& node, std::uint32_t index, std::uint32_t parent,
                       const NodeSizes& sizes) {
  const LeafReason reason = !node.leaf         ? LeafReason::kNone
                            : node.quarantined ? LeafReason::kGivenUp
                                               : node.reason;
  PVS_CHECK_EQ(node.leaf, (reason != LeafReason::kNone));
  std::uint32_t flags = static_cast<std::uint32_t>(reason) * PVS_FIELD_REASON;
  if (node.leaf) flags |= PVS_FLAG_LEAF;
  if (node.quarantined) flags |= PVS_FLAG_QUARANTINED;
  Node made{};
  made.fields[PVS_NODE_ROOT_ID] = static_cast<std::uint64_t>(node.root_id);
  made.fields[PVS_NODE_PATH] = node.key.path;
  made.fields[PVS_NODE_ROOT] = node.key.root;
  made.fields[PVS_NODE_PARENT] = parent == PVS_NO_PARENT ? 0 : index - parent;
  made.fields[PVS_NODE_FRAME] = frame_of(node.cell);
  made.fields[PVS_NODE_FLAGS] = flags;
  made.fields[PVS_NODE_VISIBLE_OBJECTS] = sizes.visible_objects;
  made.fields[PVS_NODE_VISIBLE_TRIANGLES] = sizes.visible_triangles;
  made.fields[PVS_NODE_SEEN_OBJECTS] = sizes.seen_objects;
  made.fields[PVS_NODE_SEEN_TRIANGLES] = sizes.seen_triangles;
  for (int a = 0; a < 3; ++a) {
    made.box[a] = node.cell.lo[a];
    made.box[3 + a] = node.cell.hi[a];
  }
  const auto visible = node.visible.words(), seen = node.seen.words();
  made.leaf = node.leaf;
  // What is not visible is not kept: it could not be told.
  for (std::size_t position = 0; node.leaf && position < visible.size(); ++position)
    if (visible[position] != 0)
      made.words.push_back({static_cast<std::uint32_t>(position), visible[position],
                            visible[position] & seen[position]});
  universe_ = node.visible.universe();
  words_held_ += made.words.size();
  leaf_count_ += node.leaf ? 1 : 0;
  has_seen_ = has_seen_ || (node.leaf && sizes.seen_objects > 0);
  nodes_.push_back(std::move(made));
}

std::vector<std::uint64_t> ChunkBuilder::number_coordinates() {
  std::vector<std::uint64_t> coordinates;
  for (const Node& node : nodes_)
    for (const double v : node.box) coordinates.push_back(std::bit_cast<std::uint64_t>(v));
  std::sort(coordinates.begin(), coordinates.end());
  coordinates.erase(std::unique(coordinates.begin(), coordinates.end()), coordinates.end());
  for (Node& node : nodes_)
    for (std::size_t a = 0; a < node.box.size(); ++a)
      node.fields[PVS_NODE_BOX + a] =
          static_cast<std::uint64_t>(std::lower_bound(coordinates.begin(), coordinates.end(),
                                                      std::bit_cast<std::uint64_t>(node.box[a])) -
                                     coordinates.begin());
  return coordinates;
}

void ChunkBuilder::put_columns(ByteWriter& heads, ByteWriter& numbers) const {
  for (std::size_t field = 0; field < PVS_NODE_FIELDS; ++field) {
    std::vector<std::uint64_t> column;
    for (const Node& node : nodes_)
      if (node.leaf || field < PVS_LEAF_FIELDS) column.push_back(node.fields[field]);
    // Signed, as ids of roots are: differences are right modulo 2^64 either way.
    const auto less = [](std::uint64_t a, std::uint64_t b) {
      return static_cast<std::int64_t>(a) < static_cast<std::int64_t>(b);
    };
    std::uint64_t base = 0, most = 0;
    if (!column.empty()) {
      base = *std::min_element(column.begin(), column.end(), less);
      most = *std::max_element(column.begin(), column.end(), less);
    }
    for (std::uint64_t& number : column) number -= base;
    const int width = std::bit_width(most - base);
    heads.put_u64(base);
    heads.put_u32(static_cast<std::uint32_t>(width));
    heads.put_u32(0);
    numbers.put_bits(column, width);
  }
  numbers.pad();
}

void ChunkBuilder::put_group(std::span<const Node* const> leaves, ByteWriter& out) const {
  // 1. Who is in it.
  std::map<std::uint32_t, std::uint64_t> word_at;
  for (const Node* leaf : leaves)
    for (const Word& word : leaf->words) word_at[word.position] |= word.visible;
  std::map<std::uint32_t, std::uint32_t> number_of_first;  // of each word's members
  Rows rows;
  for (const auto& [position, word] : word_at) {
    number_of_first[position] = static_cast<std::uint32_t>(rows.members.size());
    for (std::uint64_t rest = word; rest != 0; rest &= rest - 1)
      rows.members.push_back(position * 64 + static_cast<std::uint32_t>(std::countr_zero(rest)));
  }

  // 2. Seen by which of its leaves.
  rows.words = (rows.members.size() + 63) / 64;
  rows.visible.resize(leaves.size() * rows.words);
  rows.seen.resize(leaves.size() * rows.words);
  rows.work.resize(3 * rows.words);
  for (std::size_t i = 0; i < leaves.size(); ++i)
    for (const Word& word : leaves[i]->words) {
      std::size_t number = number_of_first.at(word.position);
      for (std::uint64_t rest = word_at.at(word.position); rest != 0; rest &= rest - 1, ++number) {
        const int bit = std::countr_zero(rest);
        const std::size_t at = i * rows.words + number / 64;
        rows.visible[at] |= (word.visible >> bit & 1) << (number % 64);
        rows.seen[at] |= (word.seen >> bit & 1) << (number % 64);
      }
    }

  // 3. As bits. A turn costs no more than two runs, and no run more than this.
  pvs_group group{};
  group.leaves = static_cast<std::uint32_t>(leaves.size());
  group.object_count = universe_;
  group.has_seen = has_seen_ ? 1 : 0;
  group.member_count = static_cast<std::uint32_t>(rows.members.size());
  group.word_count = static_cast<std::uint32_t>(rows.words);
  group.members = rows.members.data();
  group.visible = rows.visible.data();
  group.seen = rows.seen.data();
  group.work = rows.work.data();
  std::vector<std::byte> bytes(4096);
  for (;; bytes.resize(2 * bytes.size())) {
    auto* const begin = reinterpret_cast<unsigned char*>(bytes.data());
    const unsigned char* const end = pvs_write_group(&group, begin, begin + bytes.size());
    if (end == nullptr) continue;
    out.put_bytes(std::span(bytes).first(static_cast<std::size_t>(end - begin)));
    return;
  }
}

ByteWriter ChunkBuilder::take() {
  const std::vector<std::uint64_t> coordinates = number_coordinates();
  std::vector<const Node*> leaves;
  std::vector<std::uint64_t> leaf_bits;
  for (const Node& node : nodes_) {
    leaf_bits.push_back(node.leaf ? 1 : 0);
    if (node.leaf) leaves.push_back(&node);
  }
  ByteWriter groups;
  std::vector<std::uint32_t> ends;
  for (std::size_t first = 0; first < leaves.size(); first += PVS_GROUP_LEAVES) {
    const std::size_t count = std::min<std::size_t>(PVS_GROUP_LEAVES, leaves.size() - first);
    put_group(std::span(leaves).subspan(first, count), groups);
    ends.push_back(static_cast<std::uint32_t>(groups.size()));
  }

  ByteWriter out, numbers;
  out.put_u32(static_cast<std::uint32_t>(nodes_.size()));
  out.put_u32(static_cast<std::uint32_t>(frames_.size()));
  out.put_u32(static_cast<std::uint32_t>(coordinates.size()));
  out.put_u32(has_seen_ ? 2 : 1);
  out.put_u32(static_cast<std::uint32_t>(groups.size()));
  out.put_u32(leaf_count_);
  put_columns(out, numbers);
  out.put_bits(leaf_bits, 1);
  out.pad();
  out.put_bytes(numbers.bytes());
  for (const Frame& frame : frames_)
    for (const std::uint64_t bits : frame) out.put_u64(bits);
  for (const std::uint64_t bits : coordinates) out.put_u64(bits);
  for (const std::uint32_t end : ends) out.put_u32(end);
  out.pad();
  out.put_bytes(groups.bytes());
  out.pad();
  *this = ChunkBuilder();
  return out;
}

}  // namespace pvsfarm
