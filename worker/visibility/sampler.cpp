#include "worker/visibility/sampler.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "common/base/random.hpp"
#include "worker/visibility/aim_points.hpp"
#include "worker/visibility/escape.hpp"
#include "worker/visibility/ray_scene.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {
namespace {

Vec3 direction(Random& random) {
  for (;;) {
    const Vec3 d{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double n = length(d);
    if (n > 0.1 && n < 1) return d / n;
  }
}

// A viewpoint is one of the 8 corners or, two times in three, a seeded one.
constexpr std::uint64_t kViewpoints = 24;
// Rays for each open target without a single find after which no more are cast.
constexpr std::uint64_t kPatience = 16;

// Every so many rays of a budget one is for lines past the edges of blockers.
constexpr std::uint64_t kPastBlockers = 8;

bool scene_holds(const Scene& scene, ObjectId object, std::uint32_t triangle) {
  return triangle - scene.object(object).first_triangle < scene.object(object).triangle_count;
}

}  // namespace

struct Sampler::State {
  State(std::shared_ptr<const Scene> s, const std::string& config)
      : scene(std::move(s)),
        check(scene),
        rays(*scene, check.origin(), config),
        aims(scene),
        skip(scene->object_count()) {}

  std::shared_ptr<const Scene> scene;
  SightCheck check;
  RayScene rays;
  AimPoints aims;

  Cell cell;
  double near_m = 0, margin = 0, float_margin = 0;
  Random random{0};
  std::vector<std::uint8_t> skip;  // by object: seen already, or no occludee
  VisibleSet seen;
  std::vector<Witness> witnesses;
  SamplingRound round;
  Stages* stages = nullptr;

  // The batch of rays in the making, and what each is aimed at.
  std::vector<Sightline> lines;
  std::vector<SightTarget> aimed_at;
  std::array<std::uint32_t, RayScene::kBatch> blockers;

  bool open(ObjectId object) const { return skip[index_of(object)] == 0; }
  void note(ObjectId object, const Sightline& line);
  void add(const Vec3& eye, const AimPoint& aim, ObjectId target);
  bool blocked(const Sightline& line, const SightTarget& at, std::uint32_t blocker) const;
  void settle();
  void settle_far();
  bool credit(const SightTarget& at, const Sightline& line);
  void credit_candidate(std::uint32_t triangle, const Sightline& line);
  void credit_hit(const SightCheck::Hit& hit, const Sightline& line);
  std::optional<AimPoint> draw(ObjectId target, std::uint64_t k, const Vec3& eye);
  void aim_plainly(std::vector<ObjectId>& targets, std::uint64_t budget);
  void aim_past_blockers(std::vector<ObjectId>& targets, std::uint64_t budget);
  void chase(ObjectId target, const Vec3& eye, const AimPoint& aim);
  std::uint64_t triangles_seen_from(const Vec3& eye, const std::vector<Witness>& known);
  SamplingRound finish();
};

// What to aim at in round k.
std::optional<AimPoint> Sampler::State::draw(ObjectId target, std::uint64_t k, const Vec3& eye) {
  switch (k % 4) {
    case 0:
      return aims.corner(target, k / 4, random, eye, margin);
    case 1:
    case 3:
      return aims.rim(target, random.below(4), random, eye, margin);
    default:
      return aims.anywhere(target, random, eye, margin);
  }
}

void Sampler::State::note(ObjectId object, const Sightline& line) {
  skip[index_of(object)] = 1;
  witnesses.push_back({object, line.eye, line.point});
  ++round.seen;
}

// The object is seen along the line, if that is clear.
bool Sampler::State::credit(const SightTarget& at, const Sightline& line) {
  if (!open(at.object) || length(line.point - line.eye) < near_m) return false;
  ++round.checks;
  if (!check.clear(line, at.object, margin, at.triangle)) return false;
  note(at.object, line);
  return true;
}

// The object hit is seen where the line meets it, if it is met well inside a triangle.
void Sampler::State::credit_hit(const SightCheck::Hit& hit, const Sightline& line) {
  if (!open(hit.object)) return;
  const Vec3 p = (line.point - line.eye) * hit.t;
  if (SeenTriangle(*scene, hit.triangle, line.eye).depth_inside(p) > margin)
    credit({hit.object, hit.triangle}, {line.eye, line.eye + p});
}

// The line, however long, meets the triangle beyond doubt in float: through the front or a visible
// back, well inside all edges even as seen from the eye, and with nothing else near, be it of the
// same object.
void Sampler::State::credit_candidate(std::uint32_t triangle, const Sightline& line) {
  const ObjectId object = check.object_of(triangle);
  if (!open(object)) return;
  const Vec3 d = line.point - line.eye;
  const SeenTriangle t(*scene, triangle, line.eye);
  const bool two_sided = scene->object(object).two_sided;
  if (t.degenerate()) return;
  if (!t.front_met(d, float_margin) && !(two_sided && t.back_met(d, float_margin))) return;
  const double rise = dot(t.normal, d), at = dot(t.normal, t.corner[0]) / rise;
  const Vec3 p = d * at;
  if (!(at > 0) || length(p) < near_m) return;
  const double slope = std::abs(rise) / (t.normal_length * length(d));
  if (!(t.depth_inside(p) * slope > float_margin)) return;
  ++round.checks;
  const Sightline shown{line.eye, line.eye + p};
  if (check.clear_but_for(shown, triangle, float_margin)) note(object, shown);
}

void Sampler::State::add(const Vec3& eye, const AimPoint& aim, ObjectId target) {
  lines.push_back({eye, aim.point});
  aimed_at.push_back({target, aim.triangle});
  if (lines.size() == RayScene::kBatch) settle();
}

// The triangle that Embree names does block the line.
bool Sampler::State::blocked(const Sightline& line, const SightTarget& at,
                             std::uint32_t blocker) const {
  return blocker != RayScene::kNoTriangle && !scene_holds(*scene, at.object, blocker) &&
         check.meets(line, blocker) && !check.in_front_of(at.triangle, blocker, line.eye, margin);
}

// A line counts if it is clear. It is not, if the triangle that Embree names does block it; only
// that saves the check.
void Sampler::State::settle() {
  {
    StageScope stage(stages, Stage::kCast);
    rays.name_blockers(lines, blockers);
    stage.did(lines.size());
  }
  round.rays += lines.size();
  StageScope stage(stages, Stage::kCheck);
  stage.did(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (!blocked(lines[i], aimed_at[i], blockers[i])) credit(aimed_at[i], lines[i]);
  lines.clear();
  aimed_at.clear();
}

// Rounds over all targets that are still open, each time another point of each from another eye.
void Sampler::State::aim_plainly(std::vector<ObjectId>& targets, std::uint64_t budget) {
  const std::uint64_t end = round.rays + budget;
  std::uint64_t last_find = round.rays;
  for (std::uint64_t k = 0; round.rays < end && !targets.empty(); ++k) {
    const std::uint64_t before = round.rays;
    const std::uint32_t seen_before = round.seen;
    for (const ObjectId target : targets) {
      if (round.rays + lines.size() >= end) break;
      const Vec3 eye = viewpoint(cell, k < 2 ? k : random.below(kViewpoints), random);
      if (const auto aim = draw(target, k, eye)) add(eye, *aim, target);
    }
    settle();
    if (round.seen > seen_before) last_find = round.rays;
    std::erase_if(targets, [&](ObjectId target) { return !open(target); });
    if (round.rays - last_find > kPatience * targets.size()) break;
    if (round.rays == before && k > kPatience) break;  // nothing to aim at
  }
}

// A line at the target, and where it is blocked, others past an edge of the blocker.
void Sampler::State::chase(ObjectId target, const Vec3& eye, const AimPoint& aim) {
  constexpr int kEscapes = 3;
  BlockedAim now{eye, aim, target, {}};
  for (int k = 0;; ++k) {
    ++round.rays;
    const Sightline line{now.eye, now.aim.point};
    const auto hit = check.first_hit(line);
    if (!hit || hit->object == target ||
        check.in_front_of(now.aim.triangle, hit->triangle, now.eye, margin)) {
      credit({target, now.aim.triangle}, line);
      return;
    }
    credit_hit(*hit, line);
    now.blocker = *hit;
    if (k == kEscapes || !escape(*scene, cell, margin, random, now)) return;
  }
}

void Sampler::State::aim_past_blockers(std::vector<ObjectId>& targets, std::uint64_t budget) {
  const std::uint64_t end = round.rays + budget;
  std::uint64_t last_find = round.rays;
  for (std::uint64_t k = 0; round.rays < end && !targets.empty(); ++k) {
    const std::uint32_t seen_before = round.seen;
    for (const ObjectId target : targets) {
      if (round.rays >= end) break;
      if (!open(target)) continue;
      const Vec3 eye = viewpoint(cell, random.below(kViewpoints), random);
      if (const auto aim = draw(target, k, eye))
        chase(target, eye, *aim);
      else
        ++round.rays;
    }
    if (round.seen > seen_before) last_find = round.rays;
    std::erase_if(targets, [&](ObjectId target) { return !open(target); });
    if (round.rays - last_find > kPatience * targets.size()) break;
  }
}

// Tells the new witnesses to the set.
SamplingRound Sampler::State::finish() {
  std::vector<std::uint64_t> words(seen.words().begin(), seen.words().end());
  for (std::size_t i = witnesses.size() - round.seen; i < witnesses.size(); ++i) {
    const std::uint32_t o = index_of(witnesses[i].object);
    words[o >> 6] |= std::uint64_t{1} << (o & 63);
  }
  seen = VisibleSet::from_words(seen.universe(), std::move(words));
  return std::exchange(round, {});
}

Sampler::Sampler(std::shared_ptr<const Scene> scene, const std::string& embree_config)
    : state_(std::make_unique<State>(std::move(scene), embree_config)) {}

Sampler::~Sampler() = default;

void Sampler::begin(const Cell& cell, std::uint64_t seed, double near_m) {
  State& s = *state_;
  s.cell = cell;
  s.near_m = near_m;
  s.random = Random(seed);
  double reach = s.check.radius();
  for (int k = 0; k < 8; ++k) reach = std::max(reach, length(cell.corner(k) - s.check.origin()));
  s.margin = s.check.margin_for(reach);
  s.float_margin = std::max(s.margin, 32 * 0x1p-24 * reach);
  for (std::uint32_t o = 0; o < s.skip.size(); ++o)
    s.skip[o] = s.scene->object(ObjectId{o}).occludee == 0;
  s.seen = VisibleSet::none(s.scene->object_count());
  s.witnesses.clear();
}

// Rays in all directions: Embree names what each meets first, and only what would be new is
// checked. It counts if it is met beyond doubt in float, so that every Embree names it.
void Sampler::State::settle_far() {
  rays.name_blockers(lines, blockers);
  round.rays += lines.size();
  std::vector<SightCheck::Hit> met;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!rays.has_embree()) {
      const auto hit = check.first_hit(lines[i]);
      blockers[i] = hit ? hit->triangle : RayScene::kNoTriangle;
    }
    double end = 1;
    if (blockers[i] != RayScene::kNoTriangle) {
      credit_candidate(blockers[i], lines[i]);
      const SeenTriangle t(*scene, blockers[i], lines[i].eye);
      const double at = dot(t.normal, t.corner[0]) / dot(t.normal, lines[i].point - lines[i].eye);
      if (at >= 0 && at <= 1) end = at;
    }
    met.clear();
    check.passed(lines[i], end, met);
    for (const SightCheck::Hit& hit : met) credit_hit(hit, lines[i]);
  }
  lines.clear();
}

SamplingRound Sampler::look_around(std::uint64_t rays) {
  State& s = *state_;
  const double far = 4 * (s.check.radius() + length(s.cell.center() - s.check.origin()));
  for (std::uint64_t k = 0; k < rays; ++k) {
    const Vec3 eye = viewpoint(s.cell, s.random.below(kViewpoints), s.random);
    s.lines.push_back({eye, eye + direction(s.random) * far});
    if (s.lines.size() == RayScene::kBatch || k + 1 == rays) s.settle_far();
  }
  return s.finish();
}

SamplingRound Sampler::aim(const VisibleSet& targets, std::uint64_t rays) {
  State& s = *state_;
  std::vector<ObjectId> open;
  targets.for_each([&](ObjectId id) {
    if (s.open(id)) open.push_back(id);
  });
  const std::uint64_t past_blockers = rays / kPastBlockers;
  {
    StageScope stage(s.stages, Stage::kAim);
    s.aim_plainly(open, rays - past_blockers);
    stage.did(s.round.rays);
  }
  {
    StageScope stage(s.stages, Stage::kEscape);
    const std::uint64_t plainly = s.round.rays;
    s.aim_past_blockers(open, past_blockers);
    stage.did(s.round.rays - plainly);
  }
  return s.finish();
}

SamplingRound Sampler::consider(const Vec3& eye, std::span<const SightCandidate> candidates) {
  State& s = *state_;
  for (const SightCandidate& c : candidates)
    s.credit_candidate(c.triangle, {eye, eye + c.direction});
  return s.finish();
}

void Sampler::try_lines(std::span<const Sightline> lines, std::span<const SightTarget> targets,
                        std::span<std::uint8_t> shows) {
  State& s = *state_;
  s.rays.name_blockers(lines, s.blockers);
  for (std::size_t i = 0; i < lines.size(); ++i)
    shows[i] = length(lines[i].point - lines[i].eye) >= s.near_m &&
               !s.blocked(lines[i], targets[i], s.blockers[i]) &&
               s.check.clear(lines[i], targets[i].object, s.margin, targets[i].triangle);
}

const VisibleSet& Sampler::seen() const { return state_->seen; }
const std::vector<Witness>& Sampler::witnesses() const { return state_->witnesses; }
void Sampler::profile(Stages* stages) { state_->stages = stages; }
double Sampler::margin() const { return state_->margin; }
double Sampler::float_margin() const { return state_->float_margin; }

// Of the objects of `known`; leaves the batch, the set and the list of witnesses as they were.
std::uint64_t Sampler::State::triangles_seen_from(const Vec3& eye,
                                                  const std::vector<Witness>& known) {
  constexpr std::uint64_t kAims = 4;
  for (const Witness& w : known) skip[index_of(w.object)] = 0;
  witnesses.clear();
  for (std::uint64_t k = 0; k < kAims; ++k) {
    for (const Witness& w : known) {
      if (!open(w.object)) continue;
      if (const auto aim = draw(w.object, k, eye)) add(eye, *aim, w.object);
    }
    settle();
  }
  std::uint64_t sum = 0;
  for (const Witness& w : witnesses) sum += scene->object(w.object).triangle_count;
  for (const Witness& w : known) skip[index_of(w.object)] = 1;
  witnesses = known;
  round = {};
  return sum;
}

std::uint64_t Sampler::most_triangles_from_a_point(std::uint32_t viewpoints) {
  State& s = *state_;
  std::uint64_t most = 0;
  const std::vector<Witness> known = s.witnesses;
  for (std::uint32_t v = 0; v < viewpoints; ++v) {
    const Vec3 eye = v == 0 ? s.cell.center() : viewpoint(s.cell, 8 + v, s.random);
    most = std::max(most, s.triangles_seen_from(eye, known));
  }
  return most;
}

}  // namespace pvsfarm
