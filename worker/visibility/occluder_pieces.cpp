#include "worker/visibility/occluder_pieces.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/check.hpp"
#include "worker/visibility/hull_direction.hpp"

namespace pvsfarm {
namespace {

constexpr double kRounding = 0x1p-46;  // relative; dominates a dozen operations

Vec3 newell_normal(std::span<const Vec3> loop) {
  Vec3 n(0);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 a = loop[i] - loop[0], b = loop[(i + 1) % loop.size()] - loop[0];
    n += cross(a, b);
  }
  const double size = length(n);
  return size > 0 ? n / size : n;
}

// +1 if the whole cell lies strictly before the polygon, -1 strictly behind, 0 neither.
int side_of_cell(std::span<const Vec3> loop, double flatness, const CellFrame& frame) {
  const Vec3 n = newell_normal(loop);
  if (n == Vec3(0)) return 0;
  double scale = 0, offset = dot(n, loop[0]);
  for (const Vec3& p : loop) scale = std::max(scale, length(p));
  const double reach = std::abs(n.x) * frame.half().x + std::abs(n.y) * frame.half().y +
                       std::abs(n.z) * frame.half().z;
  // The normal of a loop that is flat up to `flatness` is off by a few flatness over its size;
  // the margin only decides whether the polygon is used, soundness rests on the half-planes.
  const double margin = 4 * flatness + kRounding * (scale + frame.offset_scale() + reach);
  if (-offset - reach > margin) return 1;
  if (offset - reach > margin) return -1;
  return 0;
}

bool apart(const Box& a, const Box& b, double gap) {
  for (int k = 0; k < 3; ++k)
    if (a.lo[k] - b.hi[k] > gap || b.lo[k] - a.hi[k] > gap) return true;
  return false;
}

Box local_box(const Scene& scene, const Occluder& occluder, const CellFrame& frame) {
  Box box;
  for (const Vec3& p : scene.points(occluder)) box.add(frame.local_from_world(p));
  return box;
}

bool apart_from_owners(const Scene& scene, const Occluder& occluder, const CellFrame& frame,
                       double gap) {
  for (const ObjectId owner : scene.owners(occluder))
    if (!apart(scene.object(owner).box, frame.world_bounds(), gap)) return false;
  return true;
}

// Whether a plane has the whole cell on one side and the hull of the solid's points more than `gap`
// away on the other: the plane across the way to the closest of them.
bool apart_across(const Scene& scene, const Occluder& solid, const CellFrame& frame, double gap) {
  std::array<Vec3, kMaxPiecePoints> local;
  const auto points = scene.points(solid);
  if (points.empty() || points.size() > local.size()) return false;
  double scale = frame.offset_scale() + length(frame.half());
  for (std::size_t i = 0; i < points.size(); ++i) {
    local[i] = frame.local_from_world(points[i]);
    scale = std::max(scale, length(local[i]));
  }
  const auto in_frame = std::span(local).first(points.size());
  const Vec3 n = toward_hull(in_frame, Vec3(0)), half = frame.half();
  double nearest = dot(n, in_frame[0]);
  for (const Vec3& p : in_frame) nearest = std::min(nearest, dot(n, p));
  const double reach = std::abs(n.x) * half.x + std::abs(n.y) * half.y + std::abs(n.z) * half.z;
  return nearest - reach > (gap + 4 * kRounding * scale) * length(n);
}

// Whether the cell keeps more than `near_m` from the matter the solid stands for: from its box, in
// the world's or the cell's axes, or from its points; and from its owners where their matter
// reaches farther.
bool solid_apart(const Scene& scene, const Occluder& solid, const CellFrame& frame, double near_m) {
  const Box cell_box{-frame.half(), frame.half()};
  const double gap = near_m + solid.flatness;
  if (!solid.closed && !apart_from_owners(scene, solid, frame, gap)) return false;
  return apart(solid.box, frame.world_bounds(), gap) ||
         (!frame.aligned() && apart(local_box(scene, solid, frame), cell_box, gap)) ||
         apart_across(scene, solid, frame, gap);
}

}  // namespace

bool legal_for_cell(const Scene& scene, const Occluder& occluder, const CellFrame& frame,
                    double near_m) {
  if (occluder.point_count < 3) return false;
  if (occluder.shape == OccluderShape::kSolid) {
    // Matter nearer than the near clip disappears, and with it a solid's front: keep off it.
    if (occluder.point_count + occluder.base_points > kMaxPiecePoints / 2) return false;
    return solid_apart(scene, occluder, frame, near_m);
  }
  if (occluder.point_count > kMaxPiecePoints - 2) return false;
  if (occluder.face_of >= 0 &&
      solid_apart(scene, scene.occluders()[occluder.face_of], frame, near_m))
    return false;  // the solid itself serves
  std::array<Vec3, kMaxPiecePoints> loop;
  const auto points = scene.points(occluder);
  for (std::size_t i = 0; i < points.size(); ++i) loop[i] = frame.local_from_world(points[i]);
  const int side = side_of_cell(std::span(loop).first(points.size()), occluder.flatness, frame);
  if (side == 0) return false;
  if (!occluder.one_sided || side > 0) return true;
  // A back face of a closed mesh: whoever stands outside has passed a front face before it.
  return occluder.closed && apart_from_owners(scene, occluder, frame, near_m);
}

void add_local(const Scene& scene, const Occluder& occluder, const CellFrame& frame,
               double ground_depth, double solid_angle, LocalOccluders& out) {
  LocalOccluder local;
  local.source = &occluder;
  local.first_point = static_cast<std::uint32_t>(out.points.size());
  local.solid = occluder.shape == OccluderShape::kSolid;
  local.flatness = occluder.flatness;
  local.solid_angle = solid_angle;
  const auto points = scene.points(occluder);
  const std::uint32_t base = ground_depth > 0 ? occluder.base_points : 0;
  const Vec3 down{0, 0, ground_depth};
  if (local.solid && occluder.is_box && frame.aligned()) {
    local.box_shaped = true;
    local.box.add(frame.local_from_world(base > 0 ? occluder.box.lo - down : occluder.box.lo));
    local.box.add(frame.local_from_world(occluder.box.hi));
    out.list.push_back(local);
    return;
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Vec3 p = frame.local_from_world(points[i]);
    if (i >= base || !occluder.is_prism) out.points.push_back(p);
    if (i < base) out.points.push_back(frame.local_from_world(points[i] - down));
  }
  local.point_count = static_cast<std::uint32_t>(out.points.size()) - local.first_point;
  for (std::size_t i = local.first_point; i < out.points.size(); ++i) local.box.add(out.points[i]);
  out.list.push_back(local);
}

namespace {

// Part of a box-shaped piece with z in [from, to].
bool slab(const Box& box, double from, double to, Piece& piece) {
  piece.box = box;
  piece.box.lo.z = std::max(box.lo.z, from);
  piece.box.hi.z = std::min(box.hi.z, to);
  piece.solid = piece.box_shaped = true;
  piece.point_count = 8;
  piece.cut_edges = {-1, -1};
  for (int k = 0; k < 8; ++k) piece.points[k] = piece.box.corner(k);
  return piece.box.lo.z <= piece.box.hi.z;
}

// Points of the hull of `points` with z in [from, to]: those inside, and every crossing of a pair.
bool slab(std::span<const Vec3> points, double from, double to, Piece& piece) {
  piece.solid = true;
  piece.box_shaped = false;
  piece.cut_edges = {-1, -1};
  piece.point_count = 0;
  piece.box = Box{};
  const auto add = [&piece](const Vec3& p) {
    if (piece.point_count == kMaxPiecePoints) return false;
    piece.points[piece.point_count++] = p;
    piece.box.add(p);
    return true;
  };
  for (const Vec3& p : points)
    if (from <= p.z && p.z <= to && !add(p)) return false;
  for (const double cut : {from, to})
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j) {
        const double a = points[i].z - cut, b = points[j].z - cut;
        if (!((a < 0 && b > 0) || (a > 0 && b < 0))) continue;
        Vec3 p = points[i] + (points[j] - points[i]) * (a / (a - b));
        p.z = cut;
        // A full list only drops points: the hull of the rest is inside the occluder.
        if (!add(p)) return piece.point_count >= 3;
      }
  return piece.point_count >= 3;
}

// Cuts away what of a polygon piece lies below z = cut (keep_above), or above it. The loop stays in
// order; each cut is one new edge, named in cut_edges[keep_above ? 0 : 1].
bool cut_polygon(Piece& piece, double cut, bool keep_above) {
  const auto is_in = [&](const Vec3& p) { return keep_above ? p.z >= cut : p.z <= cut; };
  const int count = piece.point_count;
  if (std::all_of(piece.points.begin(), piece.points.begin() + count, is_in)) return true;
  std::array<Vec3, kMaxPiecePoints> loop;
  std::copy_n(piece.points.begin(), count, loop.begin());
  const std::array<int, 2> old_edges = piece.cut_edges;
  piece.point_count = 0;
  piece.box = Box{};
  const auto add = [&piece](const Vec3& p) {
    piece.points[piece.point_count++] = p;
    piece.box.add(p);
  };
  int cuts = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 &p = loop[i], &q = loop[(i + 1) % count];
    const bool in = is_in(p), next_in = is_in(q);
    // An older cut's edge goes on from here, or from the point where it comes in again.
    for (int k = 0; k < 2; ++k)
      if (old_edges[k] == i) piece.cut_edges[k] = in || next_in ? piece.point_count : -1;
    if (in) add(p);
    if (in == next_in) continue;
    if (++cuts > 2) return false;  // not convex enough to be cut once: leave it out
    Vec3 c = p + (q - p) * ((p.z - cut) / (p.z - q.z));
    c.z = cut;
    if (in) piece.cut_edges[keep_above ? 0 : 1] = piece.point_count;  // leaves here: it starts at c
    add(c);
  }
  return piece.point_count >= 3;
}

// The polygon with its loop in plane coordinates, and the part of it before the plane if it reaches
// beyond: a wall askew is deep at its far end, what of it lies before the plane is not.
int polygon_pieces(std::span<const Vec3> loop, double from, double flatness,
                   std::array<Piece, 2>& pieces) {
  Piece& whole = pieces[0];
  whole.solid = whole.box_shaped = false;
  whole.flatness = flatness;
  whole.cut_edges = {-1, -1};
  whole.point_count = static_cast<int>(loop.size());
  whole.box = Box{};
  for (std::size_t i = 0; i < loop.size(); ++i) whole.box.add(whole.points[i] = loop[i]);
  if (!cut_polygon(whole, from, true)) return 0;
  const bool crosses = whole.box.lo.z < 0 && whole.box.hi.z > 0;
  if (flatness > 0 && (crosses || whole.cut_edges[0] >= 0)) {
    const Vec3 n = newell_normal(loop);
    whole.cut_sine = std::sqrt(n.x * n.x + n.y * n.y);
  }
  if (!crosses) return 1;
  pieces[1] = whole;
  return cut_polygon(pieces[1], 0, false) ? 2 : 1;
}

}  // namespace

int make_pieces(const LocalOccluders& all, const LocalOccluder& occluder,
                const ProjectionPlane& plane, double near_m, std::array<Piece, 2>& pieces) {
  const double nearest = nearest_depth(plane, near_m);
  const Box box = plane.plane_from_local(occluder.box);
  if (!(box.hi.z > nearest)) return 0;
  int count = 0;
  if (occluder.box_shaped) {
    if (box.lo.z < 0 && slab(box, nearest, 0, pieces[count])) ++count;
    if (box.hi.z > 0 && slab(box, std::max(nearest, 0.0), box.hi.z, pieces[count])) ++count;
    return count;
  }
  std::array<Vec3, kMaxPiecePoints> points;
  const auto local = all.points_of(occluder);
  PVS_CHECK_LE(local.size(), points.size());
  for (std::size_t i = 0; i < local.size(); ++i) points[i] = plane.plane_from_local(local[i]);
  const std::span<const Vec3> in_plane = std::span(points).first(local.size());
  if (!occluder.solid) {
    // Inside its border the matter may dip by twice the flatness: keep that beyond the face too.
    const double from = nearest + 4 * occluder.flatness;
    return polygon_pieces(in_plane, from, occluder.flatness, pieces);
  }
  if (box.lo.z < 0 && slab(in_plane, nearest, 0, pieces[count])) ++count;
  if (box.hi.z > 0 && slab(in_plane, std::max(nearest, 0.0), box.hi.z, pieces[count])) ++count;
  return count;
}

}  // namespace pvsfarm
