/* Objects, cells and their sets. */
#include "common/pvs/pvs_bits.h"
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
  uint32_t first_node, node_count, frame_count, coordinate_count, row_sets, group_bytes, leaf_count;
  const unsigned char *head, *leaf_bits;
  const unsigned char* columns[PVS_NODE_FIELDS];
  const unsigned char *frames, *coordinates, *group_ends, *groups;
} chunk;

static const unsigned char* column_head(const unsigned char* chunk_head, int field) {
  return chunk_head + PVS_CHUNK_COLUMNS + field * PVS_COLUMN_HEAD_BYTES;
}

static uint32_t group_count(const chunk* c) {
  return c->leaf_count / PVS_GROUP_LEAVES + (c->leaf_count % PVS_GROUP_LEAVES != 0);
}

/* The number of leaves among the first `nodes` of the chunk. */
static uint32_t leaves_before(const chunk* c, uint32_t nodes) {
  uint32_t count = 0, word;
  for (word = 0; word * 64 < nodes; ++word) {
    const uint32_t here = nodes - word * 64;
    const uint64_t bits = load_u64(c->leaf_bits + (uint64_t)word * 8);
    count += count_of(here < 64 ? bits & (((uint64_t)1 << here) - 1) : bits);
  }
  return count;
}

static int is_leaf(const chunk* c, uint32_t node) {
  const uint32_t i = node - c->first_node;
  return c->leaf_bits[i / 8] >> (i % 8) & 1;
}

static uint64_t column_bytes(const chunk* c, int field) {
  const uint64_t numbers = field < PVS_LEAF_FIELDS ? c->node_count : c->leaf_count;
  return (numbers * load_u32(column_head(c->head, field) + PVS_COLUMN_WIDTH) + 7) / 8;
}

/* The parts of the chunk that holds a node; their sizes must fill the block. */
static pvs_status open_chunk(const pvs_store* s, uint32_t node, chunk* c) {
  const uint32_t block = pvs_block_of_node(s, node);
  const unsigned char *head, *at;
  uint64_t length, end_node, columns = 0, expected, leaf_bits;
  int field;
  if (block == s->block_count) return PVS_OUT_OF_RANGE;
  head = c->head = block_bytes(s, block, &length);
  c->first_node = load_u32(entry_of(s, block) + PVS_ENTRY_FIRST_NODE);
  c->node_count = load_u32(head + PVS_CHUNK_NODES);
  c->frame_count = load_u32(head + PVS_CHUNK_FRAMES);
  c->coordinate_count = load_u32(head + PVS_CHUNK_COORDINATES);
  c->row_sets = load_u32(head + PVS_CHUNK_ROW_SETS);
  c->group_bytes = load_u32(head + PVS_CHUNK_GROUP_BYTES);
  c->leaf_count = load_u32(head + PVS_CHUNK_LEAVES);
  end_node = block + 3 == s->block_count ? s->node_count
                                         : load_u32(entry_of(s, block + 1) + PVS_ENTRY_FIRST_NODE);
  if (c->row_sets < 1 || c->row_sets > 2 || c->node_count != end_node - c->first_node ||
      c->leaf_count > c->node_count)
    return PVS_DAMAGED;
  for (field = 0; field < PVS_NODE_FIELDS; ++field) {
    if (load_u32(column_head(head, field) + PVS_COLUMN_WIDTH) > 64) return PVS_DAMAGED;
    columns += column_bytes(c, field);
  }
  leaf_bits = padded(((uint64_t)c->node_count + 7) / 8);
  expected = PVS_CHUNK_HEAD_BYTES + leaf_bits + padded(columns) +
             (uint64_t)c->frame_count * PVS_FRAME_BYTES + (uint64_t)c->coordinate_count * 8 +
             padded((uint64_t)group_count(c) * 4) + padded(c->group_bytes);
  if (expected != length) return PVS_DAMAGED;
  c->leaf_bits = head + PVS_CHUNK_HEAD_BYTES;
  at = c->leaf_bits + leaf_bits;
  c->frames = at + padded(columns);
  for (field = 0; field < PVS_NODE_FIELDS; at += column_bytes(c, field++)) c->columns[field] = at;
  c->coordinates = c->frames + (uint64_t)c->frame_count * PVS_FRAME_BYTES;
  c->group_ends = c->coordinates + (uint64_t)c->coordinate_count * 8;
  c->groups = c->group_ends + padded((uint64_t)group_count(c) * 4);
  return PVS_OK;
}

/* Number `index` of a column: of a node less the chunk's first, or of a leaf among the leaves. */
static uint64_t number_of(const chunk* c, uint32_t index, int field) {
  const unsigned char* head = column_head(c->head, field);
  const uint32_t width = load_u32(head + PVS_COLUMN_WIDTH);
  return load_u64(head + PVS_COLUMN_BASE) +
         load_bits(c->columns[field], (uint64_t)index * width, width);
}

static uint64_t field_of(const chunk* c, uint32_t node, int field) {
  return number_of(c, node - c->first_node, field);
}

/* Damaged: a number too large for a field of 32 bits. */
static int load_small(const chunk* c, uint32_t node, int field, uint32_t* value) {
  const uint64_t wide = field_of(c, node, field);
  *value = (uint32_t)wide;
  return wide <= 0xffffffffu;
}

/* The sizes of a leaf's sets; an inner node has none of its own. */
static int load_sizes(const chunk* c, uint32_t node, pvs_node_info* info) {
  uint32_t* const sizes[4] = {&info->visible_objects, &info->visible_triangles, &info->seen_objects,
                              &info->seen_triangles};
  const int leaf = is_leaf(c, node);
  const uint32_t index = leaf ? leaves_before(c, node - c->first_node) : 0;
  int k;
  if (leaf && index >= c->leaf_count) return 0;
  for (k = 0; k < 4; ++k) {
    const uint64_t wide = leaf ? number_of(c, index, PVS_LEAF_FIELDS + k) : 0;
    *sizes[k] = (uint32_t)wide;
    if (wide > 0xffffffffu) return 0;
  }
  return 1;
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
      !load_small(&c, node, PVS_NODE_FLAGS, &flags) || !load_sizes(&c, node, info))
    return PVS_DAMAGED;
  reason = flags / PVS_FIELD_REASON;
  end = subtree_end(s, node);
  if (frame > c.frame_count || reason > PVS_REASON_MERGED || end > s->node_count ||
      info->path == 0 || back > node || (flags & PVS_FLAG_LEAF) != (uint32_t)is_leaf(&c, node))
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

uint64_t pvs_scratch_words(const pvs_store* s) { return pvs_group_words(s->object_count); }

/* Reads the rows of leaves 0 .. last of a group. */
static pvs_status read_group(const chunk* c, uint32_t index, uint32_t last, pvs_group* g) {
  const uint32_t left = c->leaf_count - index * PVS_GROUP_LEAVES;
  const uint32_t begin = index == 0 ? 0 : load_u32(c->group_ends + (uint64_t)(index - 1) * 4);
  const uint32_t end = load_u32(c->group_ends + (uint64_t)index * 4);
  if (begin > end || end > c->group_bytes) return PVS_DAMAGED;
  g->leaves = left < PVS_GROUP_LEAVES ? left : PVS_GROUP_LEAVES;
  g->has_seen = c->row_sets == 2;
  return pvs_read_group(g, c->groups + begin, c->groups + end, last) ? PVS_OK : PVS_DAMAGED;
}

/* Adds the members that are in any of rows first .. last. */
static void add_members(const pvs_group* g, const uint64_t* rows, uint32_t first, uint32_t last,
                        uint64_t* set) {
  uint32_t k, i;
  for (k = 0; k < g->member_count; k += 64) {
    uint64_t some = 0;
    uint32_t bit;
    for (i = first; i <= last; ++i) some |= rows[(size_t)i * g->word_count + k / 64];
    for (bit = 0; some != 0; ++bit, some >>= 1)
      if (some & 1) set[g->members[k + bit] / 64] |= (uint64_t)1 << g->members[k + bit] % 64;
  }
}

/* Adds the sets of the chunk's leaves first .. end - 1. */
static pvs_status add_leaves(const chunk* c, uint32_t first, uint32_t end, pvs_group* g,
                             uint64_t* visible, uint64_t* seen) {
  if (end > c->leaf_count) return PVS_DAMAGED;
  while (first < end) {
    const uint32_t index = first / PVS_GROUP_LEAVES, from = first % PVS_GROUP_LEAVES;
    const uint32_t left = end - index * PVS_GROUP_LEAVES;
    const uint32_t last = (left < PVS_GROUP_LEAVES ? left : PVS_GROUP_LEAVES) - 1;
    const pvs_status status = read_group(c, index, last, g);
    if (status != PVS_OK) return status;
    if (visible != NULL) add_members(g, g->visible, from, last, visible);
    if (seen != NULL) add_members(g, g->seen, from, last, seen);
    first = (index + 1) * PVS_GROUP_LEAVES;
  }
  return PVS_OK;
}

pvs_status pvs_read_sets(const pvs_store* s, uint32_t node, uint64_t* visible, uint64_t* seen,
                         uint64_t* scratch) {
  uint64_t end;
  pvs_group group;
  if (visible != NULL) memset(visible, 0, (size_t)s->word_count * 8);
  if (seen != NULL) memset(seen, 0, (size_t)s->word_count * 8);
  if (node >= s->node_count) return PVS_OUT_OF_RANGE;
  end = subtree_end(s, node);
  if (end > s->node_count) return PVS_DAMAGED;
  group.object_count = s->object_count;
  pvs_group_place(&group, scratch);
  while (node < end) {
    chunk c;
    uint64_t stop;
    pvs_status status = open_chunk(s, node, &c);
    if (status != PVS_OK) return status;
    stop = (uint64_t)c.first_node + c.node_count;
    if (stop > end) stop = end;
    status = add_leaves(&c, leaves_before(&c, node - c.first_node),
                        leaves_before(&c, (uint32_t)stop - c.first_node), &group, visible, seen);
    if (status != PVS_OK) return status;
    node = (uint32_t)stop;
  }
  return PVS_OK;
}
