/* Private to the reader and the writer: the sets of a group of leaves as one run of bits
 * (docs/store_format.md, "Sets").
 *
 * A group is up to 32 leaves in canonical order. Its members are the objects that any of them sees;
 * a set is a row of bits, one a member. Nearby cells see nearly the same, and objects that stand
 * together come and go together: a row says only where, among members of a like past, runs of them
 * turn against a row before it. Rows are worked on 64 members at a time.
 *
 * One function walks the rows for counting, writing and reading: what the writer does is what the
 * reader expects. All in integers: the same bytes everywhere. */
#ifndef PVS_SETS_H
#define PVS_SETS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PVS_GROUP_LEAVES 32u
#define PVS_RUN_KINDS 47u /* a parameter each: three for each class of members */

typedef struct pvs_group {
  uint32_t leaves;       /* in the group, 1 to PVS_GROUP_LEAVES */
  uint32_t object_count; /* of the store */
  int has_seen;
  uint32_t member_count;
  uint32_t word_count; /* of a row: room for members; when reading, for object_count of them */
  uint32_t* members;   /* ascending ids */
  uint64_t* visible;   /* row of leaf i: visible + i * word_count */
  uint64_t* seen;
  uint64_t* work; /* three more rows */
} pvs_group;

/* The words that reading a group of a store of so many objects needs. */
uint64_t pvs_group_words(uint32_t object_count);
/* Points members and rows into so many words. */
void pvs_group_place(pvs_group* group, uint64_t* words);

/* Reads the members and the rows of leaves 0 .. last. Returns 0 if the bytes are damaged: then the
 * rows are not to be used. */
int pvs_read_group(pvs_group* group, const unsigned char* begin, const unsigned char* end,
                   uint32_t last);
/* Writes all rows; returns the end of the bytes, or NULL if there is no room. */
unsigned char* pvs_write_group(pvs_group* group, unsigned char* begin, unsigned char* end);

#ifdef __cplusplus
}
#endif

#endif
