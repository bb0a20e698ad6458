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

// A word's bits, node by node: what pvs_group::rows holds of its objects.
struct Members {
  std::vector<std::uint32_t> ids, rows;
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
  for (std::size_t position = 0; position < visible.size(); ++position)
    if ((visible[position] | seen[position]) != 0)
      made.words.push_back(
          {static_cast<std::uint32_t>(position), visible[position], seen[position]});
  universe_ = node.visible.universe();
  words_held_ += made.words.size();
  has_seen_ = has_seen_ || sizes.seen_objects > 0;
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
    // Signed, as ids of roots are: differences are right modulo 2^64 either way.
    const auto less = [field](const Node& a, const Node& b) {
      return static_cast<std::int64_t>(a.fields[field]) <
             static_cast<std::int64_t>(b.fields[field]);
    };
    const auto [least, most] = std::minmax_element(nodes_.begin(), nodes_.end(), less);
    const std::uint64_t base = least->fields[field];
    const int width = ByteWriter::width_of(most->fields[field] - base);
    heads.put_u64(base);
    heads.put_u32(static_cast<std::uint32_t>(width));
    heads.put_u32(0);
    for (const Node& node : nodes_) numbers.put_number(node.fields[field] - base, width);
  }
  numbers.pad();
}

void ChunkBuilder::put_group(std::span<const Node> nodes, bool has_seen, ByteWriter& out) const {
  // 1. Who is in it, and seen by which of its nodes.
  std::map<std::uint32_t, std::array<std::uint32_t, 64>> rows_of_word;
  pvs_group group{};
  group.nodes = static_cast<std::uint32_t>(nodes.size());
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const std::uint64_t back = nodes[i].fields[PVS_NODE_PARENT];
    group.parent[i] =
        static_cast<unsigned char>(back > 0 && back <= i ? i - back : PVS_NOT_IN_GROUP);
    for (const Word& word : nodes[i].words) {
      auto& rows = rows_of_word[word.position];
      for (std::uint64_t rest = word.visible | word.seen; rest != 0; rest &= rest - 1) {
        const int bit = std::countr_zero(rest);
        rows[static_cast<std::size_t>(bit)] |=
            static_cast<std::uint32_t>(word.visible >> bit & 1) << i |
            static_cast<std::uint32_t>(word.seen >> bit & 1) << (16 + i);
      }
    }
  }
  Members members;
  for (const auto& [position, rows] : rows_of_word)
    for (std::uint32_t bit = 0; bit < 64; ++bit) {
      if (rows[bit] == 0) continue;
      members.ids.push_back(position * 64 + bit);
      members.rows.push_back(rows[bit]);
    }

  // 2. As bits. None costs more than two bytes.
  group.object_count = universe_;
  group.has_seen = has_seen ? 1 : 0;
  group.member_count = static_cast<std::uint32_t>(members.ids.size());
  group.members = members.ids.data();
  group.rows = members.rows.data();
  std::vector<std::byte> bytes(64 + members.ids.size() * (64 + 2 * nodes.size()) * 2);
  auto* const begin = reinterpret_cast<unsigned char*>(bytes.data());
  pvs_coder coder;
  pvs_coder_write(&coder, begin, begin + bytes.size());
  pvs_code_group(&coder, &group, group.nodes - 1);
  const unsigned char* const end = pvs_coder_finish(&coder);
  PVS_CHECK_EQ(coder.overflow, 0);
  out.put_bytes(std::span(bytes).first(static_cast<std::size_t>(end - begin)));
}

ByteWriter ChunkBuilder::take() {
  const std::vector<std::uint64_t> coordinates = number_coordinates();
  ByteWriter groups;
  std::vector<std::uint32_t> ends;
  for (std::size_t first = 0; first < nodes_.size(); first += PVS_GROUP_NODES) {
    const std::size_t count = std::min<std::size_t>(PVS_GROUP_NODES, nodes_.size() - first);
    put_group(std::span(nodes_).subspan(first, count), has_seen_, groups);
    ends.push_back(static_cast<std::uint32_t>(groups.size()));
  }

  ByteWriter out, numbers;
  out.put_u32(static_cast<std::uint32_t>(nodes_.size()));
  out.put_u32(static_cast<std::uint32_t>(frames_.size()));
  out.put_u32(static_cast<std::uint32_t>(coordinates.size()));
  out.put_u32(has_seen_ ? 2 : 1);
  out.put_u32(static_cast<std::uint32_t>(groups.size()));
  out.put_u32(0);
  put_columns(out, numbers);
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
