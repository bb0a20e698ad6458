#include "common/pvs/store_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"

namespace pvsfarm {

static_assert(static_cast<int>(LeafReason::kMerged) == PVS_REASON_MERGED &&
              static_cast<int>(LeafReason::kGivenUp) == PVS_REASON_GIVEN_UP &&
              kLeafReasonCount == PVS_REASON_MERGED + 1);

namespace {

Vec3 vec3_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

Digest digest_at(const unsigned char* bytes) {
  Digest digest;
  std::copy_n(bytes, digest.bytes.size(), digest.bytes.begin());
  return digest;
}

Error open_error(const std::string& path, pvs_status status, const pvs_damage& damage) {
  switch (status) {
    case PVS_CANNOT_READ:
      return io_error(path + ": cannot be read: " + std::strerror(errno));
    case PVS_NOT_A_STORE:
      return invalid_input(path +
                           ": is no .pvs store (its first bytes differ); name one that "
                           "`pvsfarm bake` wrote");
    case PVS_OTHER_VERSION:
      return {ErrorKind::kUnsupported, path + ": another version of the format than " +
                                           std::to_string(PVS_FORMAT_VERSION) +
                                           ", the one this program reads; bake it again"};
    case PVS_TRUNCATED:
      return invalid_input(path + ": truncated: its end is missing at byte " +
                           std::to_string(damage.offset) + "; copy it again or bake it again");
    default:
      return invalid_input(path + ": damaged: " + damage.what + " at byte " +
                           std::to_string(damage.offset) + "; copy it again or bake it again");
  }
}

}  // namespace

Result<std::unique_ptr<StoreReader>> StoreReader::open(const std::string& path) {
  std::unique_ptr<StoreReader> reader(new StoreReader);
  reader->path_ = path;
  reader->store_ = std::make_unique<pvs_store>();
  pvs_damage damage{};
  const pvs_status status = pvs_open_file(reader->store_.get(), path.c_str(), &damage);
  if (status != PVS_OK) return open_error(path, status, damage);
  const pvs_store& store = *reader->store_;
  const unsigned char* tail = store.bytes + store.size - PVS_TAIL_BYTES;
  reader->verified_.assign(store.block_count, false);
  reader->digest_ = digest_at(tail + PVS_TAIL_DIGEST);
  reader->header_ = {.up = store.up_is_y ? UpAxis::kY : UpAxis::kZ,
                     .scene_digest = digest_at(store.bytes + PVS_HEADER_SCENE_DIGEST),
                     .bake_digest = digest_at(store.bytes + PVS_HEADER_BAKE_DIGEST),
                     .settings_json = std::string(reinterpret_cast<const char*>(store.settings),
                                                  store.settings_bytes)};
  return reader;
}

StoreReader::~StoreReader() {
  if (store_) pvs_close(store_.get());
}

std::uint64_t StoreReader::file_bytes() const { return store_->size; }
std::uint32_t StoreReader::node_count() const { return store_->node_count; }
std::uint32_t StoreReader::leaf_count() const { return store_->leaf_count; }
std::uint32_t StoreReader::root_count() const { return store_->root_count; }
std::uint32_t StoreReader::object_count() const { return store_->object_count; }

StoreSizes StoreReader::sizes() const {
  StoreSizes sizes;
  for (std::uint32_t block = 0; block < store_->block_count; ++block) {
    const std::uint32_t kind = load_u32(entry_of(store_.get(), block) + PVS_ENTRY_KIND);
    if (kind != PVS_BLOCK_CHUNK) {
      if (kind == PVS_BLOCK_SUBTREES || kind == PVS_BLOCK_LOCATE)
        sizes.geometry_bytes += load_u64(entry_of(store_.get(), block) + PVS_ENTRY_LENGTH);
      continue;
    }
    std::uint64_t length = 0;
    const unsigned char* head = block_bytes(store_.get(), block, &length);
    const std::uint64_t geometry =
        length - std::min<std::uint64_t>(length, load_u32(head + PVS_CHUNK_GROUP_BYTES));
    sizes.geometry_bytes += geometry;
    sizes.set_bytes += length - geometry;
  }
  return sizes;
}

Error StoreReader::damage(const std::string& what, std::uint64_t offset_bytes) const {
  return invalid_input(path_ + ": damaged: " + what + " at byte " + std::to_string(offset_bytes) +
                       "; copy it again or bake it again");
}

Status StoreReader::verify(std::uint32_t block) {
  if (verified_[block]) return {};
  pvs_damage where{};
  if (pvs_verify_block(store_.get(), block, &where) != PVS_OK)
    return damage(where.what, where.offset);
  verified_[block] = true;
  return {};
}

Status StoreReader::verify_all() {
  for (std::uint32_t block = 0; block < store_->block_count; ++block)
    if (Status status = verify(block); !status) return status;
  return {};
}

Result<std::vector<StoreObject>> StoreReader::objects() {
  for (const std::uint32_t block : {1u, 2u})
    if (Status status = verify(block); !status) return status.error();
  std::vector<StoreObject> objects;
  objects.reserve(object_count());
  for (std::uint32_t id = 0; id < object_count(); ++id) {
    pvs_object_info info;
    if (pvs_object(store_.get(), id, &info) != PVS_OK)
      return damage("object " + std::to_string(id),
                    static_cast<std::uint64_t>(store_->objects - store_->bytes));
    objects.push_back({.name = {info.name, static_cast<std::size_t>(info.name_bytes)},
                       .box = {vec3_of(info.lo), vec3_of(info.hi)},
                       .triangle_count = info.triangles,
                       .file_index = info.file_index,
                       .occluder = (info.flags & PVS_FLAG_OCCLUDER) != 0,
                       .occludee = (info.flags & PVS_FLAG_OCCLUDEE) != 0,
                       .dynamic = (info.flags & PVS_FLAG_DYNAMIC) != 0});
  }
  return objects;
}

Status StoreReader::verify_node(std::uint32_t index) {
  PVS_CHECK_LT(index, node_count());
  if (Status status = verify(store_->block_count - 2); !status) return status;  // subtrees
  return verify(pvs_block_of_node(store_.get(), index));
}

Error StoreReader::node_damage(std::uint32_t index) const {
  std::uint64_t length = 0;
  const unsigned char* chunk =
      block_bytes(store_.get(), pvs_block_of_node(store_.get(), index), &length);
  return damage("cell " + std::to_string(index) + " of the chunk",
                static_cast<std::uint64_t>(chunk - store_->bytes));
}

Result<StoredNode> StoreReader::node(std::uint32_t index) {
  if (Status status = verify_node(index); !status) return status.error();
  pvs_node_info info;
  if (pvs_node(store_.get(), index, &info) != PVS_OK) return node_damage(index);
  return StoredNode{
      .index = index,
      .key = {info.root, info.path},
      .root_id = info.root_id,
      .parent = info.parent == PVS_NO_PARENT ? -1 : std::int64_t{info.parent},
      .end = info.end,
      .leaf = (info.flags & PVS_FLAG_LEAF) != 0,
      .quarantined = (info.flags & PVS_FLAG_QUARANTINED) != 0,
      .reason = static_cast<LeafReason>(info.reason),
      .visible = {info.visible_objects, info.visible_triangles},
      .seen = {info.seen_objects, info.seen_triangles},
      .cell = {.origin = vec3_of(info.origin),
               .axes = {vec3_of(info.axes[0]), vec3_of(info.axes[1]), vec3_of(info.axes[2])},
               .lo = vec3_of(info.lo),
               .hi = vec3_of(info.hi)}};
}

Result<StoredSets> StoreReader::sets(std::uint32_t index) {
  if (Status status = verify_node(index); !status) return status.error();
  const std::uint64_t end = std::min<std::uint64_t>(subtree_end(store_.get(), index), node_count());
  const std::uint32_t last = pvs_block_of_node(store_.get(), static_cast<std::uint32_t>(end - 1));
  for (std::uint32_t block = pvs_block_of_node(store_.get(), index); block <= last; ++block)
    if (Status status = verify(block); !status) return status.error();
  std::vector<std::uint64_t> visible(store_->word_count), seen(store_->word_count);
  scratch_.resize(pvs_scratch_words(store_.get()));
  if (pvs_read_sets(store_.get(), index, visible.data(), seen.data(), scratch_.data()) != PVS_OK)
    return node_damage(index);
  return StoredSets{VisibleSet::from_words(object_count(), std::move(visible)),
                    VisibleSet::from_words(object_count(), std::move(seen))};
}

Result<std::vector<std::uint32_t>> StoreReader::leaves_at(const Vec3& point) {
  // Which blocks the search touches is known only after it; a damaged one could hide a cell.
  if (Status status = verify_all(); !status) return status.error();
  const Vec3 in_file = file_from_internal(header_.up, point);
  const double p[3] = {in_file.x, in_file.y, in_file.z};
  constexpr std::uint32_t kUsual = 16;  // cells that share a point
  std::uint32_t count = 0;
  std::vector<std::uint32_t> cells(kUsual);
  pvs_status status = pvs_find(store_.get(), p, cells.data(), kUsual, &count);
  const bool more = count > kUsual;
  cells.resize(count);
  if (status == PVS_OK && more) status = pvs_find(store_.get(), p, cells.data(), count, &count);
  if (status != PVS_OK)
    return damage("the location of points",
                  static_cast<std::uint64_t>(store_->locate_roots - store_->bytes));
  return cells;
}

std::uint64_t triangles_of(const VisibleSet& set, const std::vector<StoreObject>& objects) {
  std::uint64_t sum = 0;
  set.for_each([&](ObjectId id) { sum += objects[index_of(id)].triangle_count; });
  return sum;
}

}  // namespace pvsfarm
