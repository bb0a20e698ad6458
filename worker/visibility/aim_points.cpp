#include "worker/visibility/aim_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pvsfarm {
namespace {

// How far a point moves from a corner to the centre of the inscribed circle, beside the margin.
constexpr double kIntoTriangle = 0.01;
constexpr double kHardly = 1e-3;

// Which of the cell's coordinates lie at an end for a seeded viewpoint: edge, face, inside.
constexpr int kEnds[4] = {2, 1, 2, 0};

}  // namespace

Vec3 viewpoint(const Cell& cell, std::uint64_t k, Random& random) {
  // Opposite corners follow each other.
  constexpr int kOrder[8] = {4, 7, 5, 6, 0, 3, 1, 2};
  if (k < 8) return cell.corner(kOrder[k]);
  Vec3 t = cell.lo * 0.5 + cell.hi * 0.5;
  if (k > 8) {
    const std::uint64_t first = random.below(3);
    for (int j = 0; j < 3; ++j) {
      const int a = static_cast<int>(first + j) % 3;
      const bool upper = random.next() & 1;
      t[a] = j < kEnds[k % 4]
                 ? (upper ? cell.hi[a] : cell.lo[a])
                 : std::clamp(random.between(cell.lo[a], cell.hi[a]), cell.lo[a], cell.hi[a]);
    }
  }
  // What is above sees more.
  if (k == 8 || k % 4 != 3) t.z = cell.hi.z;
  return cell.point(t);
}

AimPoints::AimPoints(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), corners_(scene_->object_count()) {}

const std::vector<AimPoints::Corner>& AimPoints::corners_of(ObjectId object) {
  std::vector<Corner>& corners = corners_[index_of(object)];
  const auto triangles = scene_->triangles(object);
  if (!corners.empty() || triangles.empty()) return corners;
  const Vec3 size = scene_->object(object).box.size();
  // All corners in one pass: a tree's leaves do not fit into the cache.
  std::array<Vec3, kCorners> out, tip;
  for (std::uint64_t k = 0; k < kCorners; ++k) {
    // Of the highest the outermost: the heights of a mesh differ by more than this share of x and
    // y.
    const double x = k < 4 ? kHardly * size.z / (size.x + size.y + size.z) : 1;
    out[k] = {k & 1 ? x : -x, k & 2 ? x : -x, k < 8 ? 1.0 : -1.0};
    corners.push_back({.vertex = triangles[0].vertex[0]});
    tip[k] = scene_->vertices()[triangles[0].vertex[0]];
  }
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t.vertex) {
      const Vec3 at = scene_->vertices()[v];
      for (std::uint64_t k = 0; k < kCorners; ++k)
        if (dot(at - tip[k], out[k]) > 0) corners[k].vertex = v, tip[k] = at;
    }
  const auto first = static_cast<std::uint32_t>(scene_->object(object).first_triangle);
  for (std::uint32_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t v : triangles[i].vertex) {
      const Vec3 at = scene_->vertices()[v];
      for (std::uint64_t k = 0; k < kCorners; ++k)
        if (at == tip[k] && corners[k].count < kFan)
          corners[k].triangle[corners[k].count++] = first + i;
    }
  return corners;
}

bool AimPoints::faces(std::uint32_t triangle, const Vec3& eye) const {
  const Triangle& t = scene_->all_triangles()[triangle];
  const Vec3 a = scene_->vertices()[t.vertex[0]];
  const Vec3 n = cross(scene_->vertices()[t.vertex[1]] - a, scene_->vertices()[t.vertex[2]] - a);
  return dot(n, eye - a) > 0;
}

// Moves a point of the triangle towards the centre of the inscribed circle, until it lies inside by
// the margin and a little more.
std::optional<AimPoint> AimPoints::inside(std::uint32_t triangle, const Vec3& at,
                                          double margin) const {
  const Triangle& t = scene_->all_triangles()[triangle];
  const Vec3 a = scene_->vertices()[t.vertex[0]], b = scene_->vertices()[t.vertex[1]],
             c = scene_->vertices()[t.vertex[2]];
  const double to_a = length(c - b), to_b = length(a - c), to_c = length(b - a);
  const double round = to_a + to_b + to_c;
  const double radius = length(cross(b - a, c - a)) / round;
  if (!(radius > 2 * margin)) return {};
  const Vec3 center = a * (to_a / round) + b * (to_b / round) + c * (to_c / round);
  const double part = std::min(1.0, 2 * margin / radius + kIntoTriangle);
  return AimPoint{at + (center - at) * part, triangle};
}

std::optional<AimPoint> AimPoints::at_corner(ObjectId object, std::uint64_t k, bool along_rim,
                                             Random& random, const Vec3& eye, double margin) {
  const std::vector<Corner>& corners = corners_of(object);
  if (corners.empty()) return {};
  const Corner& corner = corners[k % corners.size()];
  const auto vertices = scene_->vertices();
  const Vec3 tip = vertices[corner.vertex];
  const std::uint64_t start = random.below(kFan);
  for (const bool facing : {true, false}) {
    if (!facing && !scene_->object(object).two_sided) break;
    for (std::uint32_t i = 0; i < corner.count; ++i) {
      const std::uint32_t number = corner.triangle[(start + i) % corner.count];
      if (faces(number, eye) != facing) continue;
      Vec3 at = tip;
      if (along_rim) {
        Vec3 highest{0, 0, -std::numeric_limits<double>::infinity()};
        for (const std::uint32_t v : scene_->all_triangles()[number].vertex)
          if (vertices[v] != tip && vertices[v].z > highest.z) highest = vertices[v];
        if (std::isfinite(highest.z)) at += (highest - tip) * random.unit();
      }
      const auto point = inside(number, at, margin);
      if (point) return point;
    }
  }
  return {};
}

std::optional<AimPoint> AimPoints::corner(ObjectId object, std::uint64_t k, Random& random,
                                          const Vec3& eye, double margin) {
  return at_corner(object, k, false, random, eye, margin);
}

std::optional<AimPoint> AimPoints::rim(ObjectId object, std::uint64_t k, Random& random,
                                       const Vec3& eye, double margin) {
  return at_corner(object, k, true, random, eye, margin);
}

std::optional<AimPoint> AimPoints::anywhere(ObjectId object, Random& random, const Vec3& eye,
                                            double margin) const {
  constexpr int kTries = 4;
  const ObjectRecord& record = scene_->object(object);
  std::optional<AimPoint> point;
  if (record.triangle_count == 0) return point;
  for (int i = 0; i < kTries; ++i) {
    const auto pick =
        static_cast<std::uint32_t>(record.first_triangle + random.below(record.triangle_count));
    double u = random.unit(), v = random.unit();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const bool facing = faces(pick, eye);
    if (!facing && (!record.two_sided || point)) continue;
    const Triangle& t = scene_->all_triangles()[pick];
    const Vec3 a = scene_->vertices()[t.vertex[0]];
    const Vec3 at =
        a + (scene_->vertices()[t.vertex[1]] - a) * u + (scene_->vertices()[t.vertex[2]] - a) * v;
    const auto found = inside(pick, at, margin);
    if (found) point = found;
    if (found && facing) break;
  }
  return point;
}

}  // namespace pvsfarm
