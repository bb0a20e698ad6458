#include "worker/evaluator/wanted_tiles.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

// Of a box that crosses the face, what lies nearer beyond it than this part of the way to the
// nearest plane falls anywhere, and hardly ever on pixels that are all covered.
constexpr double kNearFace = 0.125;

// None: all of it does.
bool cut_near_face(const ProjectionPlane& plane, Box& local_box) {
  const Face face = plane.face;
  const double from = plane.hw + kNearFace * plane.distance;
  double& near = face.sign > 0 ? local_box.lo[face.axis] : local_box.hi[face.axis];
  const double far = face.sign * (face.sign > 0 ? local_box.hi : local_box.lo)[face.axis];
  if (face.sign * near > plane.hw) return true;
  if (!(far > from)) return false;
  near = face.sign * from;
  return true;
}

}  // namespace

void WantedTiles::add(const Group& group) {
  for (std::size_t k = 0; k < group.count; ++k) {
    const auto pixels = group.planes.pixels(k);
    if (!pixels) continue;
    std::uint8_t* const wanted = wanted_[group.first + k].data();
    const int side = sides_[group.first + k];
    const int from = pixels->i0 >> kTileLevel, to = (pixels->i1 >> kTileLevel) + 1;
    for (int j = pixels->j0 >> kTileLevel; j <= pixels->j1 >> kTileLevel; ++j)
      std::fill(wanted + j * side + from, wanted + j * side + to, 1);
  }
}

void WantedTiles::find(const Scene& scene, const CellFrame& frame, const VisibleSet& open,
                       std::span<const ProjectionPlane> planes) {
  groups_.clear();
  for (std::size_t m = 0; m < planes.size(); m += groups_.back().count) {
    Group& group = groups_.emplace_back();
    group.first = m;
    group.count = group.planes.set(planes.subspan(m));
  }
  sides_.clear();
  if (wanted_.size() < planes.size()) wanted_.resize(planes.size());
  for (std::size_t m = 0; m < planes.size(); ++m) {
    sides_.push_back(planes[m].resolution_px >> kTileLevel);
    wanted_[m].assign(static_cast<std::size_t>(sides_[m]) * sides_[m], 0);
  }
  open.for_each([&](ObjectId id) {
    const Box box = frame.local_around_world(scene.object(id).box);
    for (Group& group : groups_) {
      Box beyond = box;
      if (!cut_near_face(group.planes.nearest_plane(), beyond)) continue;
      group.planes.place(beyond);
      add(group);
    }
  });
}

void WantedTiles::restrict(std::size_t k, OcclusionMap& map) const {
  const std::span<float> tiles = map.tiles();
  for (std::size_t t = 0; t < tiles.size(); ++t)
    if (wanted_[k][t] == 0) tiles[t] = -kUncovered;
}

}  // namespace pvsfarm
