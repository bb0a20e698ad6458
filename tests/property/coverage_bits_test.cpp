// Maps of bits, pixel by pixel: a re-projection covers what whole footprints certify and little
// less; the short way from a polygon to its pixels covers what the long way covers, and every ray
// through them meets the polygon no deeper than the map's bound.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "common/base/random.hpp"
#include "worker/visibility/polygon_cover.hpp"
#include "worker/visibility/slab_screen.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kWorlds = 300;

SweepPlane sweep_plane(const CellFrame& frame, Face face, double distance, MapAxis along,
                       double bound_step) {
  SweepPlane sweep{.plane = square_plane(frame, face, distance, 1.1, 256),
                   .along = along,
                   .row_count = 128,
                   .bound = distance * (1 + bound_step)};
  // Rows of a size of their own, as a sweep has them above level ground.
  double& from = along == MapAxis::kX ? sweep.plane.y0 : sweep.plane.x0;
  double& pixel = along == MapAxis::kX ? sweep.plane.py : sweep.plane.px;
  from *= 0.4;
  pixel = -2 * from / sweep.row_count;
  return sweep;
}

Cell random_cell(Random& random) {
  Vec3 half;
  for (int a = 0; a < 3; ++a) half[a] = 0.1 + 1.4 * random.unit() * random.unit();
  return Cell::aligned({-half, half});
}

void add_rectangle(Random& random, const SweepPlane& plane, CoverageList& list) {
  const ProjectionPlane& p = plane.plane;
  const bool x = plane.along == MapAxis::kX;
  const double width = p.px * (x ? p.resolution_px : plane.row_count);
  const double height = p.py * (x ? plane.row_count : p.resolution_px);
  const double x0 = p.x0 + width * random.between(0, 0.7);
  const double y0 = p.y0 + height * random.between(0, 0.7);
  list.coverages.push_back({x0, y0, std::min(x0 + width * random.unit(), p.x0 + width),
                            std::min(y0 + height * random.unit(), p.y0 + height),
                            static_cast<float>(-p.distance), 0, 0});
}

// Whether all pixels of `from` that rays to pixel (i, j) of `to` may cross are covered.
bool footprint_covered(const CoverageBits& from, const PixelSpan& along, const PixelSpan& across) {
  if (!along.valid() || !across.valid() || across.last >= from.where().row_count) return false;
  for (int j = across.first; j <= across.last; ++j)
    for (int i = along.first; i <= along.last; ++i)
      if (!from.covered_at(i, j)) return false;
  return true;
}

TEST(CoverageBits, a_gather_covers_whole_footprints_and_little_less) {
  std::uint64_t certified = 0, gathered = 0;
  for (std::uint64_t seed = 1; seed <= kWorlds && !HasFailure(); ++seed) {
    Random random(seed);
    const CellFrame frame(random_cell(random));
    const Face face = kFaces[random.below(6)];
    const MapAxis along = random.below(2) == 0 ? MapAxis::kX : MapAxis::kY;
    const MapAxis other = along == MapAxis::kX ? MapAxis::kY : MapAxis::kX;
    const double distance = random.between(1, 20), step = random.between(0.01, 0.2);
    const SweepPlane near = sweep_plane(frame, face, distance, along, 0.5 * step);
    const SweepPlane far = sweep_plane(frame, face, distance * (1 + step), along, 0.5 * step);
    CoverageBits from, to;
    from.reset(near);
    CoverageList list;
    for (int k = 0; k < 12; ++k) add_rectangle(random, near, list);
    from.draw(list);
    to.reset(far);
    to.gather(from);
    std::vector<PixelSpan> columns, rows;
    footprints(near.plane, far.plane, along, columns);
    footprints(near.plane, far.plane, other, rows);
    for (int j = 0; j < far.row_count; ++j)
      for (int i = 0; i < far.plane.resolution_px; ++i) {
        const bool whole = footprint_covered(from, columns[i], rows[j]);
        certified += whole ? 1 : 0;
        gathered += to.covered_at(i, j) ? 1 : 0;
        EXPECT_TRUE(whole || !to.covered_at(i, j)) << "seed " << seed << ": " << i << ", " << j;
      }
  }
  std::cout << gathered << " pixels of " << certified << " certified ones\n";
  EXPECT_GT(gathered, certified * 9 / 10);
}

// A triangle or a planar quad somewhere about the plane, often across it or across the bound.
std::vector<Vec3> random_polygon(Random& random, const CellFrame& frame, const SweepPlane& plane) {
  const ProjectionPlane& p = plane.plane;
  const double size = p.distance * random.between(0.02, 1.2);
  const auto point = [&](double spread) {
    return Vec3{random.between(-spread, spread), random.between(-spread, spread),
                random.between(-spread, spread)};
  };
  Vec3 middle = point(0.5 * p.distance);
  middle[p.face.axis] =
      p.face.sign * (frame.half()[p.face.axis] + p.distance + 0.3 * size * random.between(-1, 1));
  const Vec3 a = point(size), b = point(size);
  if (random.below(3) == 0) return {middle + a, middle + b, middle - a, middle - b};
  return {middle + a, middle + b, middle - a - b};
}

// Where the line from `eye` through `through` meets the polygon's plane; whether that is inside it.
bool meets(const std::vector<Vec3>& polygon, const Vec3& eye, const Vec3& through, Vec3& at) {
  Vec3 normal(0);
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    normal += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
  const double rise = dot(normal, through - eye);
  if (rise == 0) return false;
  at = eye + (through - eye) * (dot(normal, polygon[0] - eye) / rise);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (dot(cross(edge, at - polygon[i]), normal) < 0) return false;
  }
  return true;
}

Vec3 on_plane(const SweepPlane& plane, const CellFrame& frame, int i, int j, Random& random) {
  const ProjectionPlane& p = plane.plane;
  const bool x = plane.along == MapAxis::kX;
  Vec3 at;
  at[p.face.u()] = p.x0 + p.px * ((x ? i : j) + random.unit());
  at[p.face.v()] = p.y0 + p.py * ((x ? j : i) + random.unit());
  at[p.face.axis] = p.face.sign * (frame.half()[p.face.axis] + p.distance);
  return at;
}

// Rays from all over the cell, its corners first, through the pixel.
void expect_blocked(const std::vector<Vec3>& polygon, const CellFrame& frame,
                    const SweepPlane& plane, int i, int j, Random& random) {
  for (int ray = 0; ray < 12; ++ray) {
    Vec3 eye;
    for (int a = 0; a < 3; ++a)
      eye[a] = frame.half()[a] * (ray < 8 ? ((ray >> a) & 1) * 2 - 1 : random.between(-1, 1));
    Vec3 hit;
    ASSERT_TRUE(meets(polygon, eye, on_plane(plane, frame, i, j, random), hit)) << i << ", " << j;
    const double depth = plane.plane.beyond_face(hit);
    ASSERT_GT(depth, 0);
    ASSERT_LE(depth, plane.bound);
  }
}

TEST(PolygonCover, covers_what_the_long_way_does_and_rays_find_it_blocked) {
  std::uint64_t short_pixels = 0, long_pixels = 0, lost = 0, on_the_way = 0, screened = 0;
  for (std::uint64_t seed = 1; seed <= 15 * kWorlds && !HasFatalFailure(); ++seed) {
    Random random(seed);
    const CellFrame frame(random_cell(random));
    const MapAxis along = random.below(2) == 0 ? MapAxis::kX : MapAxis::kY;
    const SweepPlane plane = sweep_plane(frame, kFaces[random.below(6)], random.between(0.5, 20),
                                         along, random.between(0.01, 0.1));
    const std::vector<Vec3> points = random_polygon(random, frame, plane);
    if (side_of_cell(points, 0, frame) == 0) continue;
    const double nearest = nearest_depth(plane.plane, 0);
    CoverageBits by_short, by_long;
    by_short.reset(plane);
    by_long.reset(plane);
    RowShape shape;
    const PolygonPlane of_polygons = polygon_plane(plane, nearest, frame.offset_scale());
    const Cover cover = cover_polygon(of_polygons, points, 0, by_short, shape);
    if (cover == Cover::kLongWay) continue;
    ++on_the_way;

    LocalOccluders local;
    local.points = points;
    local.list.push_back({.point_count = static_cast<std::uint32_t>(points.size())});
    for (const Vec3& p : points) local.list[0].box.add(p);
    std::array<Piece, 2> pieces;
    CoverageList list;
    const int count = make_pieces(local, local.list[0], plane.plane, 0, pieces);
    for (int k = 0; k < count; ++k) project(pieces[k], plane.plane, frame.offset_scale(), list);
    by_long.draw(list);

    // A box that the screen turns away would have had no pixel.
    OccluderTree::Block block;
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 8; ++k) {
        block.lo[a][k] = std::nextafter(static_cast<float>(local.list[0].box.lo[a]), -HUGE_VALF);
        block.hi[a][k] = std::nextafter(static_cast<float>(local.list[0].box.hi[a]), HUGE_VALF);
      }
    SlabScreen::Ranges ranges;
    const SlabScreen screen(frame, of_polygons, by_short.grid(), {.bound = plane.bound});
    const unsigned passed = screen.screen(block, ranges);
    EXPECT_TRUE(passed == 0 || passed == 255) << "seed " << seed;
    screened += passed == 0 ? 1 : 0;

    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int j = 0; j < plane.row_count; ++j)
      for (int i = 0; i < plane.plane.resolution_px; ++i) {
        lost += by_long.covered_at(i, j) && !by_short.covered_at(i, j) ? 1 : 0;
        if (!by_short.covered_at(i, j)) continue;
        const BitRange range = ranges.of(static_cast<int>(seed % 8));
        ASSERT_NE(passed, 0u);
        ASSERT_TRUE(i >= range.along_first && i <= range.along_last && j >= range.across_first &&
                    j <= range.across_last)
            << i << ", " << j;
        if (random.below(4) == 0) expect_blocked(points, frame, plane, i, j, random);
      }
    short_pixels += by_short.covered_pixels();
    long_pixels += by_long.covered_pixels();
  }
  std::cout << on_the_way << " polygons, " << screened << " screened away, " << short_pixels
            << " pixels; the long way " << long_pixels << ", " << lost << " of them not here\n";
  EXPECT_GT(long_pixels, 0u);
  EXPECT_GT(short_pixels, long_pixels);  // what lies between plane and bound
  EXPECT_EQ(lost, 0u);
}

}  // namespace
}  // namespace pvsfarm
