#include "worker/inquiry/explain.hpp"

#include <algorithm>
#include <optional>

#include "common/base/check.hpp"
#include "worker/evaluator/evaluator.hpp"
#include "worker/inquiry/certificate.hpp"
#include "worker/inquiry/line_check.hpp"
#include "worker/visibility/sampler.hpp"
#include "worker/visibility/sight_check.hpp"
#include "worker/visibility/triangle_distance.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint64_t kRaysAfterwards = 20'000;
constexpr std::uint64_t kSeed = 0x657870;

// The point of the line nearest to the triangle: the distance is convex along the line.
Vec3 nearest_point(const SightLine& line, const Vec3 (&triangle)[3]) {
  const auto at = [&](double t) { return line.eye + (line.point - line.eye) * t; };
  const auto distance = [&](double t) { return triangle_distance(at(t), at(t), triangle); };
  double lo = 0, hi = 1;
  for (int step = 0; step < 60; ++step) {
    const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
    (distance(a) <= distance(b) ? hi : lo) = distance(a) <= distance(b) ? b : a;
  }
  return at((lo + hi) / 2);
}

}  // namespace

struct Explainer::State {
  State(std::shared_ptr<const Scene> the_scene, const EvaluatorSettings& the_settings)
      : scene(the_scene), settings(the_settings), evaluator(the_scene, the_settings) {}

  ExplainFinding::Part part_of(const Evidence::Part& hidden, const ExplainQuestion& question,
                               const Evidence& evidence, Certificate& certificate) const;
  void find_nearest_plane(const ExplainQuestion& question, const Evidence& evidence,
                          ExplainFinding& finding) const;
  void look_harder(const ExplainQuestion& question, ExplainFinding& finding);
  bool made_of_projections(Method method) const {
    const bool drawn_on =
        settings.methods.has(Method::kSurfaces) || settings.methods.has(Method::kSlices);
    return method == Method::kProjection || method == Method::kFineProjection ||
           (method == Method::kImproved && !drawn_on);
  }
  void note_passed(ObjectId object, ExplainFinding& finding);
  SightCheck& sight() {
    if (!sight_check) sight_check.emplace(scene);
    return *sight_check;
  }

  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;
  Evaluator evaluator;
  std::optional<SightCheck> sight_check;  // made when first asked for
};

ExplainFinding::Part Explainer::State::part_of(const Evidence::Part& hidden,
                                               const ExplainQuestion& question,
                                               const Evidence& evidence,
                                               Certificate& certificate) const {
  auto part = certificate.redraw(evidence.planes[hidden.plane], hidden.local_box, hidden.improved);
  PVS_CHECK(part.has_value());  // the prover asked no less of it
  // What no Projection covers, the method covered otherwise: who stands there, lines tell.
  part->by_lines = part->covered < 1 && !made_of_projections(evidence.method);
  part->objects = hidden.objects;
  // Widening by rounding, and by a cell's skew axes, is of no interest to people.
  if (hidden.objects == 1) part->box = common_box(part->box, scene->object(question.object).box);
  return *part;
}

void Explainer::State::find_nearest_plane(const ExplainQuestion& question, const Evidence& evidence,
                                          ExplainFinding& finding) const {
  const CellFrame frame(question.cell);
  const Box& box = scene->object(question.object).box;
  Certificate certificate(*scene, question.cell, evidence.occluders, settings.near_m);
  for (const ProjectionPlane& plane : evidence.planes) {
    auto part = certificate.redraw(plane, frame.local_around_world(box));
    if (!part) continue;
    if (!finding.parts.empty() && part->covered <= finding.parts[0].covered) continue;
    part->box = box;
    finding.parts.assign(1, std::move(*part));
  }
}

// What the bake left open is looked for once more, with all rays at this one object.
void Explainer::State::look_harder(const ExplainQuestion& question, ExplainFinding& finding) {
  Sampler sampler(scene);
  sampler.begin(question.cell, kSeed, settings.near_m);
  VisibleSet target = VisibleSet::all(scene->object_count());
  target.remove_range(0, index_of(question.object));
  target.remove_range(index_of(question.object) + 1,
                      scene->object_count() - index_of(question.object) - 1);
  sampler.aim(target, kRaysAfterwards);
  for (const Witness& witness : sampler.witnesses()) {
    if (witness.object != question.object) continue;
    finding.verdict = Verdict::kSeen;
    finding.method = Method::kAimedRays;
    finding.found_afterwards = true;
    finding.line = {witness.eye, witness.point};
    return;
  }
}

// What is nearest to one of the ends, as the ground the object stands on, is not passed by.
void Explainer::State::note_passed(ObjectId object, ExplainFinding& finding) {
  const Sightline line{finding.line.eye, finding.line.point};
  const double end = 1e-6 * length(line.point - line.eye);
  for (const SightCheck::Near& near : sight().nearest(line, object, 2 * kMaxPassedBy)) {
    Vec3 triangle[3];
    for (int k = 0; k < 3; ++k)
      triangle[k] = scene->vertices()[scene->all_triangles()[near.triangle].vertex[k]];
    const Vec3 at = nearest_point(finding.line, triangle);
    if (std::min(length(at - line.point), length(at - line.eye)) > end &&
        finding.passed.size() < kMaxPassedBy)
      finding.passed.push_back({near.object, near.clearance, at});
  }
}

Explainer::Explainer(std::shared_ptr<const Scene> scene, const EvaluatorSettings& settings)
    : state_(std::make_unique<State>(std::move(scene), settings)) {}
Explainer::~Explainer() = default;

ExplainFinding Explainer::explain(const ExplainQuestion& question) {
  State& s = *state_;
  Evidence evidence{.object = question.object};
  const CellDelta delta =
      s.evaluator.evaluate(question.key, question.cell, question.parent, &evidence);
  ExplainFinding finding{
      .method = evidence.method, .visible = question.parent, .rounds = delta.statistics.rounds};
  finding.visible.remove_all(delta.hidden);

  if (delta.hidden.contains(question.object)) {
    finding.verdict = Verdict::kHidden;
    Certificate certificate(*s.scene, question.cell, evidence.occluders, s.settings.near_m);
    const bool on_planes = evidence.method != Method::kShafts;
    PVS_CHECK(evidence.parts.empty() != on_planes && evidence.parts.size() <= kMaxExplainedParts);
    if (!on_planes)
      finding.parts.push_back({.box = s.scene->object(question.object).box, .by_lines = true});
    for (const Evidence::Part& part : evidence.parts)
      finding.parts.push_back(s.part_of(part, question, evidence, certificate));
    check_by_lines(*s.scene, s.sight(), question, finding);
    return finding;
  }
  if (delta.seen.contains(question.object) && evidence.witness) {
    finding.verdict = Verdict::kSeen;
    finding.line = *evidence.witness;
  } else {
    s.find_nearest_plane(question, evidence, finding);
    s.look_harder(question, finding);
  }
  if (finding.verdict == Verdict::kSeen) s.note_passed(question.object, finding);
  return finding;
}

}  // namespace pvsfarm
