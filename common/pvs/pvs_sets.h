/* Private to the reader and the writer: the sets of a group of nodes as one run of bits, coded with
 * chances that both learn on the way (docs/store_format.md, "Sets").
 *
 * A group is up to 16 nodes in canonical order. Its members are the objects that any of them sees;
 * then come, node by node, a bit a member for visible and, where it is, another for seen. Nearby
 * cells see nearly the same, so a bit costs little once the same bit of the nodes before is known.
 *
 * One function walks the bits for both directions: what the writer does is what the reader expects.
 * All in integers: the same bytes everywhere. */
#ifndef PVS_SETS_H
#define PVS_SETS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PVS_GROUP_NODES 16u
#define PVS_NOT_IN_GROUP 255u

/* A binary arithmetic coder. Reading past the end gives zeros. */
typedef struct pvs_coder {
  uint32_t low, high, code;
  const unsigned char *in, *in_end; /* reading */
  unsigned char *out, *out_end;     /* writing; NULL: reading */
  int overflow;                     /* writing: out was too small */
} pvs_coder;

typedef struct pvs_group {
  uint32_t nodes;        /* in the group, 1 to PVS_GROUP_NODES */
  uint32_t object_count; /* of the store */
  int has_seen;
  unsigned char parent[PVS_GROUP_NODES]; /* a node of the group before it, or PVS_NOT_IN_GROUP */
  uint32_t member_count;
  uint32_t* members; /* ascending ids; room for object_count when reading */
  uint32_t* rows;    /* of each member: bit i: node i sees it; bit 16 + i: certainly */
} pvs_group;

void pvs_coder_read(pvs_coder* coder, const unsigned char* begin, const unsigned char* end);
void pvs_coder_write(pvs_coder* coder, unsigned char* begin, unsigned char* end);
/* Writes what is pending; returns the end of the bytes. */
unsigned char* pvs_coder_finish(pvs_coder* coder);

/* Codes the members and the rows of nodes 0 .. last. Returns 0 if what it reads is damaged: then
 * members beyond object_count were named, and the group is left empty. */
int pvs_code_group(pvs_coder* coder, pvs_group* group, uint32_t last);

#ifdef __cplusplus
}
#endif

#endif
