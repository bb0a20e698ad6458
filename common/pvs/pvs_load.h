/* Private to the reader: little-endian loads from any address; compilers make one instruction of
 * each. */
#ifndef PVS_LOAD_H
#define PVS_LOAD_H

#include <stdint.h>
#include <string.h>

#include "common/pvs/pvs_reader.h"

static inline uint32_t load_u32(const unsigned char* p) {
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static inline uint64_t load_u64(const unsigned char* p) {
  return (uint64_t)load_u32(p) | (uint64_t)load_u32(p + 4) << 32;
}

static inline double load_f64(const unsigned char* p) {
  const uint64_t bits = load_u64(p);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static inline double load_f32(const unsigned char* p) {
  const uint32_t bits = load_u32(p);
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static inline void load_vec3(const unsigned char* p, double out[3]) {
  int a;
  for (a = 0; a < 3; ++a) out[a] = load_f64(p + 8 * a);
}

static inline uint64_t load_number(const unsigned char* p, uint32_t width) {
  uint64_t value = 0;
  while (width > 0) value = value << 8 | p[--width];
  return value;
}

/* `width` <= 64 bits that begin at bit `first`, the lowest first. */
static inline uint64_t load_bits(const unsigned char* p, uint64_t first, uint32_t width) {
  uint64_t value = 0;
  uint32_t have = 0;
  for (p += first / 8, first %= 8; have < width; first = 0) {
    value |= (uint64_t)(*p++ >> first) << have;
    have += 8 - (uint32_t)first;
  }
  return width < 64 ? value & (((uint64_t)1 << width) - 1) : value;
}

static inline uint64_t padded(uint64_t bytes) { return (bytes + 7) & ~(uint64_t)7; }

/* The node after the last descendant of a node. */
static inline uint64_t subtree_end(const pvs_store* s, uint32_t node) {
  return 1 + (uint64_t)node +
         load_number(s->subtrees + (uint64_t)node * s->subtree_width, s->subtree_width);
}

/* An entry of the directory, and the bytes of its block. */
static inline const unsigned char* entry_of(const pvs_store* s, uint32_t block) {
  return s->directory + (uint64_t)block * PVS_ENTRY_BYTES;
}

static inline const unsigned char* block_bytes(const pvs_store* s, uint32_t block,
                                               uint64_t* length) {
  const unsigned char* entry = entry_of(s, block);
  *length = load_u64(entry + PVS_ENTRY_LENGTH);
  return s->bytes + load_u64(entry + PVS_ENTRY_OFFSET);
}

#endif
