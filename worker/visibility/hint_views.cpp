#include "worker/visibility/hint_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "worker/visibility/ray_scene.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Points that face the viewpoint, of each object, and how many are drawn at most to find them.
constexpr std::uint32_t kPoints = 4, kDraws = 16;

double wrapped(double u) { return u - std::floor(u); }

// The k-th viewpoint of the cell: an additive recurrence, whose points fill the cell evenly however
// many there are, begun at a place of the cell's own.
Vec3 eye_of(const Cell& cell, const Vec3& start, std::uint32_t k) {
  constexpr Vec3 kStep{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  Vec3 t{0};
  for (int a = 0; a < 3; ++a)
    t[a] = cell.lo[a] + (cell.hi[a] - cell.lo[a]) * wrapped(start[a] + kStep[a] * k);
  return cell.point(t);
}

// No more than the ball around its box covers. [units] steradians
double most_of(const Box& box, const Vec3& eye) {
  const double radius = length(box.size()) / 2, distance = length((box.lo + box.hi) * 0.5 - eye);
  if (!(distance > radius)) return 4 * kPi;
  const double sine = radius / distance;
  return 2 * kPi * (1 - std::sqrt(1 - sine * sine));
}

}  // namespace

HintViews::HintViews(std::shared_ptr<const Scene> scene, std::uint32_t viewpoints)
    : scene_(std::move(scene)), viewpoints_(viewpoints) {
  PVS_CHECK(viewpoints_ > 0);
}

// Points spread evenly over the triangles: each that shows stands for the solid angle of its
// triangle's area there, times the number of triangles over the number of draws, so that the sum
// over those that show is right on average. What an object hides of itself is counted as shown.
void HintViews::aim(const Vec3& eye, ObjectId object, std::uint32_t position, Sampler& sampler) {
  const ObjectRecord& record = scene_->object(object);
  const std::size_t first = lines_.size();
  std::uint32_t draws = 0;
  while (draws < kDraws && lines_.size() - first < kPoints) {
    ++draws;
    const auto triangle =
        static_cast<std::uint32_t>(record.first_triangle + random_.below(record.triangle_count));
    double u = random_.unit(), v = random_.unit();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const SeenTriangle t(*scene_, triangle, eye);
    const Vec3 p = t.corner[0] * (1 - u - v) + t.corner[1] * u + t.corner[2] * v;
    const double rise = record.two_sided ? std::abs(dot(t.normal, p)) : -dot(t.normal, p);
    const double distance = length(p);
    if (t.degenerate() || !(rise > 0) || !(distance > 0)) continue;
    lines_.push_back({eye, eye + p});
    targets_.push_back({object, triangle});
    // area * cosine / distance^2; the normal is twice the area long
    tried_.push_back({position, rise / (2 * distance * distance * distance)});
  }
  for (std::size_t i = first; i < lines_.size(); ++i)
    tried_[i].share *= static_cast<double>(record.triangle_count) / draws;
  if (lines_.size() + kPoints > RayScene::kBatch) settle(sampler);
}

void HintViews::settle(Sampler& sampler) {
  std::array<std::uint8_t, RayScene::kBatch> shows{};
  sampler.try_lines(lines_, targets_, std::span(shows).first(lines_.size()));
  for (std::size_t i = 0; i < lines_.size(); ++i)
    if (shows[i] != 0) angle_[tried_[i].position] += tried_[i].share;
  rays_ += lines_.size();
  lines_.clear();
  targets_.clear();
  tried_.clear();
}

HintBytes HintViews::look(const Cell& cell, std::uint64_t seed, const VisibleSet& visible,
                          const VisibleSet& seen, Sampler& sampler) {
  random_ = Random(seed);
  rays_ = 0;
  const std::uint32_t count = visible.count();
  std::vector<std::uint32_t> views(count, 0);
  std::vector<double> largest(count, 0);
  const Vec3 start{random_.unit(), random_.unit(), random_.unit()};
  for (std::uint32_t k = 0; k < viewpoints_; ++k) {
    const Vec3 eye = eye_of(cell, start, k);
    angle_.assign(count, 0);
    std::uint32_t position = 0;
    visible.for_each([&](ObjectId id) { aim(eye, id, position++, sampler); });
    settle(sampler);
    position = 0;
    visible.for_each([&](ObjectId id) {
      const double angle = std::min(angle_[position], most_of(scene_->object(id).box, eye));
      views[position] += angle > 0 ? 1 : 0;
      largest[position] = std::max(largest[position], angle);
      ++position;
    });
  }
  std::vector<VisibilityHint> hints;
  visible.for_each([&](ObjectId id) {
    const std::size_t at = hints.size();
    VisibilityHint hint{degree_of(views[at], viewpoints_), size_of(largest[at])};
    if (hint.degree == 0 && seen.contains(id)) hint = {1, 1};
    hints.push_back(hint);
  });
  return pack_hints(hints);
}

}  // namespace pvsfarm
