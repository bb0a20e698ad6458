/* Private to the reader and the writer: ones and zeros, one behind the other. Plain C99; compilers
 * that know of counting instructions are asked for them. */
#ifndef PVS_BITS_H
#define PVS_BITS_H

#include <stdint.h>
#include <string.h>

#include "common/pvs/pvs_load.h"

/* Bits from or to bytes, the lowest first. Reading past the end gives zeros. */
typedef struct pvs_bits {
  uint64_t held;  /* bits not yet taken or put, */
  unsigned count; /* so many, or more when reading */
  const unsigned char *in, *in_end;
  unsigned char *out, *out_end;
  int overflow; /* writing: out was too small */
} pvs_bits;

static inline uint32_t count_of(uint64_t w) {
#if defined(__GNUC__) && defined(__POPCNT__)
  return (uint32_t)__builtin_popcountll(w);
#else
  w -= w >> 1 & 0x5555555555555555u;
  w = (w & 0x3333333333333333u) + (w >> 2 & 0x3333333333333333u);
  w = (w + (w >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return (uint32_t)(w * 0x0101010101010101u >> 56);
#endif
}

/* The number of zeros below the lowest one; w != 0. */
static inline uint32_t zeros_below(uint64_t w) {
#if defined(__GNUC__)
  return (uint32_t)__builtin_ctzll(w);
#else
  return count_of((w & (0 - w)) - 1);
#endif
}

/* Then at least 56 bits are held. */
static inline void refill(pvs_bits* b) {
  if (b->in_end - b->in >= 8) {
    b->held |= load_u64(b->in) << b->count;
    b->in += (63 - b->count) / 8;
    b->count |= 56;
    return;
  }
  for (; b->count < 56; b->count += 8)
    if (b->in < b->in_end) b->held |= (uint64_t)*b->in++ << b->count;
}

static inline uint32_t take_bits(pvs_bits* b, unsigned n) { /* n <= 32, no more than are held */
  const uint32_t value = (uint32_t)(b->held & (((uint64_t)1 << n) - 1));
  b->held >>= n;
  b->count -= n;
  return value;
}

static inline uint32_t get_bits(pvs_bits* b, unsigned n) { /* n <= 32 */
  refill(b);
  return take_bits(b, n);
}

static inline void put_bits(pvs_bits* b, uint32_t value, unsigned n) { /* n <= 32 */
  b->held |= (uint64_t)value << b->count;
  for (b->count += n; b->count >= 8; b->count -= 8) {
    if (b->out < b->out_end)
      *b->out++ = (unsigned char)b->held;
    else
      b->overflow = 1;
    b->held >>= 8;
  }
}

/* A Rice code: so many ones as value / 2^k, a zero, and the k lowest bits; k <= 15. Comes to an end
 * with the bytes, for zeros follow. */
static inline uint32_t get_rice(pvs_bits* b, unsigned k) {
  uint32_t high = 0, ones;
  for (refill(b); (b->held & 0xffffffffu) == 0xffffffffu; refill(b)) {
    (void)take_bits(b, 32);
    high += 32;
  }
  ones = zeros_below(~b->held);
  (void)take_bits(b, ones + 1);
  return (high + ones) << k | take_bits(b, k);
}

static inline void put_rice(pvs_bits* b, uint32_t value, unsigned k) {
  uint32_t ones = value >> k;
  for (; ones >= 16; ones -= 16) put_bits(b, 0xffff, 16);
  put_bits(b, (1u << ones) - 1, ones + 1);
  put_bits(b, value & ((1u << k) - 1), k);
}

#endif
