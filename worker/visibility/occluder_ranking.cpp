#include "worker/visibility/occluder_ranking.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

// An upper bound, cheap enough for every occluder of the scene: the diagonal squared over the
// distance squared of the box.
double solid_angle_bound(const Box& box, const Box& cell) {
  double gap_squared = 0;
  for (int a = 0; a < 3; ++a) {
    const double gap = std::max({0.0, box.lo[a] - cell.hi[a], cell.lo[a] - box.hi[a]});
    gap_squared += gap * gap;
  }
  const Vec3 size = box.size();
  return dot(size, size) / std::max(gap_squared, 1e-12);
}

}  // namespace

bool owner_in(const Scene& scene, const Occluder& occluder, const VisibleSet& candidates) {
  for (const ObjectId owner : scene.owners(occluder))
    if (candidates.contains(owner) || !scene.object(owner).occludee) return true;
  return false;
}

void rank_occluders(const Scene& scene, const CellFrame& frame, const VisibleSet& candidates,
                    const RankingRequest& request, LocalOccluders& out) {
  out.list.clear();
  out.points.clear();
  const Box cell = frame.world_bounds();
  for (const Occluder& occluder : scene.occluders()) {
    if (solid_angle_bound(occluder.box, cell) < request.least_solid_angle) continue;
    if (!owner_in(scene, occluder, candidates)) continue;
    if (!legal_for_cell(scene, occluder, frame, request.near_m)) continue;
    add_local(scene, occluder, frame, request.ground_depth, out);
    if (out.list.back().solid_angle < request.least_solid_angle) {
      out.points.resize(out.list.back().first_point);
      out.list.pop_back();
    }
  }
  std::stable_sort(out.list.begin(), out.list.end(),
                   [](const auto& a, const auto& b) { return a.solid_angle > b.solid_angle; });
}

}  // namespace pvsfarm
