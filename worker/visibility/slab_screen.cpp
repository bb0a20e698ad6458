#include "worker/visibility/slab_screen.hpp"

#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/lanes.hpp"

namespace pvsfarm {
namespace {

struct LocalBoxes {
  Eight lo[3], hi[3];
};

// The least and the largest coordinate that all four views along one axis of [lo, hi] share.
PVSFARM_INLINE void shared(const Eight& lo, const Eight& hi, double h, const Eight* alpha,
                           Eight& least, Eight& most) {
  for (int face = 0; face < 2; ++face)
    for (const double v : {-h, h}) {
      const Eight &a = alpha[2 * face], &b = alpha[2 * face + 1];
      least = larger(smaller(v + (lo - v) * a, v + (lo - v) * b), least);
      most = smaller(larger(v + (hi - v) * a, v + (hi - v) * b), most);
    }
}

// The pixels from `first` to before `end` that lie wholly between; a millionth of a pixel does not
// count, occluders lose as much. Returns a flag for each lane that has any.
PVSFARM_INLINE Eight pixels_between(const Eight& least, const Eight& most, double from,
                                    double per_px, double count, std::int32_t* first,
                                    std::int32_t* end) {
  const Eight none = all_lanes(0), all = all_lanes(count);
  const Eight a = smaller(larger((least - from) * per_px - 1e-6, none), all);
  const Eight b = smaller(larger((most - from) * per_px + 1e-6, none), all);
  const EightInts floor_a = __builtin_convertvector(a, EightInts);
  const Eight up = __builtin_convertvector(floor_a, Eight) < a ? all_lanes(1) : none;
  const EightInts floor_b = __builtin_convertvector(b, EightInts);
  store_lanes(first, floor_a + __builtin_convertvector(up, EightInts));
  store_lanes(end, floor_b);
  return above(__builtin_convertvector(floor_b, Eight),
               __builtin_convertvector(floor_a, Eight) + up);
}

PVSFARM_DISPATCH
unsigned screen_boxes(const LocalBoxes& boxes, const PolygonPlane& plane, const BitGrid& grid,
                      const SlabScreen::Slab& slab, SlabScreen::Ranges& ranges) {
  const int u = plane.along, v = plane.across, w = plane.away;
  const bool ahead = plane.sign > 0;
  const Eight near = (ahead ? boxes.lo[w] : -boxes.hi[w]) - plane.half_away;
  const Eight far = (ahead ? boxes.hi[w] : -boxes.lo[w]) - plane.half_away;
  const double front = plane.front, back = plane.back;
  const Eight z_near = larger(near - front, all_lanes(plane.nearest));
  const Eight z_far = smaller(far - front, all_lanes(plane.deepest));
  const Eight met = smaller(far - slab.before, slab.bound - near);
  if (!(largest(met) > 0)) return 0;
  const Eight alpha[4] = {front / (z_near + front), front / (z_far + front), back / (z_near + back),
                          back / (z_far + back)};
  Eight least = all_lanes(grid.a0), most = all_lanes(grid.a0 + grid.columns * grid.pa);
  shared(boxes.lo[u], boxes.hi[u], plane.half_along, alpha, least, most);
  const Eight along = pixels_between(least, most, grid.a0, grid.per_pa, grid.columns,
                                     ranges.along_first, ranges.along_end);
  least = all_lanes(grid.b0), most = all_lanes(grid.b0 + grid.rows * grid.pb);
  shared(boxes.lo[v], boxes.hi[v], plane.half_across, alpha, least, most);
  const Eight across = pixels_between(least, most, grid.b0, grid.per_pb, grid.rows,
                                      ranges.across_first, ranges.across_end);
  return bits_of(above(met, all_lanes(0))) & bits_of(not_above(z_near, z_far)) & bits_of(along) &
         bits_of(across);
}

PVSFARM_DISPATCH
void move_boxes(const OccluderTree::Block& block, const Vec3& by, const SlabScreen::Slab& slab,
                LocalBoxes& out) {
  for (int a = 0; a < 3; ++a) {
    Eight lo = __builtin_convertvector(load_lanes<EightFloats>(block.lo[a]), Eight);
    if (a == 2) lo = lo <= slab.ground ? lo - slab.ground_depth : lo;
    out.lo[a] = lo + by[a];
    out.hi[a] = __builtin_convertvector(load_lanes<EightFloats>(block.hi[a]), Eight) + by[a];
  }
}

void turn_boxes(const OccluderTree::Block& block, const CellFrame& frame,
                const SlabScreen::Slab& slab, LocalBoxes& out) {
  for (int k = 0; k < OccluderTree::kWidth; ++k) {
    Box box{{block.lo[0][k], block.lo[1][k], block.lo[2][k]},
            {block.hi[0][k], block.hi[1][k], block.hi[2][k]}};
    if (!box.empty()) {
      const bool stands = box.lo.z <= slab.ground;
      box = frame.local_around_world(box);
      if (stands) box.lo.z -= slab.ground_depth;
    }
    for (int a = 0; a < 3; ++a) out.lo[a][k] = box.lo[a], out.hi[a][k] = box.hi[a];
  }
}

}  // namespace

unsigned SlabScreen::screen(const OccluderTree::Block& block, Ranges& ranges) const {
  LocalBoxes boxes;
  if (frame_.aligned())
    move_boxes(block, frame_.local_from_world(Vec3(0)), slab_, boxes);
  else
    turn_boxes(block, frame_, slab_, boxes);
  return screen_boxes(boxes, plane_, grid_, slab_, ranges);
}

}  // namespace pvsfarm
