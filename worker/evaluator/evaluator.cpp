#include "worker/evaluator/evaluator.hpp"

#include <algorithm>
#include <optional>

#include "common/base/check.hpp"
#include "common/base/random.hpp"
#include "worker/evaluator/projection_efforts.hpp"
#include "worker/evaluator/projection_prover.hpp"
#include "worker/evaluator/shaft_prover.hpp"
#include "worker/evaluator/sweep_choice.hpp"
#include "worker/evaluator/sweep_prover.hpp"
#include "worker/visibility/aim_points.hpp"
#include "worker/visibility/hint_views.hpp"
#include "worker/visibility/item_views.hpp"
#include "worker/visibility/sampler.hpp"
#include "worker/visibility/slice_cover.hpp"

namespace pvsfarm {
namespace {

// A parent's set this small is aimed at before anything is projected: most of it will be seen.
constexpr std::uint32_t kFewObjects = 2048;
constexpr std::uint64_t kFirstRays = 4;    // for each open object, the first time it is aimed at
constexpr std::uint64_t kNextRays = 16;    // of what has been tested by parts
constexpr std::uint64_t kSecondRays = 64;  // and once all provers had their turn
constexpr std::uint64_t kRaysAFind = 100;  // of the first, or there are none after them: a thicket
constexpr std::uint32_t kViewpoints = 4;   // that L_pt is looked for from
constexpr int kMostRounds = 4;
constexpr double kLeastSettled = 0.03;  // of what was open, in triangles, or it was the last round
constexpr double kLeastSeen = 0.03;     // the same, of rays
constexpr double kRaysShare = 0.15;     // but they may always cost so much of all before them
constexpr double kLeastSliced = 0.01;   // the same, or no other maps of the cell get slices

// The cell's own stream of random numbers, whoever evaluates it and when.
std::uint64_t seed_of(const CellKey& key) {
  Random mixed(key.path ^ (static_cast<std::uint64_t>(key.root) << 32));
  return mixed.next() ^ key.root;
}

bool wants_witnesses(const EvaluatorSettings& s) {
  return s.max_rays > 0 &&
         (s.methods.has(Method::kLookAround) || s.methods.has(Method::kAimedRays) ||
          s.methods.has(Method::kItemBuffers));
}

}  // namespace

struct Evaluator::State {
  State(std::shared_ptr<const Scene> the_scene, const EvaluatorSettings& the_settings,
        CpuClock the_clock)
      : scene(std::move(the_scene)), settings(the_settings), clock(the_clock), ranking(*scene) {
    const ProjectionEffort effort = effort_of(settings);
    if (settings.methods.has(Method::kProjection) || settings.methods.has(Method::kFineProjection))
      projection = std::make_unique<ProjectionProver>(*scene, ranking, effort, clock);
    if (settings.methods.has(Method::kSurfaces))
      surfaces = std::make_unique<ProjectionProver>(*scene, ranking, with_surfaces(effort), clock);
    if (settings.methods.has(Method::kShafts))
      shafts = std::make_unique<ShaftProver>(*scene, ShaftEffort{.near_m = settings.near_m});
    if (settings.methods.has(Method::kSlices)) {
      slices = std::make_unique<SliceCover>(*scene);
      if (!settings.methods.has(Method::kProjection))
        bare_maps = std::make_unique<ProjectionProver>(*scene, ranking, bare(effort), clock);
    }
    if (settings.methods.has(Method::kSweep)) {
      sweep = std::make_unique<SweepProver>(*scene, sweep_effort(settings));
      widths = OccluderWidths::of_pieces(*scene);
      surface_widths = OccluderWidths::of_surfaces(*scene);
    }
    if (settings.hint_viewpoints > 0)
      hints = std::make_unique<HintViews>(scene, settings.hint_viewpoints);
    if (wants_witnesses(settings)) sampler = std::make_unique<Sampler>(scene);
    if (sampler && settings.methods.has(Method::kItemBuffers))
      views = std::make_unique<ItemViews>(scene, settings.item_buffer_px);
  }

  void look_around(Cascade& cascade);
  void view(const CellKey& key, const Cell& cell, Cascade& cascade);
  void aim(Cascade& cascade, std::uint64_t rays_an_object);
  bool aiming_pays() const { return finds * kRaysAFind >= aimed_rays; }
  void aim_on(Cascade& cascade);
  using Step = void (ProjectionProver::*)(const Cell&, VisibleSet& visible, VisibleSet& open,
                                          CellStatistics&, Evidence*);
  void prove(ProjectionProver& prover, Step step, Method method, const Cell& cell, Cascade& cascade,
             Evidence* evidence);
  void project(Method method, const CellKey& key, const Cell& cell, Cascade& cascade,
               Evidence* evidence);
  void escalate(const CellKey& key, const Cell& cell, Cascade& cascade, Evidence* evidence);
  void slice(ProjectionProver& prover, int splits, const Cell& cell, Cascade& cascade,
             Evidence* evidence);
  void prove_by_sweep(const Cell& cell, Cascade& cascade, Evidence* evidence);
  void prove_by_shafts(const Cell& cell, Cascade& cascade, Evidence* evidence);
  void prove_all(const CellKey& key, const Cell& cell, Cascade& cascade, Evidence* evidence);
  HintBytes hints_of(const CellDelta& delta, const Cell& cell, const VisibleSet& parent);
  void note_witness(Evidence& evidence) const;
  bool aims() const { return sampler && settings.methods.has(Method::kAimedRays); }
  const VisibleSet& seen() const { return sampler ? sampler->seen() : nothing; }

  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  CpuClock clock;
  OccluderRanking ranking;
  VisibleSet nothing;
  std::unique_ptr<ProjectionProver> projection, surfaces, bare_maps;
  std::unique_ptr<ShaftProver> shafts;
  std::unique_ptr<SliceCover> slices;
  std::optional<CellFrame> slice_frame;  // of the cell that `slices` is prepared for
  bool slices_pay = true;                // for it: the last ones settled enough
  std::unique_ptr<SweepProver> sweep;
  OccluderWidths widths, surface_widths;  // for the sweep
  std::unique_ptr<Sampler> sampler;
  std::unique_ptr<ItemViews> views;
  std::unique_ptr<HintViews> hints;
  std::unique_ptr<Sampler> hint_sampler;  // where there is no other
  std::uint64_t rays_left = 0;
  std::uint64_t aimed_rays = 0, finds = 0;  // of a cell: cast at what is open, objects they saw
  Stages* stages = nullptr;
};

void Evaluator::State::look_around(Cascade& cascade) {
  cascade.begin(Method::kLookAround);
  // Alone it is the whole method; before others it is a first look.
  const bool alone = settings.methods == Methods{Method::kLookAround};
  const SamplingRound round = sampler->look_around(alone ? rays_left : rays_left / 4);
  rays_left -= std::min(rays_left, round.rays);
  cascade.end(seen(), round.rays, static_cast<double>(round.rays) * kPrices.ray);
}

// From the cell's corners and the middle of its upper face, until a viewpoint shows little that
// the ones before it did not.
void Evaluator::State::view(const CellKey& key, const Cell& cell, Cascade& cascade) {
  constexpr std::uint64_t kEyes = 9;
  constexpr std::uint32_t kLittle = 50;  // a part of what is open
  Random random(seed_of(key));
  for (std::uint64_t k = 0; k < kEyes && cascade.goes_on(); ++k) {
    cascade.begin(Method::kItemBuffers);
    const std::uint32_t open_before = cascade.open().count();
    const Vec3 eye = viewpoint(cell, k, random);
    cascade.works_on({.resolution_px = static_cast<std::uint32_t>(settings.item_buffer_px)});
    const auto& shown = views->look(eye, settings.near_m, cascade.visible(), cascade.open());
    sampler->consider(eye, shown);
    const ItemViews::Cost cost = views->cost();
    cascade.end(seen(), cost.pixels,
                static_cast<double>(cost.triangles) * kPrices.item_triangle +
                    static_cast<double>(cost.pixels) * kPrices.item_pixel);
    if (open_before - cascade.open().count() <= open_before / kLittle) break;
  }
}

void Evaluator::State::aim(Cascade& cascade, std::uint64_t rays_an_object) {
  const std::uint64_t rays = std::min(rays_left, rays_an_object * cascade.open().count());
  if (rays == 0) return;
  cascade.begin(Method::kAimedRays);
  const SamplingRound round = sampler->aim(cascade.open(), rays);
  rays_left -= std::min(rays_left, round.rays);
  aimed_rays += round.rays;
  finds += round.seen;
  cascade.end(seen(), round.rays, static_cast<double>(round.rays) * kPrices.ray);
}

// Once all provers had their turn, while it finds enough, or is cheap beside what they cost.
void Evaluator::State::aim_on(Cascade& cascade) {
  if (!aiming_pays()) return;
  const double until_ms = (1 + kRaysShare) * cascade.nominal_ms();
  while (aims() && rays_left > 0 && cascade.goes_on()) {
    const std::uint64_t before = cascade.open_triangles();
    aim(cascade, kSecondRays);
    const std::uint64_t found = before - cascade.open_triangles();
    if (static_cast<double>(found) < kLeastSeen * static_cast<double>(before) &&
        (found == 0 || cascade.nominal_ms() >= until_ms))
      break;
  }
}

void Evaluator::State::prove(ProjectionProver& prover, Step step, Method method, const Cell& cell,
                             Cascade& cascade, Evidence* evidence) {
  if (evidence != nullptr && cascade.open().contains(evidence->object)) evidence->method = method;
  CellStatistics& statistics = cascade.statistics();
  const std::uint32_t tests_before = statistics.box_tests, before = statistics.projections;
  cascade.begin(method);
  (prover.*step)(cell, cascade.visible(), cascade.open(), statistics, evidence);
  cascade.works_on(prover.maps_used());
  cascade.credit(Method::kImproved, prover.improved_objects(), prover.improved_tests(),
                 prover.improved_ms());
  const std::uint32_t projections = statistics.projections - before;
  double nominal_ms =
      projections * kPrices.projection + (statistics.box_tests - tests_before) * kPrices.box_test;
  for (const OcclusionMap& map : prover.maps())
    nominal_ms += kPrices.map_pixel * map.plane().resolution_px * map.plane().resolution_px;
  cascade.end(seen(), projections, nominal_ms);
}

void Evaluator::State::prove_by_sweep(const Cell& cell, Cascade& cascade, Evidence* evidence) {
  if (evidence != nullptr && cascade.open().contains(evidence->object))
    evidence->method = Method::kSweep;
  CellStatistics& statistics = cascade.statistics();
  const std::uint32_t tests_before = statistics.box_tests, before = statistics.projections;
  cascade.begin(Method::kSweep);
  sweep->run(cell, cascade.visible(), cascade.open(), statistics, evidence);
  cascade.works_on(sweep->maps_used());
  const std::uint32_t projections = statistics.projections - before;
  cascade.end(seen(), projections,
              projections * kPrices.projection +
                  (statistics.box_tests - tests_before) * kPrices.box_test +
                  sweep->maps_used().planes * kPrices.sweep_plane);
}

void Evaluator::State::prove_by_shafts(const Cell& cell, Cascade& cascade, Evidence* evidence) {
  if (evidence != nullptr && cascade.open().contains(evidence->object))
    evidence->method = Method::kShafts;
  cascade.begin(Method::kShafts);
  const ShaftWork work = shafts->run(cell, cascade.visible(), cascade.open(), evidence);
  // What kept an object open shows it, if nothing but surfaces is in the way.
  double nominal_ms = static_cast<double>(work.edges) * kPrices.shaft_edge;
  for (const ClearLine& line : shafts->clear_lines()) {
    if (!sampler || rays_left == 0) break;
    const SamplingRound round = sampler->consider(line.eye, {&line.candidate, 1});
    rays_left -= std::min(rays_left, round.rays);
    nominal_ms += static_cast<double>(round.rays) * kPrices.ray;
  }
  cascade.end(seen(), work.shafts, nominal_ms);
  // Much of what was aimed at in vain is hidden by now.
  aimed_rays = finds = 0;
}

// Whole objects first; what a few rays see then need not be tested by parts.
void Evaluator::State::project(Method method, const CellKey& key, const Cell& cell,
                               Cascade& cascade, Evidence* evidence) {
  prove(*projection, &ProjectionProver::run, method, cell, cascade, evidence);
  if (views) view(key, cell, cascade);
  if (aims()) aim(cascade, kFirstRays);
  if (cascade.goes_on())
    prove(*projection, &ProjectionProver::finish, method, cell, cascade, evidence);
}

// Planes aimed at what is open, a few at a time, while they settle enough.
void Evaluator::State::escalate(const CellKey& key, const Cell& cell, Cascade& cascade,
                                Evidence* evidence) {
  constexpr Method kFine = Method::kFineProjection;
  if (!settings.methods.has(Method::kProjection)) project(kFine, key, cell, cascade, evidence);
  for (int round = 0; round < kMostRounds && cascade.goes_on(); ++round) {
    const std::uint64_t before = cascade.visible_triangles() - cascade.seen_triangles();
    prove(*projection, &ProjectionProver::refine, kFine, cell, cascade, evidence);
    if (slices && cascade.goes_on()) slice(*projection, kFineSplits, cell, cascade, evidence);
    const std::uint64_t left = cascade.visible_triangles() - cascade.seen_triangles();
    if (static_cast<double>(before - left) < kLeastSettled * static_cast<double>(before)) break;
  }
}

// Adds the slices of solids to the maps of the prover's last run, and asks again.
void Evaluator::State::slice(ProjectionProver& prover, int splits, const Cell& cell,
                             Cascade& cascade, Evidence* evidence) {
  if (prover.maps().empty() || !slices_pay) return;
  if (evidence != nullptr && cascade.open().contains(evidence->object))
    evidence->method = Method::kSlices;
  const std::uint64_t before = cascade.visible_triangles() - cascade.seen_triangles();
  cascade.begin(Method::kSlices, prover.maps_used());
  if (!slice_frame) {
    slice_frame.emplace(cell);
    slices->begin(cell, *slice_frame, settings.near_m);
  }
  const CellFrame& frame = *slice_frame;
  SliceWork work;
  double nominal_ms = 0;
  for (OcclusionMap& map : prover.maps()) {
    const SliceWork own = slices->draw(map);
    work.segments += own.segments;
    work.pixels += own.pixels;
    if (own.pixels > 0)
      nominal_ms += kPrices.map_pixel * map.plane().resolution_px * map.plane().resolution_px;
  }
  std::uint32_t box_tests = 0;
  if (work.pixels > 0) {
    HierarchyTest test(*scene, frame, prover.maps(), prover.by_parts());
    test.watch(evidence);
    test.time_improved(clock);
    VisibleSet hidden = cascade.open();
    test.run(cascade.open(), splits);
    hidden.remove_all(cascade.open());
    cascade.visible().remove_all(hidden);
    box_tests = test.box_tests();
    cascade.credit(Method::kImproved, test.improved_objects(), test.improved_tests(),
                   test.improved_ms());
  }
  cascade.statistics().box_tests += box_tests;
  cascade.end(seen(), work.segments,
              nominal_ms + work.segments * kPrices.projection + box_tests * kPrices.box_test);
  const std::uint64_t left = cascade.visible_triangles() - cascade.seen_triangles();
  slices_pay = static_cast<double>(before - left) >= kLeastSliced * static_cast<double>(before);
}

// The cheapest prover on what is open, witnesses for what it leaves, escalation while the gap is
// too large. A gap of 0 asks for all; else a sweep comes in the place of Projections or not at all.
void Evaluator::State::prove_all(const CellKey& key, const Cell& cell, Cascade& cascade,
                                 Evidence* evidence) {
  const auto has = [&](Method method) { return settings.methods.has(method); };
  const bool everything = settings.gap == 0 || !projection;
  const bool sweeps_first = sweep && all_narrow(widths, cell);
  bool projects = true;
  if (sweeps_first && cascade.goes_on()) {
    const auto before = static_cast<double>(cascade.open_triangles());
    prove_by_sweep(cell, cascade, evidence);
    projects = everything || cascade.open_triangles() > (1 - kSweptEnough) * before;
    if (!projects && views) view(key, cell, cascade);
    if (!projects && aims()) aim(cascade, kFirstRays);
  }
  if (has(Method::kProjection) && projects && cascade.goes_on()) {
    project(Method::kProjection, key, cell, cascade, evidence);
    if (slices && cascade.goes_on()) slice(*projection, kSplits, cell, cascade, evidence);
    if (aims() && cascade.goes_on()) aim(cascade, kNextRays);
  }
  if (bare_maps && cascade.goes_on()) {
    prove(*bare_maps, &ProjectionProver::run, Method::kSlices, cell, cascade, evidence);
    slice(*bare_maps, kFineSplits, cell, cascade, evidence);
  }
  if (has(Method::kFineProjection) && projects && cascade.goes_on())
    escalate(key, cell, cascade, evidence);
  if (surfaces && cascade.goes_on()) {
    prove(*surfaces, &ProjectionProver::run, Method::kSurfaces, cell, cascade, evidence);
    prove(*surfaces, &ProjectionProver::finish, Method::kSurfaces, cell, cascade, evidence);
  }
  // Leaves are loose: where no surface is as wide as the cell, none blocks all of a shaft.
  const bool blocked = !sweeps_first || !all_narrow(surface_widths, cell);
  if (shafts && (everything || blocked) && cascade.goes_on())
    prove_by_shafts(cell, cascade, evidence);
  if (sweep && everything && !sweeps_first && cascade.goes_on())
    prove_by_sweep(cell, cascade, evidence);
}

// Once all else is settled, so that nothing else depends on it.
HintBytes Evaluator::State::hints_of(const CellDelta& delta, const Cell& cell,
                                     const VisibleSet& parent) {
  Sampler* rays = sampler.get();
  if (rays == nullptr) {
    if (!hint_sampler) hint_sampler = std::make_unique<Sampler>(scene);
    rays = hint_sampler.get();
    rays->begin(cell, 0, settings.near_m);
  }
  VisibleSet visible = parent;
  visible.remove_all(delta.hidden);
  return hints->look(cell, ~seed_of(delta.key), visible, delta.seen, *rays);
}

void Evaluator::State::note_witness(Evidence& evidence) const {
  for (const Witness& witness : sampler->witnesses())
    if (witness.object == evidence.object) evidence.witness = SightLine{witness.eye, witness.point};
  evidence.method =
      settings.methods.has(Method::kAimedRays) ? Method::kAimedRays : Method::kLookAround;
}

Evaluator::Evaluator(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings,
                     CpuClock clock)
    : state_(std::make_unique<State>(std::move(scene), settings, clock)) {
  state_->nothing = VisibleSet::none(state_->scene->object_count());
}

Evaluator::~Evaluator() = default;

CellDelta Evaluator::evaluate(const CellKey& key, const Cell& cell, const VisibleSet& parent,
                              Evidence* evidence) {
  State& s = *state_;
  PVS_CHECK(evidence == nullptr || parent.contains(evidence->object));
  Cascade cascade(*s.scene, s.settings, parent, s.clock);
  s.rays_left = s.settings.max_rays;
  s.aimed_rays = s.finds = 0;
  s.slice_frame.reset();
  s.slices_pay = true;
  if (s.sampler) s.sampler->begin(cell, seed_of(key), s.settings.near_m);

  // 1. What is cheap to see.
  if (s.sampler && s.settings.methods.has(Method::kLookAround)) s.look_around(cascade);
  if (s.aims() && cascade.open().count() <= kFewObjects) s.aim(cascade, kFirstRays);
  s.prove_all(key, cell, cascade, evidence);
  s.aim_on(cascade);

  // 2. What a single viewpoint sees, where the coordinator will have to decide about a split.
  std::uint64_t point_triangles = 0;
  if (s.sampler && cascade.over_budget())
    point_triangles = s.sampler->most_triangles_from_a_point(kViewpoints);
  CellDelta delta = cascade.finish(key, s.seen());
  delta.point_triangles = point_triangles;

  // 3. How often and how large, where somebody wants to know.
  if (s.hints) delta.hints = s.hints_of(delta, cell, parent);
  if (evidence != nullptr && delta.seen.contains(evidence->object)) s.note_witness(*evidence);
  return delta;
}

void Evaluator::profile(Stages* stages) {
  state_->stages = stages;
  if (state_->projection) state_->projection->profile(stages);
  if (state_->sampler) state_->sampler->profile(stages);
}

std::span<const Witness> Evaluator::witnesses() const {
  if (!state_->sampler) return {};
  return state_->sampler->witnesses();
}

}  // namespace pvsfarm
