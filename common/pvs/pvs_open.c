/* Opening and checking a store. */
#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"

static pvs_status fail(pvs_status status, pvs_damage* damage, uint64_t offset, const char* what) {
  if (damage != NULL) {
    damage->offset = offset;
    damage->what = what;
  }
  return status;
}

static const char* name_of(uint32_t kind) {
  switch (kind) {
    case PVS_BLOCK_HEADER:
      return "the header";
    case PVS_BLOCK_OBJECTS:
      return "the objects";
    case PVS_BLOCK_NAMES:
      return "the names of objects";
    case PVS_BLOCK_CHUNK:
      return "a chunk of cells";
    case PVS_BLOCK_SUBTREES:
      return "the subtrees";
    case PVS_BLOCK_LOCATE:
      return "the location of points";
    default:
      return "a block of unknown kind";
  }
}

/* The tail, whole and with its checksum: from here on the directory can be trusted. */
static pvs_status open_tail(pvs_store* s, pvs_damage* damage) {
  const uint64_t tail_offset = s->size - PVS_TAIL_BYTES;
  const unsigned char* tail = s->bytes + tail_offset;
  uint64_t directory_offset;
  if (memcmp(tail + PVS_TAIL_END_MAGIC, PVS_TAIL_MAGIC, 8) != 0)
    return fail(PVS_TRUNCATED, damage, s->size, "the end");
  if (load_u64(tail + PVS_TAIL_CHECKSUM) != pvs_checksum(tail, PVS_TAIL_CHECKSUM))
    return fail(PVS_DAMAGED, damage, tail_offset, "the tail");
  directory_offset = load_u64(tail + PVS_TAIL_DIRECTORY_OFFSET);
  s->block_count = load_u32(tail + PVS_TAIL_BLOCKS);
  s->node_count = load_u32(tail + PVS_TAIL_NODES);
  s->leaf_count = load_u32(tail + PVS_TAIL_LEAVES);
  if (directory_offset > tail_offset ||
      tail_offset - directory_offset != (uint64_t)s->block_count * PVS_ENTRY_BYTES ||
      s->node_count > PVS_MAX_NODES || load_u32(tail + 28) != 0)
    return fail(PVS_DAMAGED, damage, tail_offset, "the tail");
  s->directory = s->bytes + directory_offset;
  if (load_u64(tail + PVS_TAIL_DIRECTORY_CHECKSUM) !=
      pvs_checksum(s->directory, (size_t)(tail_offset - directory_offset)))
    return fail(PVS_DAMAGED, damage, directory_offset, "the directory");
  return PVS_OK;
}

/* Blocks stand one behind the other, in the order of their kinds, and fill the file. */
static pvs_status check_directory(pvs_store* s, pvs_damage* damage) {
  static const uint32_t kFirst[3] = {PVS_BLOCK_HEADER, PVS_BLOCK_OBJECTS, PVS_BLOCK_NAMES};
  const uint64_t directory_offset = (uint64_t)(s->directory - s->bytes);
  uint64_t offset = 0;
  uint32_t block, next_node = 0;
  if (s->block_count < 5) return fail(PVS_DAMAGED, damage, directory_offset, "the directory");
  s->chunk_count = s->block_count - 5;
  for (block = 0; block < s->block_count; ++block) {
    const unsigned char* entry = entry_of(s, block);
    const uint32_t kind = load_u32(entry + PVS_ENTRY_KIND);
    const uint32_t first_node = load_u32(entry + PVS_ENTRY_FIRST_NODE);
    const uint64_t length = load_u64(entry + PVS_ENTRY_LENGTH);
    const uint32_t expected = block < 3                     ? kFirst[block]
                              : block == s->block_count - 2 ? PVS_BLOCK_SUBTREES
                              : block == s->block_count - 1 ? PVS_BLOCK_LOCATE
                                                            : PVS_BLOCK_CHUNK;
    int ok = kind == expected && load_u64(entry + PVS_ENTRY_OFFSET) == offset &&
             length <= directory_offset - offset && length % 8 == 0;
    if (kind == PVS_BLOCK_CHUNK) {
      ok = ok && length >= PVS_CHUNK_HEAD_BYTES && first_node < s->node_count &&
           (block == 3 ? first_node == 0 : first_node > next_node);
      next_node = first_node;
    } else {
      ok = ok && first_node == 0;
    }
    if (!ok)
      return fail(PVS_DAMAGED, damage, directory_offset + (uint64_t)block * PVS_ENTRY_BYTES,
                  "the directory");
    offset += length;
  }
  if (offset != directory_offset || (s->node_count > 0) != (s->chunk_count > 0))
    return fail(PVS_DAMAGED, damage, directory_offset, "the directory");
  return PVS_OK;
}

static pvs_status open_header(pvs_store* s, pvs_damage* damage) {
  uint64_t length;
  const unsigned char* header = block_bytes(s, 0, &length);
  uint32_t up;
  if (length < PVS_HEADER_SETTINGS) return fail(PVS_DAMAGED, damage, 0, "the header");
  if (pvs_verify_block(s, 0, damage) != PVS_OK) return PVS_DAMAGED;
  up = load_u32(header + PVS_HEADER_UP);
  s->up_is_y = up == 1;
  s->object_count = load_u32(header + PVS_HEADER_OBJECT_COUNT);
  s->word_count = s->object_count / 64 + (s->object_count % 64 != 0);
  s->settings = header + PVS_HEADER_SETTINGS;
  s->settings_bytes = load_u32(header + PVS_HEADER_SETTINGS_BYTES);
  if (up > 1 || s->object_count > PVS_MAX_OBJECTS ||
      padded(PVS_HEADER_SETTINGS + (uint64_t)s->settings_bytes) != length)
    return fail(PVS_DAMAGED, damage, 0, "the header");
  return PVS_OK;
}

/* The blocks whose places are kept; their sizes follow from the counts. */
static pvs_status open_tables(pvs_store* s, pvs_damage* damage) {
  uint64_t length, expected, boxes;
  uint32_t block = s->block_count - 1, level;
  const unsigned char* locate = block_bytes(s, block, &length);
  if (length < PVS_LOCATE_HEAD_BYTES)
    return fail(PVS_DAMAGED, damage, 0, name_of(PVS_BLOCK_LOCATE));
  s->root_count = load_u32(locate + PVS_LOCATE_ROOTS);
  s->locate_roots = locate + PVS_LOCATE_HEAD_BYTES;
  expected = PVS_LOCATE_HEAD_BYTES + padded((uint64_t)s->root_count * 4);
  s->locate_levels = 0;
  for (boxes = s->root_count; boxes > 0;) {
    boxes = (boxes + PVS_LOCATE_FANOUT - 1) / PVS_LOCATE_FANOUT;
    level = s->locate_levels++;
    s->locate_boxes[level] = locate + (expected < length ? expected : 0);
    expected += boxes * PVS_LOCATE_BOX_BYTES;
    if (boxes == 1) break;
  }
  if (length != expected || load_u32(locate + 4) != 0)
    return fail(PVS_DAMAGED, damage, (uint64_t)(locate - s->bytes), name_of(PVS_BLOCK_LOCATE));

  s->subtrees = block_bytes(s, block - 1, &length);
  s->subtree_width = length < PVS_SUBTREES_HEAD_BYTES ? 5 : load_u32(s->subtrees);
  if (s->subtree_width > 4 ||
      length != PVS_SUBTREES_HEAD_BYTES + padded((uint64_t)s->node_count * s->subtree_width))
    return fail(PVS_DAMAGED, damage, (uint64_t)(s->subtrees - s->bytes),
                name_of(PVS_BLOCK_SUBTREES));
  s->subtrees += PVS_SUBTREES_HEAD_BYTES;

  s->objects = block_bytes(s, 1, &length);
  s->names = block_bytes(s, 2, &s->name_bytes);
  if (length != (uint64_t)s->object_count * PVS_OBJECT_BYTES)
    return fail(PVS_DAMAGED, damage, (uint64_t)(s->objects - s->bytes), name_of(PVS_BLOCK_OBJECTS));
  return PVS_OK;
}

pvs_status pvs_open_memory(pvs_store* s, const void* bytes, size_t size, pvs_damage* damage) {
  pvs_status status;
  memset(s, 0, sizeof *s);
  s->bytes = (const unsigned char*)bytes;
  s->size = size;
  if (size < 8 || memcmp(s->bytes, PVS_HEAD_MAGIC, 8) != 0)
    return fail(PVS_NOT_A_STORE, damage, 0, "the first eight bytes");
  if (size < PVS_HEADER_SETTINGS + PVS_TAIL_BYTES)
    return fail(PVS_TRUNCATED, damage, size, "the end");
  if (load_u32(s->bytes + PVS_HEADER_VERSION) != PVS_FORMAT_VERSION)
    return fail(PVS_OTHER_VERSION, damage, PVS_HEADER_VERSION, "the version");
  status = open_tail(s, damage);
  if (status == PVS_OK) status = check_directory(s, damage);
  if (status == PVS_OK) status = open_header(s, damage);
  if (status == PVS_OK) status = open_tables(s, damage);
  return status;
}

#ifndef _WIN32
pvs_status pvs_open_file(pvs_store* s, const char* path, pvs_damage* damage) {
  struct stat info;
  void* bytes;
  pvs_status status;
  const int file = open(path, O_RDONLY | O_CLOEXEC);
  memset(s, 0, sizeof *s);
  if (file < 0) return fail(PVS_CANNOT_READ, damage, 0, "the file");
  if (fstat(file, &info) != 0 || S_ISDIR(info.st_mode)) {
    const int error = S_ISDIR(info.st_mode) ? EISDIR : errno;
    close(file);
    errno = error;
    return fail(PVS_CANNOT_READ, damage, 0, "the file");
  }
  if (info.st_size <= 0) {
    close(file);
    return fail(PVS_NOT_A_STORE, damage, 0, "the first eight bytes");
  }
  bytes = mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_PRIVATE, file, 0);
  close(file);
  if (bytes == MAP_FAILED) return fail(PVS_CANNOT_READ, damage, 0, "the file");
  status = pvs_open_memory(s, bytes, (size_t)info.st_size, damage);
  s->mapped = 1;
  return status;
}
#endif

void pvs_close(pvs_store* s) {
#ifndef _WIN32
  if (s->mapped) munmap((void*)(uintptr_t)s->bytes, (size_t)s->size);
#endif
  memset(s, 0, sizeof *s);
}

pvs_status pvs_verify_block(const pvs_store* s, uint32_t block, pvs_damage* damage) {
  uint64_t length;
  const unsigned char *bytes, *entry;
  if (block >= s->block_count) return PVS_OUT_OF_RANGE;
  entry = entry_of(s, block);
  bytes = block_bytes(s, block, &length);
  if (pvs_checksum(bytes, (size_t)length) == load_u64(entry + PVS_ENTRY_CHECKSUM)) return PVS_OK;
  return fail(PVS_DAMAGED, damage, (uint64_t)(bytes - s->bytes),
              name_of(load_u32(entry + PVS_ENTRY_KIND)));
}

pvs_status pvs_verify(const pvs_store* s, pvs_damage* damage) {
  uint32_t block;
  for (block = 0; block < s->block_count; ++block) {
    const pvs_status status = pvs_verify_block(s, block, damage);
    if (status != PVS_OK) return status;
  }
  return PVS_OK;
}

const char* pvs_status_text(pvs_status status) {
  switch (status) {
    case PVS_OK:
      return "ok";
    case PVS_CANNOT_READ:
      return "cannot be read";
    case PVS_NOT_A_STORE:
      return "is no .pvs store";
    case PVS_OTHER_VERSION:
      return "has another version of the format";
    case PVS_TRUNCATED:
      return "is truncated";
    case PVS_DAMAGED:
      return "is damaged";
    case PVS_OUT_OF_RANGE:
      return "has no such cell or object";
  }
  return "unknown status";
}
