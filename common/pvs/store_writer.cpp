#include "common/pvs/store_writer.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "common/base/atomic_file.hpp"
#include "common/pvs/pvs_reader.h"
#include "common/pvs/store_bytes.hpp"
#include "common/pvs/store_chunk.hpp"
#include "common/pvs/store_locate.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxSettingsBytes = std::size_t{1} << 20;

std::span<const std::byte> bytes_of(const Digest& digest) {
  return std::as_bytes(std::span(digest.bytes));
}

std::uint32_t flags_of(const StoreObject& object) {
  std::uint32_t flags = 0;
  if (object.occluder) flags |= PVS_FLAG_OCCLUDER;
  if (object.occludee) flags |= PVS_FLAG_OCCLUDEE;
  if (object.dynamic) flags |= PVS_FLAG_DYNAMIC;
  return flags;
}

// Memory: one chunk, 4 bytes a node, 28 a root and 4 an object.
class FileStoreWriter : public StoreWriter {
 public:
  FileStoreWriter(std::unique_ptr<AtomicFile> file, std::uint32_t object_count)
      : file_(std::move(file)), object_count_(object_count) {}

  Status begin(const StoreHeader& header, std::span<const StoreObject> objects);
  Status add(const StoreNode& node) override;
  Status finish() override;

 private:
  struct Ancestor {
    CellKey key;
    std::uint32_t node = 0;
    bool leaf = false;
  };

  std::uint32_t node_count() const { return static_cast<std::uint32_t>(subtree_ends_.size()); }
  // Closes the subtrees that do not hold `key`; the last left open, if any, is its parent.
  void close_subtrees_before(const CellKey* key);
  Status put(std::span<const std::byte> data);
  Status put_block(std::uint32_t kind, std::uint32_t first_node, ByteWriter payload);
  NodeSizes sizes_of(const StoreNode& node) const;
  Status put_chunk();
  Status put_subtrees();
  Status put_directory_and_tail();

  std::unique_ptr<AtomicFile> file_;
  std::uint32_t object_count_;
  std::vector<std::uint32_t> triangle_counts_;  // by object
  DigestBuilder digest_;
  ByteWriter directory_;
  std::uint32_t block_count_ = 0, leaf_count_ = 0;
  ChunkBuilder chunk_;
  std::uint32_t chunk_first_node_ = 0;
  std::vector<std::uint32_t> subtree_ends_;
  std::vector<Ancestor> open_;
  LocateBuilder locate_;
};

Status FileStoreWriter::put(std::span<const std::byte> data) {
  digest_.add(data);
  return file_->write(data);
}

Status FileStoreWriter::put_block(std::uint32_t kind, std::uint32_t first_node,
                                  ByteWriter payload) {
  payload.pad();
  directory_.put_u32(kind);
  directory_.put_u32(first_node);
  directory_.put_u64(file_->size_bytes());
  directory_.put_u64(payload.size());
  directory_.put_u64(pvs_checksum(payload.bytes().data(), payload.size()));
  ++block_count_;
  return put(payload.bytes());
}

Status FileStoreWriter::begin(const StoreHeader& header, std::span<const StoreObject> objects) {
  ByteWriter head;
  head.put_bytes(std::as_bytes(std::span(PVS_HEAD_MAGIC, 8)));
  head.put_u32(PVS_FORMAT_VERSION);
  head.put_u32(header.up == UpAxis::kY ? 1 : 0);
  head.put_u32(object_count_);
  head.put_u32(static_cast<std::uint32_t>(header.settings_json.size()));
  head.put_bytes(bytes_of(header.scene_digest));
  head.put_bytes(bytes_of(header.bake_digest));
  head.put_bytes(std::as_bytes(std::span(header.settings_json)));
  if (Status status = put_block(PVS_BLOCK_HEADER, 0, std::move(head)); !status) return status;

  ByteWriter records, names;
  for (const StoreObject& object : objects) {
    names.put_bytes(std::as_bytes(std::span(object.name)));
    records.put_vec3(object.box.lo);
    records.put_vec3(object.box.hi);
    records.put_u64(names.size());
    records.put_u32(object.triangle_count);
    triangle_counts_.push_back(object.triangle_count);
    records.put_u32(object.file_index);
    records.put_u32(flags_of(object));
    records.put_u32(0);
  }
  if (Status status = put_block(PVS_BLOCK_OBJECTS, 0, std::move(records)); !status) return status;
  return put_block(PVS_BLOCK_NAMES, 0, std::move(names));
}

void FileStoreWriter::close_subtrees_before(const CellKey* key) {
  while (!open_.empty()) {
    const Ancestor& last = open_.back();
    if (key != nullptr && last.key.root == key->root && last.key.depth() < key->depth() &&
        key->path >> (key->depth() - last.key.depth()) == last.key.path)
      return;
    subtree_ends_[last.node] = node_count();
    PVS_CHECK_EQ(last.leaf, (subtree_ends_[last.node] == last.node + 1));
    open_.pop_back();
  }
}

Status FileStoreWriter::add(const StoreNode& node) {
  PVS_CHECK_EQ(node.visible.universe(), object_count_);
  PVS_CHECK_EQ(node.seen.universe(), object_count_);
  if (!open_.empty()) PVS_CHECK(open_.back().key < node.key);
  close_subtrees_before(&node.key);
  const std::uint32_t index = node_count();
  std::uint32_t parent = PVS_NO_PARENT;
  if (node.key.is_root()) {
    locate_.add(node.cell, index);
  } else {
    PVS_CHECK(!open_.empty() && open_.back().key == node.key.parent());
    parent = open_.back().node;
  }
  if (index == PVS_MAX_NODES)
    return Error{ErrorKind::kUnsupported, "a store holds at most 4,294,967,294 cells"};
  subtree_ends_.push_back(0);
  open_.push_back({node.key, index, node.leaf});
  leaf_count_ += node.leaf ? 1 : 0;
  chunk_.add(node, index, parent, sizes_of(node));
  return chunk_.full() ? put_chunk() : Status();
}

NodeSizes FileStoreWriter::sizes_of(const StoreNode& node) const {
  const auto triangles = [&](const VisibleSet& set) {
    std::uint64_t sum = 0;
    set.for_each([&](ObjectId id) { sum += triangle_counts_[index_of(id)]; });
    PVS_CHECK_LE(sum, 0xffffffffu);  // a scene has at most 2^31
    return static_cast<std::uint32_t>(sum);
  };
  return {node.visible.count(), triangles(node.visible), node.seen.count(), triangles(node.seen)};
}

Status FileStoreWriter::put_chunk() {
  const std::uint32_t first_node = std::exchange(chunk_first_node_, node_count());
  return put_block(PVS_BLOCK_CHUNK, first_node, chunk_.take());
}

Status FileStoreWriter::put_subtrees() {
  std::uint64_t greatest = 0;
  const auto descendants = [&](std::size_t node) { return subtree_ends_[node] - node - 1; };
  for (std::size_t node = 0; node < subtree_ends_.size(); ++node)
    greatest = std::max(greatest, descendants(node));
  const int width = ByteWriter::width_of(greatest);
  ByteWriter out;
  out.put_u32(static_cast<std::uint32_t>(width));
  out.put_u32(0);
  for (std::size_t node = 0; node < subtree_ends_.size(); ++node)
    out.put_number(descendants(node), width);
  return put_block(PVS_BLOCK_SUBTREES, 0, std::move(out));
}

Status FileStoreWriter::put_directory_and_tail() {
  ByteWriter tail;
  tail.put_u64(file_->size_bytes());
  tail.put_u64(pvs_checksum(directory_.bytes().data(), directory_.size()));
  tail.put_u32(block_count_);
  tail.put_u32(node_count());
  tail.put_u32(leaf_count_);
  tail.put_u32(0);
  if (Status status = put(directory_.bytes()); !status) return status;
  tail.put_bytes(bytes_of(digest_.add(tail.bytes()).finish()));
  tail.put_u64(pvs_checksum(tail.bytes().data(), tail.size()));
  tail.put_bytes(std::as_bytes(std::span(PVS_TAIL_MAGIC, 8)));
  return file_->write(tail.bytes());
}

Status FileStoreWriter::finish() {
  close_subtrees_before(nullptr);
  if (!chunk_.empty())
    if (Status status = put_chunk(); !status) return status;
  if (Status status = put_subtrees(); !status) return status;
  if (Status status = put_block(PVS_BLOCK_LOCATE, 0, locate_.take()); !status) return status;
  if (Status status = put_directory_and_tail(); !status) return status;
  return file_->commit();
}

}  // namespace

Result<std::unique_ptr<StoreWriter>> StoreWriter::create(const std::string& path,
                                                         const StoreHeader& header,
                                                         std::span<const StoreObject> objects) {
  PVS_CHECK_LE(objects.size(), PVS_MAX_OBJECTS);
  PVS_CHECK_LE(header.settings_json.size(), kMaxSettingsBytes);
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  auto writer = std::make_unique<FileStoreWriter>(std::move(*file),
                                                  static_cast<std::uint32_t>(objects.size()));
  if (Status status = writer->begin(header, objects); !status) return status.error();
  return std::unique_ptr<StoreWriter>(std::move(writer));
}

Result<std::unique_ptr<StoreWriter>> StoreWriter::create(const std::string& path,
                                                         const StoreHeader& header,
                                                         const Scene& scene) {
  std::vector<StoreObject> objects;
  for (std::uint32_t i = 0; i < scene.object_count(); ++i) {
    const ObjectRecord& record = scene.object(ObjectId{i});
    objects.push_back({.name = scene.name(ObjectId{i}),
                       .box = record.box,
                       .triangle_count = record.triangle_count,
                       .file_index = record.file_index,
                       .occluder = record.occluder != 0,
                       .occludee = record.occludee != 0,
                       .dynamic = record.dynamic != 0});
  }
  return create(path, header, objects);
}

}  // namespace pvsfarm
