/* The cells that hold a point. */
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"

static double magnitude(const double v[3], double least) {
  int a;
  for (a = 0; a < 3; ++a) {
    if (v[a] > least) least = v[a];
    if (-v[a] > least) least = -v[a];
  }
  return least;
}

/* Exact for axis-aligned cells. For turned ones the coordinates along the axes are rounded: points
 * within that error of a face are in, so that no point falls between cells that share a face. */
static int cell_holds(const pvs_node_info* n, const double p[3]) {
  double d[3], det = 0, slack = 0;
  int a;
  if (!n->turned) {
    for (a = 0; a < 3; ++a)
      if (!(n->lo[a] <= p[a] && p[a] <= n->hi[a])) return 0;
    return 1;
  }
  for (a = 0; a < 3; ++a) d[a] = p[a] - n->origin[a];
  slack = magnitude(p, magnitude(n->origin, magnitude(n->lo, magnitude(n->hi, 0))));
  slack *= 1.0 / 70368744177664.0; /* 2^-46 */
  for (a = 0; a < 3; ++a) {        /* Cramer's rule: axes are orthogonal only up to a tolerance */
    const double* u = n->axes[(a + 1) % 3];
    const double* v = n->axes[(a + 2) % 3];
    const double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                              u[0] * v[1] - u[1] * v[0]};
    double t;
    if (a == 0)
      det = n->axes[0][0] * normal[0] + n->axes[0][1] * normal[1] + n->axes[0][2] * normal[2];
    t = (d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]) / det;
    if (!(n->lo[a] - slack <= t && t <= n->hi[a] + slack)) return 0;
  }
  return 1;
}

static int box_holds(const unsigned char* box, const double p[3]) {
  int a;
  for (a = 0; a < 3; ++a)
    if (!(load_f32(box + 4 * a) <= p[a] && p[a] <= load_f32(box + 12 + 4 * a))) return 0;
  return 1;
}

typedef struct finding {
  uint32_t* cells;
  uint32_t capacity, count;
  uint32_t visits_left; /* no node is visited twice, or the store is damaged */
} finding;

static void keep_lowest(finding* f, uint32_t cell) {
  uint32_t i = f->count < f->capacity ? f->count : f->capacity;
  ++f->count;
  if (f->capacity == 0) return;
  if (i == f->capacity && f->cells[--i] <= cell) return;
  for (; i > 0 && f->cells[i - 1] > cell; --i) f->cells[i] = f->cells[i - 1];
  f->cells[i] = cell;
}

/* Walks the nodes below a root in their order; a cell without the point skips its descendants. */
static pvs_status find_below(const pvs_store* s, uint32_t root, const double p[3], finding* f) {
  pvs_node_info info;
  uint32_t node = root, end;
  pvs_status status = pvs_node(s, root, &info);
  if (status != PVS_OK) return PVS_DAMAGED;
  for (end = info.end; node < end;) {
    if (f->visits_left == 0) return PVS_DAMAGED;
    --f->visits_left;
    status = pvs_node(s, node, &info);
    if (status != PVS_OK) return status;
    if (!cell_holds(&info, p)) {
      node = info.end;
      continue;
    }
    if (info.flags & PVS_FLAG_LEAF) keep_lowest(f, node);
    ++node;
  }
  return PVS_OK;
}

pvs_status pvs_find(const pvs_store* s, const double point[3], uint32_t* cells, uint32_t capacity,
                    uint32_t* count) {
  const double p[3] = {point[0], s->up_is_y ? -point[2] : point[1],
                       s->up_is_y ? point[1] : point[2]};
  finding f = {cells, capacity, 0, s->node_count};
  uint64_t i = 0;
  *count = 0;
  /* Boxes of level l cover 16^(l + 1) roots each. At root i, try the largest box that begins
   * there. */
  while (i < s->root_count) {
    uint32_t level = 0;
    uint64_t span = PVS_LOCATE_FANOUT;
    while (level + 1 < s->locate_levels && i % (span * PVS_LOCATE_FANOUT) == 0) {
      ++level;
      span *= PVS_LOCATE_FANOUT;
    }
    while (box_holds(s->locate_boxes[level] + i / span * PVS_LOCATE_BOX_BYTES, p)) {
      if (level == 0) {
        uint64_t root;
        for (root = i; root < i + span && root < s->root_count; ++root) {
          const pvs_status status = find_below(s, load_u32(s->locate_roots + root * 4), p, &f);
          if (status != PVS_OK) return status;
        }
        break;
      }
      --level;
      span /= PVS_LOCATE_FANOUT;
    }
    i += span;
  }
  *count = f.count;
  return PVS_OK;
}
