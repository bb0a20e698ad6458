#include "tests/adversarial/reference/slice_reference.hpp"

#include <map>

namespace pvsfarm::reference {
namespace {

// Every directed edge once, and its reverse once.
bool watertight(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> directed;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : directed) {
    const auto reverse = directed.find({edge.second, edge.first});
    if (count != 1 || reverse == directed.end() || reverse->second != 1) return false;
  }
  return true;
}

// Of a watertight mesh; doubt is inside.
bool outside(const TriangleMesh& mesh, const IntBox& cell) {
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    int front = 0, back = 0, apart = 0;
    for (const IntPoint& corner : cell.corners()) {
      front += mesh.side(t, corner) > 0;
      back += mesh.side(t, corner) < 0;
    }
    for (int axis = 0; axis < 3; ++axis) {
      int below = 0, above = 0;
      for (int k = 0; k < 3; ++k) {
        below += mesh.corner(t, k)[axis] < cell.lo[axis];
        above += mesh.corner(t, k)[axis] > cell.hi[axis];
      }
      apart += below == 3 || above == 3;
    }
    if (front < 8 && back < 8 && apart == 0) return false;  // may touch the cell
  }
  // A far point, in a direction that no edge of a tidy mesh shares.
  const IntPoint from = cell.lo, far{{from[0] + 1'000'003, from[1] + 777'781, from[2] - 999'983}};
  bool odd = false;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    const Stab answer = stab(from, far, mesh, t);
    if (answer == Stab::kDegenerate) return false;
    odd ^= answer == Stab::kHit;
  }
  return !odd;
}

Vec3 crossing(const Vec3& a, const Vec3& b, double z) {
  return a + (b - a) * ((z - a.z) / (b.z - a.z));
}

}  // namespace

std::optional<Slice> Slice::of(const TriangleMesh& mesh, std::int64_t z, const IntBox& cell,
                               SliceCheck check) {
  if (check == SliceCheck::kWatertightAndOutside && !(watertight(mesh) && outside(mesh, cell)))
    return std::nullopt;
  Slice slice;
  slice.z_ = z;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    std::vector<Vec3> ends;
    for (int k = 0; k < 3; ++k) {
      const IntPoint &p = mesh.corner(t, k), &q = mesh.corner(t, (k + 1) % 3);
      if ((p[2] >= z) != (q[2] >= z))
        ends.push_back(crossing(to_vec(p), to_vec(q), static_cast<double>(z)));
    }
    if (ends.size() == 2) slice.contour_.push_back({ends[0], ends[1]});
  }
  return slice;
}

bool Slice::covers(const Box& r) const {
  int right_of_corner = 0;
  for (const auto& [a, b] : contour_) {
    // Its bounds may meet the rectangle: doubt.
    if (std::max(a.x, b.x) >= r.lo.x && std::min(a.x, b.x) <= r.hi.x &&
        std::max(a.y, b.y) >= r.lo.y && std::min(a.y, b.y) <= r.hi.y)
      return false;
    if ((a.y > r.lo.y) != (b.y > r.lo.y))
      right_of_corner += a.x + (b.x - a.x) * (r.lo.y - a.y) / (b.y - a.y) > r.lo.x;
  }
  return right_of_corner % 2 == 1;
}

bool Slice::hides(const IntBox& cell, const IntBox& occludee) const {
  if (cell.hi[2] >= z_ || occludee.lo[2] <= z_) return false;
  Box where;
  for (const IntPoint& v : cell.corners())
    for (const IntPoint& m : occludee.corners())
      where.add(crossing(to_vec(v), to_vec(m), static_cast<double>(z_)));
  return covers(where);
}

}  // namespace pvsfarm::reference
