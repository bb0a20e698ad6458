/* The sets of a group of nodes: see pvs_sets.h. */
#include "common/pvs/pvs_sets.h"

#include <stddef.h>
#include <string.h>

/* How likely a bit is set, of 65536, and how many bits taught that, up to kMostTaught. */
typedef struct chance {
  uint16_t one, taught;
} chance;

enum { kMostTaught = 40, kLeastChance = 48 };

void pvs_coder_read(pvs_coder* c, const unsigned char* begin, const unsigned char* end) {
  int i;
  memset(c, 0, sizeof *c);
  c->high = 0xffffffffu;
  c->in = begin;
  c->in_end = end;
  for (i = 0; i < 4; ++i) c->code = c->code << 8 | (c->in < c->in_end ? *c->in++ : 0u);
}

void pvs_coder_write(pvs_coder* c, unsigned char* begin, unsigned char* end) {
  memset(c, 0, sizeof *c);
  c->high = 0xffffffffu;
  c->out = begin;
  c->out_end = end;
}

static void put_byte(pvs_coder* c, uint32_t byte) {
  if (c->out < c->out_end)
    *c->out++ = (unsigned char)byte;
  else
    c->overflow = 1;
}

unsigned char* pvs_coder_finish(pvs_coder* c) {
  /* The shortest number in low .. high, as what follows reads as zeros. */
  if (c->low > 0) {
    uint32_t byte = (c->low >> 24) + 1;
    if (byte <= c->high >> 24) {
      put_byte(c, byte);
    } else {
      int i;
      for (i = 0; i < 4; ++i) put_byte(c, c->high >> (24 - 8 * i) & 255);
    }
  }
  return c->out;
}

static int code_bit(pvs_coder* c, uint32_t one, int bit) {
  const uint32_t middle = c->low + (uint32_t)((uint64_t)(c->high - c->low) * one >> 16);
  if (c->out == NULL) bit = c->code <= middle;
  if (bit)
    c->high = middle;
  else
    c->low = middle + 1;
  while ((c->low ^ c->high) >> 24 == 0) {
    if (c->out != NULL)
      put_byte(c, c->high >> 24);
    else
      c->code = c->code << 8 | (c->in < c->in_end ? *c->in++ : 0u);
    c->low <<= 8;
    c->high = c->high << 8 | 255;
  }
  return bit;
}

static int learn_bit(pvs_coder* c, chance* p, int bit) {
  /* 65536 / (n + 1.5): the first bits teach the most. */
  static const uint16_t kStep[kMostTaught + 1] = {
      43690, 26214, 18724, 14563, 11915, 10082, 8738, 7710, 6898, 6241, 5698, 5242, 4854, 4519,
      4228,  3971,  3744,  3542,  3360,  3196,  3048, 2912, 2788, 2674, 2570, 2473, 2383, 2299,
      2221,  2148,  2080,  2016,  1956,  1899,  1846, 1795, 1747, 1702, 1659, 1618, 1579};
  int32_t one = p->one;
  bit = code_bit(c, p->one, bit);
  one += (int32_t)((bit ? 65535 - one : -one) * (int64_t)kStep[p->taught] / 65536);
  if (one < kLeastChance) one = kLeastChance;
  if (one > 65535 - kLeastChance) one = 65535 - kLeastChance;
  p->one = (uint16_t)one;
  if (p->taught < kMostTaught) ++p->taught;
  return bit;
}

static uint32_t code_plain(pvs_coder* c, uint32_t value, unsigned bits) {
  uint32_t read = 0;
  while (bits-- > 0) read = read << 1 | (uint32_t)code_bit(c, 32768, (int)(value >> bits & 1));
  return read;
}

static void fill(chance* chances, size_t count, uint16_t one) {
  size_t i;
  for (i = 0; i < count; ++i) {
    chances[i].one = one;
    chances[i].taught = 0;
  }
}

/* The number of members, then the gaps between them: how many bits a gap has, then these. */
static int code_members(pvs_coder* c, pvs_group* g) {
  enum { kLengths = 32, kKinds = 4 };
  chance lengths[kKinds * kLengths];
  uint32_t k, next = 0, kind = 0;
  const int reading = c->out == NULL;
  fill(lengths, kKinds * kLengths, 32768);
  g->member_count = code_plain(c, g->member_count, 32);
  if (g->member_count > g->object_count) return 0;
  for (k = 0; k < g->member_count; ++k) {
    uint32_t gap = reading ? 0 : g->members[k] - next + 1, length = 0;
    while (length + 1 < kLengths &&
           learn_bit(c, &lengths[kind * kLengths + length], !reading && gap >> (length + 1) != 0))
      ++length;
    gap = 1u << length | code_plain(c, gap & ((1u << length) - 1), length);
    if (gap - 1 >= g->object_count - next) return 0;
    next += gap - 1;
    g->members[k] = next++;
    if (reading) g->rows[k] = 0;
    kind = length < kKinds ? length : kKinds - 1;
  }
  return 1;
}

#define BIT(row, i) ((row) >> (i)&1u)

/* The bits of node i, for all members. What is likely is judged by the same member in the two nodes
 * before and in the parent, and by the member before: whether it is set, and was a surprise. */
static void code_row(pvs_coder* c, pvs_group* g, uint32_t i, chance* visible, chance* seen) {
  const unsigned p = g->parent[i] == PVS_NOT_IN_GROUP ? (i > 0 ? i - 1 : 0) : g->parent[i];
  const uint32_t before = (1u << i) - 1;
  uint32_t k, left = 0, left_turned = 0, left2_turned = 0, left_seen = 0, seen_turned = 0;
  for (k = 0; k < g->member_count; ++k) {
    const uint32_t row = g->rows[k];
    const uint32_t p1 = i > 0 ? BIT(row, i - 1) : 0, p2 = i > 1 ? BIT(row, i - 2) : 0;
    const uint32_t p3 = i > 2 ? BIT(row, i - 3) : 0, parent = i > 0 ? BIT(row, p) : 0;
    const uint32_t s1 = i > 0 ? BIT(row, 15 + i) : 0, s2 = i > 1 ? BIT(row, 14 + i) : 0;
    const uint32_t right = i > 0 && k + 1 < g->member_count ? BIT(g->rows[k + 1], i - 1) : 0;
    const uint32_t any = (row & before) != 0, any_seen = (row >> 16 & before) != 0;
    uint32_t at = p1 << 9 | parent << 8 | p2 << 7 | s1 << 6 | p3 << 5 | left << 4 |
                  left_turned << 3 | left2_turned << 2 | right << 1 | any;
    const uint32_t bit =
        (uint32_t)learn_bit(c, &visible[i == 0 ? 1024 + left : at], (int)BIT(row, i));
    uint32_t is_seen = 0;
    if (bit && g->has_seen) {
      at = s1 << 7 | p1 << 6 | BIT(row, 16 + p) << 5 | s2 << 4 | left_seen << 3 | seen_turned << 2 |
           any_seen << 1 | left;
      is_seen = (uint32_t)learn_bit(c, &seen[i == 0 ? 256 + left_seen * 2 + left : at],
                                    (int)BIT(row, 16 + i));
      seen_turned = is_seen != s1;
    }
    if (c->out == NULL) g->rows[k] = row | bit << i | is_seen << (16 + i);
    left2_turned = left_turned;
    left_turned = bit != p1;
    left = bit;
    left_seen = is_seen;
  }
}

int pvs_code_group(pvs_coder* c, pvs_group* g, uint32_t last) {
  chance visible[1024 + 2], seen[256 + 4];
  uint32_t i;
  if (!code_members(c, g)) {
    g->member_count = 0;
    return 0;
  }
  fill(visible, 1024 + 2, 3000);
  fill(visible + 512, 256, 40000); /* the node before sees it, the parent does not */
  fill(visible + 768, 256, 62000); /* both do */
  fill(seen, 256 + 4, 20000);
  fill(seen + 128, 128, 60000);
  for (i = 0; i <= last && i < g->nodes; ++i) code_row(c, g, i, visible, seen);
  return 1;
}
