#include "worker/visibility/occluder_ranking.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "worker/visibility/dispatch.hpp"
#include "worker/visibility/hull_direction.hpp"
#include "worker/visibility/lanes.hpp"

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

// Where a cell looks from, and what is too small for it.
struct Look {
  Vec3 eye;
  double cell_radius, least_distance, least_solid_angle;
};

// No box in a ball of radius r at distance d spans more than about 4 (r / (d - r))^2.
bool is_small(const Look& look, double radius, double squared) {
  const double reach = radius + look.cell_radius;
  return 4.0 * radius * radius < look.least_solid_angle * (0.5 * squared - reach * reach);
}

// A bit a lane: what is large enough, where the eye is in the box, and whose faces are to be looked
// at too.
struct Found {
  unsigned large, inside, near;
  alignas(64) double solid_angle[8];
};

PVSFARM_INLINE Eight lanes_of(const float* from) {
  return __builtin_convertvector(load_lanes<EightFloats>(from), Eight);
}

// is_small, and of the others solid_angle_of, operation by operation.
PVSFARM_DISPATCH
void look_at(const OccluderRanking::Lanes& lanes, const Look& look, Found& found) {
  const Eight radius = lanes_of(lanes.radius), reach = radius + look.cell_radius;
  const Eight dx = lanes_of(lanes.center[0]) - look.eye.x;
  const Eight dy = lanes_of(lanes.center[1]) - look.eye.y;
  const Eight dz = lanes_of(lanes.center[2]) - look.eye.z;
  const Eight squared = dx * dx + dy * dy + dz * dz, none = all_lanes(0);
  const Eight bound = look.least_solid_angle * (0.5 * squared - reach * reach);
  const unsigned not_small = bits_of(not_above(bound, 4.0 * radius * radius));
  found.large = found.inside = found.near = 0;
  if (not_small == 0) return;
  Eight size[3], toward[3];
  for (int a = 0; a < 3; ++a) {
    const Eight lo = load_lanes<Eight>(lanes.lo[a]), hi = load_lanes<Eight>(lanes.hi[a]);
    size[a] = hi - lo;
    toward[a] = larger(larger(lo - look.eye[a], look.eye[a] - hi), none);
  }
  const Eight away = toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2];
  Eight distance;
  for (int k = 0; k < 8; ++k) distance[k] = __builtin_sqrt(away[k]);
  distance = larger(distance, all_lanes(look.least_distance));
  const Eight area =
      size[1] * size[2] * toward[0] + size[0] * size[2] * toward[1] + size[0] * size[1] * toward[2];
  const Eight solid_angle = area / (distance * distance * distance);
  store_lanes(found.solid_angle, solid_angle);
  found.large = not_small & bits_of(not_above(all_lanes(look.least_solid_angle), solid_angle));
  found.inside =
      not_small & bits_of(not_above(larger(larger(toward[0], toward[1]), toward[2]), none));
  found.near = not_small & bits_of(not_above(squared, 4.0 * reach * reach));
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

void OccluderRanking::add_ball(std::uint32_t index) {
  const Occluder& occluder = scene_.occluders()[index];
  const Vec3 center = occluder.box.center();
  const float radius = static_cast<float>(0.5 * length(occluder.box.size()));
  Ball ball{.index = index};
  bool only_occludees = true;
  for (const ObjectId owner : scene_.owners(occluder)) {
    const bool occludee = scene_.object(owner).occludee;
    only_occludees = only_occludees && occludee;
    ball.owners.add(occludee ? Owners{index_of(owner), index_of(owner) + 1}
                             : Owners{0, scene_.object_count()});
  }
  ball.by_ids = ball.owners.end - ball.owners.first == 1 || !only_occludees;

  const std::size_t lane = balls_.size() % 8;
  if (lane == 0) lanes_.emplace_back();
  Lanes& lanes = lanes_.back();
  for (int a = 0; a < 3; ++a) {
    lanes.center[a][lane] = static_cast<float>(center[a]);
    lanes.lo[a][lane] = occluder.box.lo[a];
    lanes.hi[a][lane] = occluder.box.hi[a];
  }
  lanes.radius[lane] = radius;

  if (balls_.size() % kBlock == 0) blocks_.emplace_back();
  Block& block = blocks_.back();
  block.owners.add(ball.owners);
  block.around.add(center);
  block.largest = std::max(block.largest, radius);
  balls_.push_back(ball);
}

// `ball_of`: by occluder.
void OccluderRanking::add_faces(std::span<const std::uint32_t> ball_of) {
  const auto occluders = scene_.occluders();
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

OccluderRanking::OccluderRanking(const Scene& scene) : scene_(scene) {
  const auto occluders = scene.occluders();
  std::vector<std::uint32_t> ball_of(occluders.size(), 0);
  for (std::uint32_t i = 0; i < occluders.size(); ++i) {
    if (occluders[i].face_of >= 0) continue;
    ball_of[i] = static_cast<std::uint32_t>(balls_.size());
    add_ball(i);
  }
  add_faces(ball_of);
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
  const Look look{eye, cell_radius, least_distance, least_solid_angle};
  const auto consider = [&](std::uint32_t index, std::uint32_t ball) {
    const Occluder& occluder = scene_.occluders()[index];
    const double solid_angle =
        solid_angle_of(occluder.box, scene_.points(occluder), eye, least_distance);
    if (solid_angle >= least_solid_angle) out.push_back({index, ball, solid_angle});
  };
  Found found;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    // What is true of the largest radius at the least distance is so of all.
    const Block& block = blocks_[b];
    if (is_small(look, block.largest, squared_distance(block.around, eye)) ||
        !block.owners.any_in(candidates))
      continue;
    const std::size_t end = std::min((b + 1) * kBlock, balls_.size());
    for (std::size_t first = b * kBlock; first < end; first += 8) {
      look_at(lanes_[first / 8], look, found);
      for (unsigned rest = found.large | found.inside | found.near; rest != 0; rest &= rest - 1) {
        const int lane = std::countr_zero(rest);
        const auto i = static_cast<std::uint32_t>(first + lane);
        if (i >= end) break;
        const Ball& ball = balls_[i];
        const auto is = [lane](unsigned lanes) { return (lanes >> lane & 1) != 0; };
        const bool faces = is(found.near) && ball.face_count > 0;
        if (!faces && !is(found.large | found.inside)) continue;
        if (!owned(ball, candidates)) continue;
        if (is(found.inside))
          consider(ball.index, i);  // its points may have the word
        else if (is(found.large))
          out.push_back({ball.index, i, found.solid_angle[lane]});
        for (std::uint32_t f = 0; faces && f < ball.face_count; ++f)
          consider(faces_[ball.first_face + f], i);
      }
    }
  }
  const std::size_t sorted = std::min(largest, out.size());
  std::partial_sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(sorted), out.end(),
                    is_larger);
}

}  // namespace pvsfarm
