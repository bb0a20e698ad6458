#include "worker/inquiry/audit.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm {
namespace {

// A suspect that is in full view is hit by the first rays or not at all.
constexpr std::uint64_t kRaysASuspect = 12;
constexpr std::uint64_t kRaysAnOutsider = 8;

}  // namespace

Auditor::Auditor(std::shared_ptr<const Scene> scene, double near_m)
    : scene_(std::move(scene)),
      near_m_(near_m),
      sampler_(scene_),
      occludees_(all_occludees(*scene_)) {
  for (const ObjectRecord& object : scene_->objects()) {
    const Vec3 half = object.box.size() * 0.5;
    centers_.push_back((object.box.lo + object.box.hi) * 0.5);
    half_lengths2_.push_back(dot(half, half));
  }
}

// The occludees outside the PVS that look largest from the cell's centre, `count` at most: by the
// square of the half diagonal over the distance.
VisibleSet Auditor::largest_outside(const AuditQuestion& question, std::size_t count) const {
  VisibleSet outside = occludees_;
  outside.remove_all(question.visible);
  outside.remove_all(sampler_.seen());
  if (outside.count() <= count) return outside;
  // A heap of the largest so far, the smallest of them on top: `count` is small.
  using Sized = std::pair<double, ObjectId>;
  std::vector<Sized> largest;
  const Vec3 eye = question.cell.center();
  outside.for_each([&](ObjectId id) {
    const std::uint32_t i = index_of(id);
    const Vec3 away = centers_[i] - eye;
    const Sized sized{half_lengths2_[i] / std::max(dot(away, away), 1e-300), id};
    if (largest.size() == count) {
      if (sized <= largest.front()) return;
      std::pop_heap(largest.begin(), largest.end(), std::greater<>());
      largest.pop_back();
    }
    largest.push_back(sized);
    std::push_heap(largest.begin(), largest.end(), std::greater<>());
  });
  std::vector<std::uint64_t> words(outside.words().size(), 0);
  for (const auto& [size, id] : largest)
    words[index_of(id) / 64] |= std::uint64_t{1} << index_of(id) % 64;
  return VisibleSet::from_words(outside.universe(), std::move(words));
}

// The witness again, by other code than that which found it.
bool Auditor::holds(const Cell& cell, const Witness& witness) {
  const double margin = sampler_.margin();
  const Vec3 from_origin = witness.eye - cell.origin;
  for (int a = 0; a < 3; ++a) {
    const double t = dot(from_origin, cell.axes[static_cast<std::size_t>(a)]);
    if (t < cell.lo[a] - margin || t > cell.hi[a] + margin) return false;
  }
  const Vec3 line = witness.point - witness.eye;
  if (length(line) < near_m_) return false;
  const ObjectRecord& object = scene_->object(witness.object);
  bool on_object = false;
  for (std::uint32_t i = 0; i < object.triangle_count && !on_object; ++i) {
    const auto index = static_cast<std::uint32_t>(object.first_triangle) + i;
    const SeenTriangle triangle(*scene_, index, witness.eye);
    if (triangle.degenerate()) continue;
    const double off = std::abs(dot(triangle.normal, line - triangle.corner[0]));
    on_object = off <= margin * triangle.normal_length && triangle.depth_inside(line) >= -margin;
  }
  if (!on_object) return false;
  if (!sight_) sight_.emplace(scene_);
  return sight_->clear({witness.eye, witness.point}, witness.object, margin);
}

AuditFinding Auditor::audit(const AuditQuestion& question) {
  sampler_.begin(question.cell, question.seed, near_m_);
  AuditFinding finding{.key = question.key};
  // 1. Suspects: at most half of the rays.
  const std::uint32_t suspects = question.suspects.count();
  if (suspects > 0) {
    const std::uint64_t rays = std::min(question.rays / 2, suspects * kRaysASuspect);
    finding.rays += sampler_.aim(question.suspects, rays).rays;
  }
  // 2. What is outside the PVS and looks largest: half of the rest.
  const std::uint64_t for_outside = (question.rays - std::min(question.rays, finding.rays)) / 2;
  if (for_outside >= kRaysAnOutsider) {
    const VisibleSet targets = largest_outside(question, for_outside / kRaysAnOutsider);
    if (targets.count() > 0) finding.rays += sampler_.aim(targets, for_outside).rays;
  }
  // 3. All around with the rest.
  if (question.rays > finding.rays)
    finding.rays += sampler_.look_around(question.rays - finding.rays).rays;

  finding.seen = sampler_.seen();
  for (const Witness& witness : sampler_.witnesses()) {
    if (finding.violations.size() >= kMaxAuditViolations) break;
    if (question.visible.contains(witness.object) || !holds(question.cell, witness)) continue;
    finding.violations.push_back({witness.object, {witness.eye, witness.point}});
  }
  return finding;
}

}  // namespace pvsfarm
