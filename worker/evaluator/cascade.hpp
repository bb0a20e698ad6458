// The bookkeeping of one cell's cascade: the three sets, who settled what, what it cost.
//
// Source: theory 0.1 (three answers), G (gap, escalation).
#pragma once

#include <span>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/settings.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/stages.hpp"

namespace pvsfarm {

// Nominal prices, in milliseconds of one core of the machine they were measured on (bench_accuracy
// methods). They only say when a cell's time is over: the same on every machine.
struct NominalPrices {
  double ray = 0.0007;         // cast, its share of checks included
  double projection = 0.0003;  // a piece on one plane, drawn
  double map_pixel = 4e-6;     // reset, pyramids
  double box_test = 0.00006;
  double sweep_plane = 0.1;       // re-projected, its occluders looked for
  double item_triangle = 0.0003;  // collected, drawn in one view
  double item_pixel = 1e-5;
  double shaft_edge = 1e-5;  // looked at in a shaft, its share of triangles included
};
inline constexpr NominalPrices kPrices;

// Threads: one object, one thread; made anew for every cell.
class Cascade {
 public:
  // Keeps references to all three.
  Cascade(const Scene& scene, const EvaluatorSettings& settings, const VisibleSet& parent,
          CpuClock clock);

  // Not proved hidden: the PVS so far. Proved neither hidden nor seen.
  VisibleSet& visible() { return visible_; }
  VisibleSet& open() { return open_; }
  CellStatistics& statistics() { return statistics_; }

  // Brackets the work of a method, a round of the statistics; `end` books what left `open`
  // meanwhile: `seen` (all objects witnessed so far) to the seen, the rest to the hidden.
  void begin(Method method, const MapsUsed& maps = {});
  // Within a bracket: what its method works on.
  void works_on(const MapsUsed& maps) { maps_ = maps; }
  // Within the bracket of another: what of `objects` is proved hidden in it is due to this method,
  // which did so much of the work, in so much of its time.
  void credit(Method method, std::span<const ObjectId> objects, std::uint64_t work, double cpu_ms);
  void end(const VisibleSet& seen, std::uint64_t work, double nominal_ms);

  std::uint64_t visible_triangles() const { return visible_triangles_; }
  std::uint64_t seen_triangles() const { return seen_triangles_; }
  std::uint64_t open_triangles() const { return visible_triangles_ - seen_triangles_; }
  // (|PVS| - |seen|) / |PVS| in triangles; 0 for an empty PVS.
  double gap() const;
  bool over_budget() const;
  double nominal_ms() const { return nominal_ms_; }  // of all methods so far, at kPrices
  // Whether another method may be begun: something is open, the gap is too large, time is left.
  bool goes_on() const;

  // The answer. Objects both proved hidden and seen stay visible, and are counted.
  CellDelta finish(const CellKey& key, const VisibleSet& seen);

 private:
  void book(CascadeRound round, double cpu_ms);
  CascadeRound take_credited(VisibleSet& hidden) const;
  std::uint64_t triangles(const VisibleSet& set) const;

  const Scene& scene_;
  const EvaluatorSettings& settings_;
  const VisibleSet& parent_;
  CpuClock clock_;
  VisibleSet visible_, open_, open_before_;
  CellStatistics statistics_;
  Method method_ = Method::kProjection, credited_method_ = Method::kProjection;
  MapsUsed maps_;
  std::uint64_t open_triangles_before_ = 0;
  std::vector<ObjectId> credited_;
  std::uint64_t credited_work_ = 0;
  double started_ms_ = 0, credited_ms_ = 0, nominal_ms_ = 0;
  std::uint64_t visible_triangles_ = 0, seen_triangles_ = 0;
};

}  // namespace pvsfarm
