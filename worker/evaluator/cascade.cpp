#include "worker/evaluator/cascade.hpp"

#include <algorithm>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

// A cell over its polygon budget is worth more effort than the gap alone asks for: a split costs
// two more evaluations.
constexpr double kGapOverBudget = 0.02;

}  // namespace

Cascade::Cascade(const Scene& scene, const EvaluatorSettings& settings, const VisibleSet& parent,
                 CpuClock clock)
    : scene_(scene),
      settings_(settings),
      parent_(parent),
      clock_(clock),
      visible_(parent),
      open_(parent) {
  PVS_CHECK_EQ(parent.universe(), scene.object_count());
  visible_triangles_ = triangles(parent);
}

std::uint64_t Cascade::triangles(const VisibleSet& set) const {
  std::uint64_t sum = 0;
  set.for_each([&](ObjectId id) { sum += scene_.object(id).triangle_count; });
  return sum;
}

void Cascade::begin(Method method) {
  method_ = method;
  open_before_ = open_;
  started_ms_ = clock_ != nullptr ? clock_() : 0;
}

void Cascade::credit(Method method, std::span<const ObjectId> objects, std::uint64_t work) {
  credited_method_ = method;
  credited_.assign(objects.begin(), objects.end());
  statistics_.methods[static_cast<std::size_t>(method)].work += work;
}

// Books the credited of the objects hidden, and takes them from the set.
std::uint64_t Cascade::book_credited(VisibleSet& hidden) {
  MethodStatistics& other = statistics_.methods[static_cast<std::size_t>(credited_method_)];
  std::uint64_t triangles = 0;
  for (const ObjectId id : credited_) {
    if (!hidden.contains(id)) continue;
    hidden.remove(id);
    ++other.hidden_objects;
    triangles += scene_.object(id).triangle_count;
  }
  other.hidden_triangles += triangles;
  credited_.clear();
  return triangles;
}

void Cascade::end(const VisibleSet& seen, std::uint64_t work, double nominal_ms) {
  open_.remove_all(seen);
  VisibleSet settled = std::move(open_before_);
  settled.remove_all(open_);
  VisibleSet now_seen = settled;
  now_seen.keep_only(seen);
  settled.remove_all(now_seen);  // what is left was proved hidden
  const std::uint64_t credited_triangles = book_credited(settled);

  MethodStatistics& own = statistics_.methods[static_cast<std::size_t>(method_)];
  own.hidden_objects += settled.count();
  own.seen_objects += now_seen.count();
  const std::uint64_t hidden_triangles = triangles(settled), seen_triangles = triangles(now_seen);
  own.hidden_triangles += hidden_triangles;
  own.seen_triangles += seen_triangles;
  own.work += work;
  if (clock_ != nullptr) own.cpu_ms += clock_() - started_ms_;
  visible_triangles_ -= hidden_triangles + credited_triangles;
  seen_triangles_ += seen_triangles;
  nominal_ms_ += nominal_ms;
}

double Cascade::gap() const {
  if (visible_triangles_ == 0) return 0;
  return static_cast<double>(visible_triangles_ - seen_triangles_) /
         static_cast<double>(visible_triangles_);
}

bool Cascade::over_budget() const {
  return settings_.budget_triangles > 0 && visible_triangles_ > settings_.budget_triangles;
}

bool Cascade::goes_on() const {
  if (settings_.time_ms > 0 && nominal_ms_ >= settings_.time_ms) return false;
  return gap() > (over_budget() ? std::min(settings_.gap, kGapOverBudget) : settings_.gap);
}

CellDelta Cascade::finish(const CellKey& key, const VisibleSet& seen) {
  CellDelta delta{.key = key, .hidden = parent_, .seen = seen, .statistics = statistics_};
  delta.hidden.remove_all(visible_);
  delta.seen.keep_only(parent_);
  VisibleSet refuted = delta.hidden;
  refuted.keep_only(delta.seen);
  delta.hidden.remove_all(refuted);
  delta.statistics.contradictions = refuted.count();
  return delta;
}

}  // namespace pvsfarm
