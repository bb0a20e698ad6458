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

void Cascade::begin(Method method, const MapsUsed& maps) {
  method_ = method;
  maps_ = maps;
  credited_.clear();
  credited_work_ = 0;
  credited_ms_ = 0;
  open_before_ = open_;
  open_triangles_before_ = open_triangles();
  started_ms_ = clock_ != nullptr ? clock_() : 0;
}

void Cascade::credit(Method method, std::span<const ObjectId> objects, std::uint64_t work,
                     double cpu_ms) {
  credited_method_ = method;
  credited_.assign(objects.begin(), objects.end());
  credited_work_ = work;
  credited_ms_ = cpu_ms;
}

// The credited of the objects hidden, which it takes from the set.
CascadeRound Cascade::take_credited(VisibleSet& hidden) const {
  CascadeRound round{.method = credited_method_, .work = credited_work_};
  for (const ObjectId id : credited_) {
    if (!hidden.contains(id)) continue;
    hidden.remove(id);
    ++round.hidden_objects;
    round.hidden_triangles += scene_.object(id).triangle_count;
  }
  return round;
}

void Cascade::book(CascadeRound round, double cpu_ms) {
  MethodStatistics& own = statistics_.methods[static_cast<std::size_t>(round.method)];
  own.hidden_objects += round.hidden_objects;
  own.seen_objects += round.seen_objects;
  own.hidden_triangles += round.hidden_triangles;
  own.seen_triangles += round.seen_triangles;
  own.work += round.work;
  own.cpu_ms += cpu_ms;
  visible_triangles_ -= round.hidden_triangles;
  seen_triangles_ += round.seen_triangles;
  round.maps = maps_;
  round.open_objects = open_before_.count();
  round.open_triangles = open_triangles_before_;
  round.cpu_ms = static_cast<float>(cpu_ms);
  append_round(statistics_.rounds, round);
}

void Cascade::end(const VisibleSet& seen, std::uint64_t work, double nominal_ms) {
  open_.remove_all(seen);
  VisibleSet settled = open_before_;
  settled.remove_all(open_);
  VisibleSet now_seen = settled;
  now_seen.keep_only(seen);
  settled.remove_all(now_seen);  // what is left was proved hidden
  const CascadeRound credited = take_credited(settled);
  const CascadeRound own{.method = method_,
                         .hidden_objects = settled.count(),
                         .seen_objects = now_seen.count(),
                         .hidden_triangles = triangles(settled),
                         .seen_triangles = triangles(now_seen),
                         .work = work};
  const double all_ms = clock_ != nullptr ? clock_() - started_ms_ : 0;
  const double credited_ms = std::min(credited_ms_, all_ms);
  book(own, all_ms - credited_ms);
  if (credited.work > 0) book(credited, credited_ms);
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
