#include "worker/visibility/occluder_ranking.hpp"

#include <algorithm>
#include <cmath>

#include "worker/visibility/hull_direction.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kBlock = 32;

// The faces of the box as seen from `eye`, by area and cosine, over the distance squared. A wall
// that stands askew may have the eye in its box and yet before it: then its points say how far.
double solid_angle_of(const Box& box, std::span<const Vec3> points, const Vec3& eye,
                      double least_distance) {
  const Vec3 size = box.size();
  Vec3 toward(0);
  for (int a = 0; a < 3; ++a) toward[a] = std::max({0.0, box.lo[a] - eye[a], eye[a] - box.hi[a]});
  if (toward == Vec3(0) && !points.empty()) toward = glm::abs(toward_hull(points, eye));
  const double distance = std::max(length(toward), least_distance);
  const double area =
      size.y * size.z * toward.x + size.x * size.z * toward.y + size.x * size.y * toward.z;
  return area / (distance * distance * distance);
}

bool is_larger(const RankedOccluder& a, const RankedOccluder& b) {
  return a.solid_angle > b.solid_angle || (a.solid_angle == b.solid_angle && a.index < b.index);
}

double squared_distance(const Box& box, const Vec3& p) {
  Vec3 off(0);
  for (int a = 0; a < 3; ++a) off[a] = std::max({0.0, box.lo[a] - p[a], p[a] - box.hi[a]});
  return dot(off, off);
}

}  // namespace

void sort_ranked(std::span<RankedOccluder> ranked) {
  std::sort(ranked.begin(), ranked.end(), is_larger);
}

bool owner_in(const Scene& scene, const Occluder& occluder, const VisibleSet& candidates) {
  for (const ObjectId owner : scene.owners(occluder))
    if (candidates.contains(owner) || !scene.object(owner).occludee) return true;
  return false;
}

void OccluderRanking::Owners::add(const Owners& other) {
  first = std::min(first, other.first);
  end = std::max(end, other.end);
}

bool OccluderRanking::Owners::any_in(const VisibleSet& candidates) const {
  return first < end && candidates.any_in(first, end - first);
}

OccluderRanking::OccluderRanking(const Scene& scene) : scene_(scene) {
  const auto occluders = scene.occluders();
  std::vector<std::uint32_t> ball_of(occluders.size(), 0);
  for (std::uint32_t i = 0; i < occluders.size(); ++i) {
    if (occluders[i].face_of >= 0) continue;
    const Vec3 center = occluders[i].box.center();
    ball_of[i] = static_cast<std::uint32_t>(balls_.size());
    Owners owners;
    bool only_occludees = true;
    for (const ObjectId owner : scene.owners(occluders[i])) {
      const bool occludee = scene.object(owner).occludee;
      only_occludees = only_occludees && occludee;
      owners.add(occludee ? Owners{index_of(owner), index_of(owner) + 1}
                          : Owners{0, scene.object_count()});
    }
    balls_.push_back(
        {{static_cast<float>(center.x), static_cast<float>(center.y), static_cast<float>(center.z)},
         static_cast<float>(0.5 * length(occluders[i].box.size())),
         i,
         0,
         0,
         owners,
         owners.end - owners.first == 1 || !only_occludees});
    if (balls_.size() % kBlock == 1) blocks_.emplace_back();
    Block& block = blocks_.back();
    block.owners.add(owners);
    block.around.add(center);
    block.largest = std::max(block.largest, balls_.back().radius);
  }
  for (const Occluder& o : occluders)
    if (o.face_of >= 0) ++balls_[ball_of[o.face_of]].face_count;
  std::uint32_t next = 0;
  for (Ball& ball : balls_) {
    ball.first_face = next;
    next += ball.face_count;
    ball.face_count = 0;
  }
  faces_.resize(next);
  for (std::uint32_t i = 0; i < occluders.size(); ++i) {
    if (occluders[i].face_of < 0) continue;
    Ball& ball = balls_[ball_of[occluders[i].face_of]];
    faces_[ball.first_face + ball.face_count++] = i;
  }
}

bool OccluderRanking::owned(const Ball& ball, const VisibleSet& candidates) const {
  if (!ball.owners.any_in(candidates)) return false;
  return ball.by_ids || owner_in(scene_, scene_.occluders()[ball.index], candidates);
}

void OccluderRanking::rank(const CellFrame& frame, const VisibleSet& candidates,
                           double least_solid_angle, std::size_t largest,
                           std::vector<RankedOccluder>& out) const {
  out.clear();
  const Box cell = frame.world_bounds();
  const Vec3 eye = cell.center();
  const double cell_radius = 0.5 * length(cell.size());
  const double least_distance = 1e-3 + 0.5 * cell_radius;
  const auto consider = [&](std::uint32_t index, std::uint32_t ball) {
    const Occluder& occluder = scene_.occluders()[index];
    const double solid_angle =
        solid_angle_of(occluder.box, scene_.points(occluder), eye, least_distance);
    if (solid_angle >= least_solid_angle) out.push_back({index, ball, solid_angle});
  };
  // No box in a ball of radius r at distance d spans more than about 4 (r / (d - r))^2.
  const auto is_small = [&](double radius, double squared) {
    const double reach = radius + cell_radius;
    return 4.0 * radius * radius < least_solid_angle * (0.5 * squared - reach * reach);
  };
  for (std::uint32_t i = 0; i < balls_.size(); ++i) {
    if (i % kBlock == 0) {
      // What is true of the largest radius at the least distance is so of all.
      const Block& block = blocks_[i / kBlock];
      if (is_small(block.largest, squared_distance(block.around, eye)) ||
          !block.owners.any_in(candidates)) {
        i += kBlock - 1;
        continue;
      }
    }
    const Ball& ball = balls_[i];
    const double dx = ball.center[0] - eye.x, dy = ball.center[1] - eye.y,
                 dz = ball.center[2] - eye.z;
    const double squared = dx * dx + dy * dy + dz * dz, reach = ball.radius + cell_radius;
    if (is_small(ball.radius, squared)) continue;
    if (!owned(ball, candidates)) continue;
    consider(ball.index, i);
    if (squared <= 4 * reach * reach)
      for (std::uint32_t f = 0; f < ball.face_count; ++f) consider(faces_[ball.first_face + f], i);
  }
  const std::size_t sorted = std::min(largest, out.size());
  std::partial_sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(sorted), out.end(),
                    is_larger);
}

}  // namespace pvsfarm
