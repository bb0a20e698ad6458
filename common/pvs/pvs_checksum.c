/* XXH64 (Yann Collet), seed 0. */
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"

static const uint64_t kPrime1 = 0x9e3779b185ebca87u, kPrime2 = 0xc2b2ae3d27d4eb4fu,
                      kPrime3 = 0x165667b19e3779f9u, kPrime4 = 0x85ebca77c2b2ae63u,
                      kPrime5 = 0x27d4eb2f165667c5u;

static uint64_t rotate(uint64_t v, int bits) { return v << bits | v >> (64 - bits); }
static uint64_t mix(uint64_t lane, uint64_t input) {
  return rotate(lane + input * kPrime2, 31) * kPrime1;
}
static uint64_t merge(uint64_t hash, uint64_t lane) {
  return (hash ^ mix(0, lane)) * kPrime1 + kPrime4;
}

uint64_t pvs_checksum(const void* bytes, size_t size) {
  const unsigned char* p = (const unsigned char*)bytes;
  const unsigned char* const end = p + size;
  uint64_t hash;
  if (size >= 32) {
    uint64_t a = kPrime1 + kPrime2, b = kPrime2, c = 0, d = 0 - kPrime1;
    for (; end - p >= 32; p += 32) {
      a = mix(a, load_u64(p));
      b = mix(b, load_u64(p + 8));
      c = mix(c, load_u64(p + 16));
      d = mix(d, load_u64(p + 24));
    }
    hash = rotate(a, 1) + rotate(b, 7) + rotate(c, 12) + rotate(d, 18);
    hash = merge(merge(merge(merge(hash, a), b), c), d);
  } else {
    hash = kPrime5;
  }
  hash += size;
  for (; end - p >= 8; p += 8) hash = rotate(hash ^ mix(0, load_u64(p)), 27) * kPrime1 + kPrime4;
  for (; end - p >= 4; p += 4) hash = rotate(hash ^ load_u32(p) * kPrime1, 23) * kPrime2 + kPrime3;
  for (; p < end; ++p) hash = rotate(hash ^ *p * kPrime5, 11) * kPrime1;
  hash = (hash ^ hash >> 33) * kPrime2;
  hash = (hash ^ hash >> 29) * kPrime3;
  return hash ^ hash >> 32;
}
