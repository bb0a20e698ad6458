/* The sets of a group of leaves: see pvs_sets.h. */
#include "common/pvs/pvs_sets.h"

#include <stddef.h>
#include <string.h>

#include "common/pvs/pvs_bits.h"

enum {
  kMostRice = 15,
  kRiceBits = 4,
  kRowBits = 5,
  kKindsOfMembers = 0,
  kKindsOfRows = 2,
  kKindsOfClass = 3
};

/* What a walk does with the rows. */
typedef enum walk_mode { kCount, kWrite, kRead } walk_mode;

typedef struct walk {
  walk_mode mode;
  pvs_bits bits;
  uint32_t rice[PVS_RUN_KINDS];                /* of each kind of run */
  uint64_t cost[PVS_RUN_KINDS][kMostRice + 1]; /* counting: bits with each parameter */
  int damaged;
} walk;

static uint32_t code_plain(walk* w, uint32_t value, unsigned n) {
  if (w->mode == kRead) return get_bits(&w->bits, n);
  if (w->mode == kWrite) put_bits(&w->bits, value, n);
  return value;
}

static uint32_t code_run(walk* w, unsigned kind, uint32_t value) {
  uint32_t k;
  if (w->mode == kRead) return get_rice(&w->bits, w->rice[kind]);
  if (w->mode == kWrite) put_rice(&w->bits, value, w->rice[kind]);
  for (k = 0; w->mode == kCount && k <= kMostRice; ++k) w->cost[kind][k] += 1 + k + (value >> k);
  return value;
}

/* Runs of absent and of present ids, in turns. */
static void code_members(walk* w, pvs_group* g) {
  uint32_t k = 0, next = 0;
  g->member_count = code_plain(w, g->member_count, 32);
  if (g->member_count > g->object_count) w->damaged = 1;
  while (k < g->member_count && !w->damaged) {
    uint32_t gap = 0, run = 0;
    if (w->mode != kRead) {
      gap = g->members[k] - next;
      while (k + run + 1 < g->member_count && g->members[k + run + 1] == g->members[k] + run + 1)
        ++run;
    }
    gap = code_run(w, kKindsOfMembers, gap);
    run = code_run(w, kKindsOfMembers + 1, run);
    if (run >= g->member_count - k || gap > g->object_count - next ||
        run >= g->object_count - next - gap) {
      w->damaged = 1;
      return;
    }
    for (next += gap, ++run; run > 0; --run) g->members[k++] = next++;
  }
}

/* Some of the members, in order, from a place on. */
typedef struct place {
  uint32_t word;
  uint64_t rest; /* of the mask's word: those not yet passed */
} place;

/* Passes n of those in the mask; in `turned` (or NULL) they are noted. 0: there are fewer. */
static int pass(const uint64_t* mask, uint32_t words, place* at, uint32_t n, uint64_t* turned) {
  while (n > 0) {
    const uint32_t here = count_of(at->rest);
    uint64_t left = 0;
    if (n < here) {
      uint32_t k;
      left = at->rest;
      for (k = 0; k < n; ++k) left &= left - 1;
    }
    if (turned != NULL) turned[at->word] |= at->rest & ~left;
    at->rest = left;
    n = n < here ? 0 : n - here;
    if (at->rest != 0) continue;
    do {
      if (++at->word >= words) return n == 0;
      at->rest = mask[at->word];
    } while (at->rest == 0);
  }
  return 1;
}

/* How many of those in the mask follow, from the place on, before one that is in `turned`, or, with
 * `flip` all ones, before one that is not. */
static uint32_t length_of(const uint64_t* mask, uint32_t words, place at, const uint64_t* turned,
                          uint64_t flip) {
  uint32_t n = 0;
  while (at.word < words) {
    const uint64_t ends = at.rest & (turned[at.word] ^ flip);
    if (ends != 0) return n + count_of(at.rest & ((ends & (0 - ends)) - 1));
    n += count_of(at.rest);
    if (++at.word < words) at.rest = mask[at.word];
  }
  return n;
}

static place first_of(const uint64_t* mask, uint32_t words) {
  place at = {0, 0};
  while (at.word < words && mask[at.word] == 0) ++at.word;
  if (at.word < words) at.rest = mask[at.word];
  return at;
}

/* The number of runs of turned ones among those in the mask. */
static uint32_t runs_in(const uint64_t* mask, uint32_t words, const uint64_t* turned) {
  uint32_t runs = 0;
  uint64_t k, before = 0;
  for (k = 0; k < words; ++k) {
    uint64_t rest;
    for (rest = mask[k]; rest != 0; rest &= rest - 1) {
      const uint64_t now = (rest & (0 - rest) & turned[k]) != 0;
      runs += (uint32_t)(now & ~before & 1);
      before = now;
    }
  }
  return runs;
}

/* Which of those in the mask are turned: how many runs; of each how many are passed, its length. */
static void code_turned(walk* w, unsigned kind, uint32_t runs, const uint64_t* mask, uint32_t words,
                        uint64_t* turned) {
  place at = first_of(mask, words);
  for (; runs > 0 && !w->damaged; --runs) {
    uint32_t n = w->mode == kRead ? 0 : length_of(mask, words, at, turned, 0);
    n = code_run(w, kind + 1, n);
    if (!pass(mask, words, &at, n, NULL) || at.word >= words) {
      w->damaged = 1;
      return;
    }
    n = w->mode == kRead ? 0 : length_of(mask, words, at, turned, ~(uint64_t)0) - 1;
    n = code_run(w, kind + 2, n);
    if (n == 0xffffffffu || !pass(mask, words, &at, n + 1, w->mode == kRead ? turned : NULL))
      w->damaged = 1;
  }
}

/* The rows a row is told by: the nearest and the next. */
typedef struct likes {
  const uint64_t *visible[2], *seen[2];
} likes;

static uint32_t distance(const uint64_t* a, const uint64_t* b, uint32_t words) {
  uint32_t n = 0, k;
  for (k = 0; k < words; ++k) n += count_of(a[k] ^ b[k]);
  return n;
}

static void choose_likes(const pvs_group* g, uint32_t words, uint32_t i, uint32_t chosen[2]) {
  uint32_t least[2] = {0xffffffffu, 0xffffffffu}, j = i;
  const uint64_t* row = g->visible + (size_t)i * g->word_count;
  chosen[0] = chosen[1] = i - 1;
  while (j-- > 0) {
    const uint32_t d = distance(row, g->visible + (size_t)j * g->word_count, words);
    if (d < least[0]) {
      least[1] = least[0];
      chosen[1] = chosen[0];
      least[0] = d;
      chosen[0] = j;
    } else if (d < least[1]) {
      least[1] = d;
      chosen[1] = j;
    }
  }
}

static int code_likes(walk* w, const pvs_group* g, uint32_t words, uint32_t i, likes* l) {
  uint32_t chosen[2] = {0, 0}, k;
  if (i == 0) return 1;
  if (w->mode != kRead) choose_likes(g, words, i, chosen);
  for (k = 0; k < 2; ++k) {
    if (i > 1) chosen[k] = code_plain(w, chosen[k], kRowBits);
    if (chosen[k] >= i) return 0;
    l->visible[k] = g->visible + (size_t)chosen[k] * g->word_count;
    l->seen[k] = g->seen + (size_t)chosen[k] * g->word_count;
  }
  return 1;
}

enum { kVisibleClasses = 8, kSeenClasses = 7 };

/* The members of a class: by the two rows like this, whether the first also saw them for certain,
 * and whether any row had them. */
static void visible_class(const likes* l, const uint64_t* any, uint32_t class_index, uint32_t words,
                          uint64_t* mask) {
  const uint64_t *a = l->visible[0], *b = l->visible[1], *s = l->seen[0];
  uint32_t k;
#define MASK(word)                              \
  for (k = 0; k < words; ++k) mask[k] = (word); \
  return
  switch (class_index) {
    case 0:
      MASK(~any[k]);
    case 1:
      MASK(any[k] & ~a[k] & ~b[k]);
    case 2:
      MASK(any[k] & ~a[k] & b[k]);
    case 3:
      MASK(a[k] & ~b[k] & ~s[k]);
    case 4:
      MASK(a[k] & ~b[k] & s[k]);
    case 5:
      MASK(a[k] & b[k] & ~s[k]);
    default:
      MASK(a[k] & b[k] & s[k]);
  }
}

/* Of the visible ones, by whether the rows like this saw them and saw them for certain. */
static void seen_class(const likes* l, const uint64_t* row, uint32_t class_index, uint32_t words,
                       uint64_t* mask) {
  const uint64_t *a = l->visible[0], *s = l->seen[0], *t = l->seen[1];
  uint32_t k;
  switch (class_index) {
    case 0:
      MASK(row[k] & ~a[k] & ~t[k]);
    case 1:
      MASK(row[k] & ~a[k] & t[k]);
    case 2:
      MASK(row[k] & a[k] & ~s[k] & ~t[k]);
    case 3:
      MASK(row[k] & a[k] & ~s[k] & t[k]);
    case 4:
      MASK(row[k] & s[k] & ~t[k]);
    default:
      MASK(row[k] & s[k] & t[k]);
  }
#undef MASK
}

/* Class by class which members turn against the nearest row. The last class is of the first row. */
static void code_visible(walk* w, const pvs_group* g, uint32_t words, uint32_t i, const likes* l) {
  uint64_t *const row = g->visible + (size_t)i * g->word_count, *const any = g->work;
  uint64_t *const mask = any + g->word_count, *const turned = mask + g->word_count;
  uint32_t c, k;
  for (k = 0; k < words; ++k)
    turned[k] = w->mode == kRead ? 0 : row[k] ^ (i == 0 ? 0 : l->visible[0][k]);
  for (c = i == 0 ? kVisibleClasses - 1 : 0; c < (i == 0 ? 8u : 7u); ++c) {
    const unsigned kind = kKindsOfRows + kKindsOfClass * c;
    uint32_t runs = 0;
    if (w->mode == kRead && (runs = code_run(w, kind, 0)) == 0) continue;
    if (i > 0)
      visible_class(l, any, c, words, mask);
    else if (words > 0)
      memset(mask, 255, (size_t)words * 8);
    if (words > 0) mask[words - 1] &= ~(uint64_t)0 >> (64 * words - g->member_count);
    if (w->mode != kRead) runs = code_run(w, kind, runs_in(mask, words, turned));
    code_turned(w, kind, runs, mask, words, turned);
  }
  for (k = 0; k < words; ++k) {
    if (w->mode == kRead) row[k] = turned[k] ^ (i == 0 ? 0 : l->visible[0][k]);
    any[k] = row[k] | (i == 0 ? 0 : any[k]);
  }
}

/* Of the visible ones: as in the row like this, or, where that had not even seen them, seen. */
static void code_seen(walk* w, const pvs_group* g, uint32_t words, uint32_t i, const likes* l) {
  const uint64_t* const visible = g->visible + (size_t)i * g->word_count;
  uint64_t* const row = g->seen + (size_t)i * g->word_count;
  uint64_t *const mask = g->work + g->word_count, *const turned = mask + g->word_count;
  uint32_t c, k;
#define LIKELY(k) (i == 0 ? ~(uint64_t)0 : l->seen[0][k] | ~l->visible[0][k])
  for (k = 0; k < words; ++k) turned[k] = w->mode == kRead ? 0 : (row[k] ^ LIKELY(k)) & visible[k];
  for (c = i == 0 ? kSeenClasses - 1 : 0; c < (i == 0 ? 7u : 6u); ++c) {
    const unsigned kind = kKindsOfRows + kKindsOfClass * (kVisibleClasses + c);
    uint32_t runs = 0;
    if (w->mode == kRead && (runs = code_run(w, kind, 0)) == 0) continue;
    if (i > 0)
      seen_class(l, visible, c, words, mask);
    else if (words > 0)
      memcpy(mask, visible, (size_t)words * 8);
    if (w->mode != kRead) runs = code_run(w, kind, runs_in(mask, words, turned));
    code_turned(w, kind, runs, mask, words, turned);
  }
  for (k = 0; w->mode == kRead && k < words; ++k) row[k] = (turned[k] ^ LIKELY(k)) & visible[k];
#undef LIKELY
}

static void code_group(walk* w, pvs_group* g, uint32_t last) {
  const unsigned kinds =
      g->has_seen ? PVS_RUN_KINDS : kKindsOfRows + kKindsOfClass * kVisibleClasses;
  uint32_t i, words;
  for (i = 0; i < kinds; ++i) w->rice[i] = code_plain(w, w->rice[i], kRiceBits);
  code_members(w, g);
  words = g->member_count / 64 + (g->member_count % 64 != 0);
  for (i = 0; i <= last && i < g->leaves && !w->damaged; ++i) {
    likes l = {{NULL, NULL}, {NULL, NULL}};
    if (!code_likes(w, g, words, i, &l)) {
      w->damaged = 1;
      return;
    }
    code_visible(w, g, words, i, &l);
    if (g->has_seen) {
      code_seen(w, g, words, i, &l);
    } else if (w->mode == kRead) {
      memset(g->seen + (size_t)i * g->word_count, 0, (size_t)words * 8);
    }
  }
}

uint64_t pvs_group_words(uint32_t object_count) {
  const uint64_t row = object_count / 64 + (object_count % 64 != 0);
  return (object_count + (uint64_t)1) / 2 + (2 * PVS_GROUP_LEAVES + 3) * row;
}

void pvs_group_place(pvs_group* g, uint64_t* words) {
  g->word_count = g->object_count / 64 + (g->object_count % 64 != 0);
  g->visible = words;
  g->seen = g->visible + (size_t)PVS_GROUP_LEAVES * g->word_count;
  g->work = g->seen + (size_t)PVS_GROUP_LEAVES * g->word_count;
  g->members = (uint32_t*)(void*)(g->work + (size_t)3 * g->word_count);
}

int pvs_read_group(pvs_group* g, const unsigned char* begin, const unsigned char* end,
                   uint32_t last) {
  walk w;
  memset(&w.bits, 0, sizeof w.bits);
  w.mode = kRead;
  w.damaged = 0;
  w.bits.in = begin;
  w.bits.in_end = end;
  code_group(&w, g, last);
  return !w.damaged;
}

unsigned char* pvs_write_group(pvs_group* g, unsigned char* begin, unsigned char* end) {
  walk w;
  uint32_t kind, k;
  memset(&w, 0, sizeof w);
  w.mode = kCount;
  code_group(&w, g, g->leaves - 1);
  for (kind = 0; kind < PVS_RUN_KINDS; ++kind)
    for (k = 0; k <= kMostRice; ++k)
      if (w.cost[kind][k] < w.cost[kind][w.rice[kind]]) w.rice[kind] = k;
  w.mode = kWrite;
  w.bits.out = begin;
  w.bits.out_end = end;
  code_group(&w, g, g->leaves - 1);
  if (w.bits.count > 0) put_bits(&w.bits, 0, 8 - w.bits.count);
  return w.bits.overflow ? NULL : w.bits.out;
}
