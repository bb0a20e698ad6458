/* Objects, cells and their sets. */
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"
#include "common/pvs/pvs_sets.h"

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
  uint32_t first_node, node_count, frame_count, coordinate_count, row_sets, group_bytes;
  const unsigned char* head;
  const unsigned char* columns[PVS_NODE_FIELDS];
  const unsigned char *frames, *coordinates, *group_ends, *groups;
} chunk;

static const unsigned char* column_head(const unsigned char* chunk_head, int field) {
  return chunk_head + PVS_CHUNK_COLUMNS + field * PVS_COLUMN_HEAD_BYTES;
}

static uint32_t group_count(const chunk* c) {
  return c->node_count / PVS_GROUP_NODES + (c->node_count % PVS_GROUP_NODES != 0);
}

/* The parts of the chunk that holds a node; their sizes must fill the block. */
static pvs_status open_chunk(const pvs_store* s, uint32_t node, chunk* c) {
  const uint32_t block = pvs_block_of_node(s, node);
  const unsigned char* head;
  uint64_t length, end_node, columns = 0, expected;
  int field;
  if (block == s->block_count) return PVS_OUT_OF_RANGE;
  head = c->head = block_bytes(s, block, &length);
  c->first_node = load_u32(entry_of(s, block) + PVS_ENTRY_FIRST_NODE);
  c->node_count = load_u32(head + PVS_CHUNK_NODES);
  c->frame_count = load_u32(head + PVS_CHUNK_FRAMES);
  c->coordinate_count = load_u32(head + PVS_CHUNK_COORDINATES);
  c->row_sets = load_u32(head + PVS_CHUNK_ROW_SETS);
  c->group_bytes = load_u32(head + PVS_CHUNK_GROUP_BYTES);
  end_node = block + 3 == s->block_count ? s->node_count
                                         : load_u32(entry_of(s, block + 1) + PVS_ENTRY_FIRST_NODE);
  if (c->row_sets < 1 || c->row_sets > 2 || c->node_count != end_node - c->first_node)
    return PVS_DAMAGED;
  for (field = 0; field < PVS_NODE_FIELDS; ++field) {
    const uint32_t width = load_u32(column_head(head, field) + PVS_COLUMN_WIDTH);
    if (width > 8) return PVS_DAMAGED;
    columns += (uint64_t)c->node_count * width;
  }
  expected = PVS_CHUNK_HEAD_BYTES + padded(columns) + (uint64_t)c->frame_count * PVS_FRAME_BYTES +
             (uint64_t)c->coordinate_count * 8 + padded((uint64_t)group_count(c) * 4) +
             padded(c->group_bytes);
  if (expected != length) return PVS_DAMAGED;
  c->frames = head + PVS_CHUNK_HEAD_BYTES;
  for (field = 0; field < PVS_NODE_FIELDS; ++field) {
    c->columns[field] = c->frames;
    c->frames += (uint64_t)c->node_count * load_u32(column_head(head, field) + PVS_COLUMN_WIDTH);
  }
  c->frames = head + PVS_CHUNK_HEAD_BYTES + padded(columns);
  c->coordinates = c->frames + (uint64_t)c->frame_count * PVS_FRAME_BYTES;
  c->group_ends = c->coordinates + (uint64_t)c->coordinate_count * 8;
  c->groups = c->group_ends + padded((uint64_t)group_count(c) * 4);
  return PVS_OK;
}

static uint64_t field_of(const chunk* c, uint32_t node, int field) {
  const unsigned char* head = column_head(c->head, field);
  const uint32_t width = load_u32(head + PVS_COLUMN_WIDTH);
  return load_u64(head + PVS_COLUMN_BASE) +
         load_number(c->columns[field] + (uint64_t)(node - c->first_node) * width, width);
}

/* Damaged: a number too large for a field of 32 bits. */
static int load_small(const chunk* c, uint32_t node, int field, uint32_t* value) {
  const uint64_t wide = field_of(c, node, field);
  *value = (uint32_t)wide;
  return wide <= 0xffffffffu;
}

static int load_box(const chunk* c, uint32_t node, pvs_node_info* info) {
  int a;
  for (a = 0; a < 6; ++a) {
    const uint64_t number = field_of(c, node, PVS_NODE_BOX + a);
    if (number >= c->coordinate_count) return 0;
    (a < 3 ? info->lo : info->hi)[a % 3] = load_f64(c->coordinates + number * 8);
  }
  return 1;
}

pvs_status pvs_node(const pvs_store* s, uint32_t node, pvs_node_info* info) {
  static const double kAligned[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  chunk c;
  uint32_t frame, back, flags, reason;
  uint64_t end;
  int a;
  const pvs_status status = open_chunk(s, node, &c);
  if (status != PVS_OK) return status;
  info->root_id = (int64_t)field_of(&c, node, PVS_NODE_ROOT_ID);
  info->path = field_of(&c, node, PVS_NODE_PATH);
  if (!load_box(&c, node, info) || !load_small(&c, node, PVS_NODE_ROOT, &info->root) ||
      !load_small(&c, node, PVS_NODE_PARENT, &back) ||
      !load_small(&c, node, PVS_NODE_FRAME, &frame) ||
      !load_small(&c, node, PVS_NODE_FLAGS, &flags) ||
      !load_small(&c, node, PVS_NODE_VISIBLE_OBJECTS, &info->visible_objects) ||
      !load_small(&c, node, PVS_NODE_VISIBLE_TRIANGLES, &info->visible_triangles) ||
      !load_small(&c, node, PVS_NODE_SEEN_OBJECTS, &info->seen_objects) ||
      !load_small(&c, node, PVS_NODE_SEEN_TRIANGLES, &info->seen_triangles))
    return PVS_DAMAGED;
  reason = flags / PVS_FIELD_REASON;
  end = subtree_end(s, node);
  if (frame > c.frame_count || reason > PVS_REASON_MERGED || end > s->node_count ||
      info->path == 0 || back > node)
    return PVS_DAMAGED;
  info->reason = (pvs_reason)reason;
  info->flags = flags % PVS_FIELD_REASON;
  info->parent = back == 0 ? PVS_NO_PARENT : node - back;
  info->end = (uint32_t)end;
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

uint64_t pvs_scratch_words(const pvs_store* s) { return s->object_count; }

/* Where the group of a node is, and which of its nodes are parents of others. */
static pvs_status open_group(const chunk* c, uint32_t node, pvs_coder* coder, pvs_group* g) {
  const uint32_t index = (node - c->first_node) / PVS_GROUP_NODES;
  const uint32_t first = c->first_node + index * PVS_GROUP_NODES;
  const uint32_t left = c->first_node + c->node_count - first;
  const uint32_t begin = index == 0 ? 0 : load_u32(c->group_ends + (uint64_t)(index - 1) * 4);
  const uint32_t end = load_u32(c->group_ends + (uint64_t)index * 4);
  uint32_t i;
  if (begin > end || end > c->group_bytes) return PVS_DAMAGED;
  g->nodes = left < PVS_GROUP_NODES ? left : PVS_GROUP_NODES;
  g->has_seen = c->row_sets == 2;
  for (i = 0; i < g->nodes; ++i) {
    const uint64_t back = field_of(c, first + i, PVS_NODE_PARENT);
    g->parent[i] = (unsigned char)(back > 0 && back <= i ? i - back : PVS_NOT_IN_GROUP);
  }
  pvs_coder_read(coder, c->groups + begin, c->groups + end);
  return PVS_OK;
}

pvs_status pvs_read_sets(const pvs_store* s, uint32_t node, uint64_t* visible, uint64_t* seen,
                         uint64_t* scratch) {
  chunk c;
  pvs_coder coder;
  pvs_group group;
  uint32_t i, k;
  pvs_status status = open_chunk(s, node, &c);
  if (visible != NULL) memset(visible, 0, (size_t)s->word_count * 8);
  if (seen != NULL) memset(seen, 0, (size_t)s->word_count * 8);
  if (status == PVS_OK) status = open_group(&c, node, &coder, &group);
  if (status != PVS_OK) return status;
  group.object_count = s->object_count;
  group.members = (uint32_t*)(void*)scratch;
  group.rows = group.members + s->object_count;
  i = (node - c.first_node) % PVS_GROUP_NODES;
  if (!pvs_code_group(&coder, &group, i)) return PVS_DAMAGED;
  for (k = 0; k < group.member_count; ++k) {
    const uint32_t id = group.members[k], row = group.rows[k];
    if (visible != NULL) visible[id / 64] |= (uint64_t)(row >> i & 1) << (id % 64);
    if (seen != NULL) seen[id / 64] |= (uint64_t)(row >> (16 + i) & 1) << (id % 64);
  }
  return PVS_OK;
}
