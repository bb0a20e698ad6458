// Shield-flood: the parity theorem on integers, without a walk along the tube.
#include "tests/adversarial/reference/shield_reference.hpp"

namespace pvsfarm::reference {
namespace {

constexpr int kMostRays = 8;

IntPoint point_in(const IntBox& box, Random& random) {
  IntPoint p;
  for (int k = 0; k < 3; ++k)
    p[k] = box.lo[k] + static_cast<std::int64_t>(
                           random.below(static_cast<std::uint64_t>(box.hi[k] - box.lo[k] + 1)));
  return p;
}

// Certified apart: beyond a face of the box, or the box wholly on one side of the triangle.
bool may_touch(const TriangleMesh& mesh, int t, const IntBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    int below = 0, above = 0;
    for (int k = 0; k < 3; ++k) {
      below += mesh.corner(t, k)[axis] < box.lo[axis];
      above += mesh.corner(t, k)[axis] > box.hi[axis];
    }
    if (below == 3 || above == 3) return false;
  }
  int front = 0, back = 0;
  for (int k = 0; k < 8; ++k) {
    const int side = mesh.side(t, box.corner(k));
    front += side > 0;
    back += side < 0;
  }
  return front < 8 && back < 8;
}

class Flood {
 public:
  Flood(const TriangleMesh& mesh, const IntBox& a, const IntBox& b)
      : mesh_(mesh), a_(a), b_(b), edges_(mesh), hull_(hull_of(a.corners(), b.corners())) {}

  // Marks what the segment stabs; false: a degenerate sign.
  bool cast(const IntPoint& from, const IntPoint& to) {
    stabbed_.assign(mesh_.triangles.size(), false);
    visited_ = stabbed_;
    for (std::size_t t = 0; t < stabbed_.size(); ++t) {
      const Stab answer = stab(from, to, mesh_, static_cast<int>(t));
      if (answer == Stab::kDegenerate) return false;
      stabbed_[t] = answer == Stab::kHit;
    }
    return true;
  }

  ShieldAnswer answer() {
    bool any = false;
    for (std::size_t t = 0; t < stabbed_.size(); ++t) {
      any |= stabbed_[t];
      if (stabbed_[t] && !visited_[t] && shields(static_cast<int>(t))) return ShieldAnswer::kHidden;
    }
    return any ? ShieldAnswer::kUnknown : ShieldAnswer::kFree;
  }

 private:
  // Floods from t over every edge that may meet the hull. Such an edge has all its triangles in the
  // flooded set, so the set has no border there if their number is even.
  bool shields(int t) {
    std::vector<int> open{t};
    visited_[t] = true;
    bool sound = true, odd = false;
    while (!open.empty()) {
      const int s = open.back();
      open.pop_back();
      odd ^= stabbed_[s];
      sound = sound && !may_touch(mesh_, s, a_) && !may_touch(mesh_, s, b_);
      for (int k = 0; k < 3; ++k) {
        const int p = mesh_.triangles[s][k], q = mesh_.triangles[s][(k + 1) % 3];
        if (hull_ && misses_hull(*hull_, mesh_.vertices[p], mesh_.vertices[q])) continue;
        const std::vector<int>& around = edges_.around(p, q);
        sound = sound && around.size() % 2 == 0;
        for (const int other : around)
          if (!visited_[other]) visited_[other] = true, open.push_back(other);
      }
    }
    return sound && odd;
  }

  const TriangleMesh& mesh_;
  const IntBox &a_, &b_;
  EdgeMap edges_;
  std::optional<Hull> hull_;
  std::vector<bool> stabbed_, visited_;
};

}  // namespace

ShieldAnswer flood(const TriangleMesh& mesh, const IntBox& a, const IntBox& b, Random& random) {
  Flood flood_from(mesh, a, b);
  for (int ray = 0; ray < kMostRays; ++ray)
    if (flood_from.cast(point_in(a, random), point_in(b, random))) return flood_from.answer();
  return ShieldAnswer::kUnknown;
}

}  // namespace pvsfarm::reference
