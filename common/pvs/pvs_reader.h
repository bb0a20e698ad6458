/* Reads .pvs stores at run time. Plain C99, no dependency, no allocation: copy the pvs_*.h and
 * pvs_*.c of this folder into an engine.
 *
 *   pvs_store store;
 *   if (pvs_open_file(&store, "city.pvs", NULL) != PVS_OK) ...
 *   uint32_t cell, count;
 *   pvs_find(&store, eye, &cell, 1, &count);
 *   if (count > 0) pvs_read_sets(&store, cell, words, NULL, scratch);   // else: draw everything
 *
 * A cell is named by its index among the nodes of the hierarchy, in canonical order: by root, a
 * node before its children. Only leaves are found by pvs_find. An object is named by its id; object
 * i is bit i % 64 of word i / 64 of a set.
 *
 * Damage: opening checks the head, the directory and the tail, and every later call checks what it
 * reads, so no file, however damaged, makes the reader leave its bytes or loop for ever. Whether
 * the answers are those that were written is what pvs_verify says; it reads the whole file.
 *
 * Threads: a store does not change after it was opened; share it freely. */
#ifndef PVS_READER_H
#define PVS_READER_H

#include <stddef.h>
#include <stdint.h>

#include "common/pvs/pvs_format.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum pvs_status {
  PVS_OK = 0,
  PVS_CANNOT_READ,   /* the file cannot be opened or mapped; errno says why */
  PVS_NOT_A_STORE,   /* other bytes than a store's */
  PVS_OTHER_VERSION, /* of the format */
  PVS_TRUNCATED,     /* the end is missing */
  PVS_DAMAGED,
  PVS_OUT_OF_RANGE /* no such node or object */
} pvs_status;

typedef struct pvs_damage {
  uint64_t offset;  /* of the block or field at fault */
  const char* what; /* its name */
} pvs_damage;

/* Read the fields freely; change none. */
typedef struct pvs_store {
  const unsigned char* bytes;
  uint64_t size;
  int mapped;
  uint32_t object_count;
  uint32_t node_count;
  uint32_t leaf_count;
  uint32_t root_count;
  uint32_t word_count; /* 64-bit words of a set */
  int up_is_y;         /* of the scene file */
  uint32_t block_count;
  uint32_t chunk_count;
  const unsigned char* directory;
  const unsigned char* settings; /* JSON text, not terminated */
  uint32_t settings_bytes;
  const unsigned char* objects;
  const unsigned char* names;
  uint64_t name_bytes;
  const unsigned char* subtrees;
  uint32_t subtree_width;
  const unsigned char* locate_roots;
  const unsigned char* locate_boxes[PVS_LOCATE_MAX_LEVELS];
  uint32_t locate_levels;
} pvs_store;

typedef struct pvs_object_info {
  const char* name; /* UTF-8, not terminated */
  uint64_t name_bytes;
  double lo[3], hi[3]; /* z up */
  uint32_t triangles;
  uint32_t file_index; /* position in the scene file */
  uint32_t flags;      /* PVS_FLAG_OCCLUDER ... */
} pvs_object_info;

/* Why a node was not split. */
typedef enum pvs_reason {
  PVS_REASON_NONE = 0, /* it was */
  PVS_REASON_NO_BUDGET = 1,
  PVS_REASON_BUDGET_MET = 2,
  PVS_REASON_TOO_SMALL = 3,
  PVS_REASON_POINT_OVER_BUDGET = 4, /* one viewpoint sees more than the budget */
  PVS_REASON_NOTHING_TO_GAIN = 5,   /* one viewpoint sees nearly all of its set */
  PVS_REASON_GIVEN_UP = 6,          /* never evaluated: it has its parent's set */
  PVS_REASON_MERGED = 7             /* it was, but the parts agreed: its sets are their unions */
} pvs_reason;

/* The cell is { origin + sum t[a] * axes[a] : lo[a] <= t[a] <= hi[a] }, z up. */
typedef struct pvs_node_info {
  double origin[3], axes[3][3], lo[3], hi[3];
  int64_t root_id; /* as the cells file gives it */
  uint64_t path;   /* a leading 1 bit, then a bit a split */
  uint32_t root;   /* position in the cells file */
  uint32_t parent; /* a node, or PVS_NO_PARENT */
  uint32_t end;    /* the node after its last descendant */
  uint32_t flags;  /* PVS_FLAG_LEAF ... */
  pvs_reason reason;
  /* The size of a leaf's sets, without decoding them; 0 of an inner node. What is visible but not
   * seen is what nobody could settle: (visible - seen) / visible is the cell's gap. */
  uint32_t visible_objects, visible_triangles, seen_objects, seen_triangles;
  int turned; /* 0: origin 0 and the coordinate axes */
} pvs_node_info;

/* Maps the file, which must not be cut while it is in use (a new store of the same name is no harm:
 * it is another file). `damage` (or NULL) gets the place of what is wrong. POSIX only; elsewhere
 * read the file and use pvs_open_memory. */
pvs_status pvs_open_file(pvs_store* store, const char* path, pvs_damage* damage);
/* Reads a store from `size` bytes that stay where they are until the store is no longer used. */
pvs_status pvs_open_memory(pvs_store* store, const void* bytes, size_t size, pvs_damage* damage);
/* After a failed open too. */
void pvs_close(pvs_store* store);

/* The first block whose checksum is wrong, or PVS_OK. Reads everything. */
pvs_status pvs_verify(const pvs_store* store, pvs_damage* damage);
/* The same of one block, 0 <= block < block_count. */
pvs_status pvs_verify_block(const pvs_store* store, uint32_t block, pvs_damage* damage);
/* The block of the chunk that holds a node, or block_count if there is none. */
uint32_t pvs_block_of_node(const pvs_store* store, uint32_t node);

pvs_status pvs_object(const pvs_store* store, uint32_t id, pvs_object_info* object);
pvs_status pvs_node(const pvs_store* store, uint32_t node, pvs_node_info* info);

/* The leaf cells that hold a point, given in the scene file's own coordinates. Cells are closed: a
 * point on a shared face is in several. `cells` gets the lowest `capacity` of them, ascending,
 * `count` their number. The set of any of them holds all that can be seen from the point. */
pvs_status pvs_find(const pvs_store* store, const double point[3], uint32_t* cells,
                    uint32_t capacity, uint32_t* count);

/* Fills `visible` and `seen` (word_count words each, or NULL) with a cell's sets; an inner node's
 * are the unions of its leaves'. `scratch`: room for pvs_scratch_words(store) words, whose content
 * means nothing; one for each thread. */
uint64_t pvs_scratch_words(const pvs_store* store);
pvs_status pvs_read_sets(const pvs_store* store, uint32_t node, uint64_t* visible, uint64_t* seen,
                         uint64_t* scratch);

/* XXH64 with seed 0: the checksum of blocks. */
uint64_t pvs_checksum(const void* bytes, size_t size);

const char* pvs_status_text(pvs_status status);

#ifdef __cplusplus
}
#endif

#endif
