#include "common/pvs/store_chunk.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/check.hpp"
#include "common/pvs/pvs_format.h"

namespace pvsfarm {

std::size_t ChunkBuilder::EntryHash::operator()(const Entry& entry) const {
  std::uint64_t h = (entry.word ^ entry.position * 0x9e3779b97f4a7c15ull) * 0xbf58476d1ce4e5b9ull;
  h ^= h >> 32;
  return static_cast<std::size_t>(h * 0x94d049bb133111ebull >> 7);
}

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

ChunkBuilder::Row ChunkBuilder::row_of(const VisibleSet& set) {
  Row row;
  const auto words = set.words();
  for (std::size_t position = 0; position < words.size(); ++position) {
    if (words[position] == 0) continue;
    const Entry entry{static_cast<std::uint32_t>(position), words[position]};
    const auto number = static_cast<std::uint32_t>(entry_numbers_.size());
    row.push_back(entry_numbers_.try_emplace(entry, number).first->second);
  }
  words_held_ += row.size();
  return row;
}

void ChunkBuilder::add(const StoreNode& node, std::uint32_t parent, const NodeSizes& sizes) {
  const LeafReason reason = !node.leaf         ? LeafReason::kNone
                            : node.quarantined ? LeafReason::kGivenUp
                                               : node.reason;
  PVS_CHECK_EQ(node.leaf, (reason != LeafReason::kNone));
  std::uint32_t flags = static_cast<std::uint32_t>(reason) << PVS_REASON_SHIFT;
  if (node.leaf) flags |= PVS_FLAG_LEAF;
  if (node.quarantined) flags |= PVS_FLAG_QUARANTINED;
  nodes_.push_back({node.key, node.root_id, parent, frame_of(node.cell), flags, sizes, node.cell.lo,
                    node.cell.hi});
  visible_.push_back(row_of(node.visible));
  seen_.push_back(row_of(node.seen));
}

std::vector<std::uint32_t> ChunkBuilder::sorted_places(std::vector<Entry>& sorted) const {
  std::vector<std::pair<Entry, std::uint32_t>> numbered(entry_numbers_.begin(),
                                                        entry_numbers_.end());
  std::sort(numbered.begin(), numbered.end());
  std::vector<std::uint32_t> places(numbered.size());
  for (std::size_t place = 0; place < numbered.size(); ++place) {
    places[numbered[place].second] = static_cast<std::uint32_t>(place);
    sorted.push_back(numbered[place].first);
  }
  return places;
}

ByteWriter ChunkBuilder::take() {
  std::vector<Entry> dictionary;
  const std::vector<std::uint32_t> places = sorted_places(dictionary);
  const bool any_seen =
      std::any_of(seen_.begin(), seen_.end(), [](const Row& row) { return !row.empty(); });

  // Rows: the gaps between ascending places. A row's words ascend by position, so its places do.
  ByteWriter rows;
  std::vector<std::uint32_t> row_ends;
  const auto put_rows = [&](const std::vector<Row>& set) {
    for (const Row& row : set) {
      std::uint32_t next = 0;
      for (const std::uint32_t number : row) {
        rows.put_varint(places[number] - next);
        next = places[number] + 1;
      }
      row_ends.push_back(static_cast<std::uint32_t>(rows.size()));
    }
  };
  put_rows(visible_);
  if (any_seen) put_rows(seen_);

  ByteWriter out;
  out.put_u32(static_cast<std::uint32_t>(nodes_.size()));
  out.put_u32(static_cast<std::uint32_t>(frames_.size()));
  out.put_u32(static_cast<std::uint32_t>(dictionary.size()));
  out.put_u32(any_seen ? 2 : 1);
  out.put_u32(static_cast<std::uint32_t>(rows.size()));
  out.put_u32(0);
  for (const Node& node : nodes_) {
    out.put_vec3(node.lo);
    out.put_vec3(node.hi);
    out.put_u64(static_cast<std::uint64_t>(node.root_id));
    out.put_u64(node.key.path);
    out.put_u32(node.key.root);
    out.put_u32(node.parent);
    out.put_u32(node.frame);
    out.put_u32(node.flags);
    out.put_u32(node.sizes.visible_objects);
    out.put_u32(node.sizes.visible_triangles);
    out.put_u32(node.sizes.seen_objects);
    out.put_u32(node.sizes.seen_triangles);
  }
  for (const Frame& frame : frames_)
    for (const std::uint64_t bits : frame) out.put_u64(bits);
  for (const Entry& entry : dictionary) out.put_u64(entry.word);
  for (const Entry& entry : dictionary) out.put_u32(entry.position);
  out.pad();
  for (const std::uint32_t end : row_ends) out.put_u32(end);
  out.pad();
  out.put_bytes(rows.bytes());
  out.pad();
  *this = ChunkBuilder();
  return out;
}

}  // namespace pvsfarm
