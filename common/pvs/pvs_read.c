/* Objects, cells and their sets. */
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"

pvs_status pvs_object(const pvs_store* s, uint32_t id, pvs_object_info* object) {
  const unsigned char* record;
  uint64_t begin, end;
  if (id >= s->object_count) return PVS_OUT_OF_RANGE;
  record = s->objects + (uint64_t)id * PVS_OBJECT_BYTES;
  begin = id == 0 ? 0 : load_u64(record - PVS_OBJECT_BYTES + PVS_OBJECT_NAME_END);
  end = load_u64(record + PVS_OBJECT_NAME_END);
  if (begin > end || end > s->name_bytes) return PVS_DAMAGED;
  object->name = (const char*)s->names + begin;
  object->name_bytes = end - begin;
  load_vec3(record + PVS_OBJECT_BOX, object->lo);
  load_vec3(record + PVS_OBJECT_BOX + 24, object->hi);
  object->triangles = load_u32(record + PVS_OBJECT_TRIANGLES);
  object->file_index = load_u32(record + PVS_OBJECT_FILE_INDEX);
  object->flags = load_u32(record + PVS_OBJECT_FLAGS);
  return PVS_OK;
}

uint32_t pvs_block_of_node(const pvs_store* s, uint32_t node) {
  uint32_t low = 0, high = s->chunk_count; /* the last chunk that begins at or before the node */
  if (node >= s->node_count) return s->block_count;
  while (high - low > 1) {
    const uint32_t middle = low + (high - low) / 2;
    if (load_u32(entry_of(s, 3 + middle) + PVS_ENTRY_FIRST_NODE) <= node)
      low = middle;
    else
      high = middle;
  }
  return 3 + low;
}

typedef struct chunk {
  uint32_t first_node, node_count, frame_count, entry_count, row_sets, row_bytes;
  const unsigned char *nodes, *frames, *words, *columns, *row_ends, *rows;
} chunk;

/* The parts of the chunk that holds a node; their sizes must fill the block. */
static pvs_status open_chunk(const pvs_store* s, uint32_t node, chunk* c) {
  const uint32_t block = pvs_block_of_node(s, node);
  const unsigned char* head;
  uint64_t length, expected, end_node;
  if (block == s->block_count) return PVS_OUT_OF_RANGE;
  head = block_bytes(s, block, &length);
  c->first_node = load_u32(entry_of(s, block) + PVS_ENTRY_FIRST_NODE);
  c->node_count = load_u32(head + PVS_CHUNK_NODES);
  c->frame_count = load_u32(head + PVS_CHUNK_FRAMES);
  c->entry_count = load_u32(head + PVS_CHUNK_ENTRIES);
  c->row_sets = load_u32(head + PVS_CHUNK_ROW_SETS);
  c->row_bytes = load_u32(head + PVS_CHUNK_ROW_BYTES);
  end_node = block + 3 == s->block_count ? s->node_count
                                         : load_u32(entry_of(s, block + 1) + PVS_ENTRY_FIRST_NODE);
  expected = PVS_CHUNK_HEAD_BYTES + (uint64_t)c->node_count * PVS_NODE_BYTES +
             (uint64_t)c->frame_count * PVS_FRAME_BYTES + (uint64_t)c->entry_count * 8 +
             padded((uint64_t)c->entry_count * 4) +
             padded((uint64_t)c->node_count * c->row_sets * 4) + padded(c->row_bytes);
  if (c->row_sets < 1 || c->row_sets > 2 || c->node_count != end_node - c->first_node ||
      expected != length)
    return PVS_DAMAGED;
  c->nodes = head + PVS_CHUNK_HEAD_BYTES;
  c->frames = c->nodes + (uint64_t)c->node_count * PVS_NODE_BYTES;
  c->words = c->frames + (uint64_t)c->frame_count * PVS_FRAME_BYTES;
  c->columns = c->words + (uint64_t)c->entry_count * 8;
  c->row_ends = c->columns + padded((uint64_t)c->entry_count * 4);
  c->rows = c->row_ends + padded((uint64_t)c->node_count * c->row_sets * 4);
  return PVS_OK;
}

pvs_status pvs_node(const pvs_store* s, uint32_t node, pvs_node_info* info) {
  static const double kAligned[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  chunk c;
  const unsigned char* record;
  uint32_t frame, reason;
  int a;
  const pvs_status status = open_chunk(s, node, &c);
  if (status != PVS_OK) return status;
  record = c.nodes + (uint64_t)(node - c.first_node) * PVS_NODE_BYTES;
  load_vec3(record + PVS_NODE_LO, info->lo);
  load_vec3(record + PVS_NODE_HI, info->hi);
  info->root_id = (int64_t)load_u64(record + PVS_NODE_ROOT_ID);
  info->path = load_u64(record + PVS_NODE_PATH);
  info->root = load_u32(record + PVS_NODE_ROOT);
  info->parent = load_u32(record + PVS_NODE_PARENT);
  info->flags = load_u32(record + PVS_NODE_FLAGS);
  reason = info->flags >> PVS_REASON_SHIFT & PVS_REASON_MASK;
  info->reason = (pvs_reason)reason;
  info->visible_objects = load_u32(record + PVS_NODE_VISIBLE_OBJECTS);
  info->visible_triangles = load_u32(record + PVS_NODE_VISIBLE_TRIANGLES);
  info->seen_objects = load_u32(record + PVS_NODE_SEEN_OBJECTS);
  info->seen_triangles = load_u32(record + PVS_NODE_SEEN_TRIANGLES);
  info->end = load_u32(s->subtrees + (uint64_t)node * 4);
  frame = load_u32(record + PVS_NODE_FRAME);
  if (frame > c.frame_count || reason > PVS_REASON_MERGED || info->end <= node ||
      info->end > s->node_count || info->path == 0 ||
      (info->parent != PVS_NO_PARENT && info->parent >= node))
    return PVS_DAMAGED;
  info->turned = frame != 0;
  if (frame == 0) {
    memcpy(info->origin, kAligned, sizeof info->origin);
    memcpy(info->axes, kAligned + 3, sizeof info->axes);
    return PVS_OK;
  }
  load_vec3(c.frames + (uint64_t)(frame - 1) * PVS_FRAME_BYTES, info->origin);
  for (a = 0; a < 3; ++a)
    load_vec3(c.frames + (uint64_t)(frame - 1) * PVS_FRAME_BYTES + 24 * (a + 1), info->axes[a]);
  return PVS_OK;
}

pvs_status pvs_row_open(const pvs_store* s, uint32_t node, pvs_set set, pvs_row* row) {
  chunk c;
  uint64_t index;
  uint32_t begin, end;
  memset(row, 0, sizeof *row);
  row->status = open_chunk(s, node, &c);
  if (row->status != PVS_OK) return row->status;
  if (set == PVS_SEEN && c.row_sets == 1) return PVS_OK; /* none: the row is empty */
  index = (uint64_t)(node - c.first_node) + (set == PVS_SEEN ? c.node_count : 0);
  begin = index == 0 ? 0 : load_u32(c.row_ends + (index - 1) * 4);
  end = load_u32(c.row_ends + index * 4);
  if (begin > end || end > c.row_bytes) return row->status = PVS_DAMAGED;
  row->at = c.rows + begin;
  row->end = c.rows + end;
  row->words = c.words;
  row->columns = c.columns;
  row->entry_count = c.entry_count;
  row->word_count = s->word_count;
  row->object_count = s->object_count;
  return PVS_OK;
}

int pvs_row_next(pvs_row* row, uint32_t* position, uint64_t* word) {
  uint64_t gap = 0;
  unsigned shift = 0;
  if (row->at == row->end) return 0;
  for (;; shift += 7) {
    const unsigned char byte = *row->at++;
    gap |= (uint64_t)(byte & 0x7f) << shift;
    if (byte < 0x80) break;
    if (row->at == row->end || shift == 28) goto damaged;
  }
  row->entry += gap;
  if (row->entry >= row->entry_count) goto damaged;
  *word = load_u64(row->words + row->entry * 8);
  *position = load_u32(row->columns + row->entry * 4);
  ++row->entry;
  if (*position >= row->word_count) goto damaged;
  if (*position == row->object_count / 64 && *word >> (row->object_count % 64) != 0) goto damaged;
  return 1;
damaged:
  row->at = row->end;
  row->status = PVS_DAMAGED;
  return 0;
}

pvs_status pvs_read_set(const pvs_store* s, uint32_t node, pvs_set set, uint64_t* words) {
  pvs_row row;
  uint32_t position;
  uint64_t word;
  memset(words, 0, (size_t)s->word_count * 8);
  for (pvs_row_open(s, node, set, &row); pvs_row_next(&row, &position, &word);)
    words[position] |= word;
  return row.status;
}
