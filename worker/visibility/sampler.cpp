#include "worker/visibility/sampler.hpp"

#include <algorithm>
#include <cmath>
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

constexpr std::uint32_t kNoAim = 0xffffffffu;

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
  double near_m = 0, margin = 0, wide_margin = 0;
  Random random{0};
  std::vector<std::uint8_t> skip;  // by object: seen already, or no occludee
  VisibleSet seen;
  std::vector<Witness> witnesses;
  SamplingRound round;

  // The batch of rays in the making.
  std::vector<Sightline> lines;
  std::vector<std::uint32_t> aimed_at;  // the triangle at the line's end, or kNoAim
  std::vector<RayScene::Hit> hits;
  std::vector<RayScene::Passed> passed;

  bool open(ObjectId object) const { return skip[index_of(object)] == 0; }
  void add(const Vec3& eye, const Vec3& point, std::uint32_t triangle);
  void cast();
  void settle();
  bool credit(ObjectId object, const Sightline& line, double by);
  bool credit_hit(std::uint32_t triangle, const Sightline& line, double by);
  bool robust_hit(std::uint32_t triangle, const Sightline& line, double by, Vec3& point);
  void aim_plainly(std::vector<ObjectId>& targets, std::uint64_t budget);
  void aim_past_blockers(std::vector<ObjectId>& targets, std::uint64_t budget);
  void chase(ObjectId target, const Vec3& eye, const AimPoint& aim);
  SamplingRound finish();
};

// The object is seen along the line, if that is clear.
bool Sampler::State::credit(ObjectId object, const Sightline& line, double by) {
  if (!open(object) || length(line.point - line.eye) < near_m) return false;
  ++round.checks;
  if (!check.clear(line, object, by)) return false;
  skip[index_of(object)] = 1;
  witnesses.push_back({object, line.eye, line.point});
  ++round.seen;
  return true;
}

// Where the line, however long, meets the triangle, if it does so robustly: through the front or a
// visible back, inside all edges even as seen from the eye, and with nothing else near.
bool Sampler::State::robust_hit(std::uint32_t triangle, const Sightline& line, double by,
                                Vec3& point) {
  const Vec3 d = line.point - line.eye;
  const SeenTriangle t(*scene, triangle, line.eye);
  const bool two_sided = scene->object(check.object_of(triangle)).two_sided;
  if (t.degenerate() || !(t.front_met(d, by) || (two_sided && t.back_met(d, by)))) return false;
  const double rise = dot(t.normal, d), at = dot(t.normal, t.corner[0]) / rise;
  const Vec3 p = d * at;
  if (!(at > 0) || length(p) < near_m) return false;
  const double slope = std::abs(rise) / (t.normal_length * length(d));
  if (!(t.depth_inside(p) * slope > by)) return false;
  point = line.eye + p;
  ++round.checks;
  return check.clear_but_for({line.eye, point}, triangle, by);
}

bool Sampler::State::credit_hit(std::uint32_t triangle, const Sightline& line, double by) {
  const ObjectId object = check.object_of(triangle);
  Vec3 point;
  if (!open(object) || !robust_hit(triangle, line, by, point)) return false;
  skip[index_of(object)] = 1;
  witnesses.push_back({object, line.eye, point});
  ++round.seen;
  return true;
}

void Sampler::State::add(const Vec3& eye, const Vec3& point, std::uint32_t triangle) {
  lines.push_back({eye, point});
  aimed_at.push_back(triangle);
  if (lines.size() == RayScene::kBatch) settle();
}

// Casts the batch and credits what it saw: the target where nothing was before it, and whatever
// else was met first or passed.
void Sampler::State::settle() {
  hits.resize(lines.size());
  rays.cast(lines, skip, hits, passed);
  round.rays += lines.size();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const RayScene::Hit& hit = hits[i];
    const bool met = hit.triangle != RayScene::kNoTriangle;
    if (aimed_at[i] != kNoAim) {
      const ObjectId target = check.object_of(aimed_at[i]);
      if (!met || hit.t >= 1 || check.object_of(hit.triangle) == target)
        credit(target, lines[i], wide_margin);
    }
    if (met) credit_hit(hit.triangle, lines[i], wide_margin);
  }
  for (const RayScene::Passed& p : passed) credit_hit(p.triangle, lines[p.ray], wide_margin);
  lines.clear();
  aimed_at.clear();
}

// Rounds over all targets that are still open, each from one eye, so that the rays of a batch run
// side by side: the targets are in the order of their ids, which is an order in space.
void Sampler::State::aim_plainly(std::vector<ObjectId>& targets, std::uint64_t budget) {
  const std::uint64_t end = round.rays + budget;
  for (std::uint64_t k = 0; round.rays < end && !targets.empty(); ++k) {
    const Vec3 eye = viewpoint(cell, k, random);
    const std::uint64_t before = round.rays;
    for (const ObjectId target : targets) {
      if (round.rays + lines.size() >= end) break;
      auto aim = k % 2 == 0 ? aims.corner(target, k / 2, eye, wide_margin)
                            : aims.anywhere(target, random, eye, wide_margin);
      if (aim) add(eye, aim->point, aim->triangle);
    }
    settle();
    std::erase_if(targets, [&](ObjectId target) { return !open(target); });
    if (round.rays == before && k > 16) break;  // nothing to aim at
  }
}

void Sampler::State::chase(ObjectId target, const Vec3& eye, const AimPoint& aim) {
  constexpr int kEscapes = 3;
  BlockedAim now{eye, aim, target, {}};
  for (int k = 0; k <= kEscapes; ++k) {
    ++round.rays;
    const Sightline line{now.eye, now.aim.point};
    const auto hit = check.first_hit(line);
    if (!hit || hit->object == target) {
      if (credit(target, line, margin) || !hit) return;
      credit_hit(hit->triangle, line, margin);
      return;
    }
    credit_hit(hit->triangle, line, margin);
    now.blocker = *hit;
    if (k < kEscapes && !escape(*scene, cell, random, now)) return;
  }
}

void Sampler::State::aim_past_blockers(std::vector<ObjectId>& targets, std::uint64_t budget) {
  const std::uint64_t end = round.rays + budget;
  for (std::uint64_t k = 0; round.rays < end && !targets.empty(); ++k) {
    for (const ObjectId target : targets) {
      if (round.rays >= end) break;
      if (!open(target)) continue;
      const Vec3 eye = viewpoint(cell, random.below(24), random);
      const auto aim = k % 3 == 0 ? aims.corner(target, random.below(8), eye, margin)
                                  : aims.anywhere(target, random, eye, margin);
      if (aim)
        chase(target, eye, *aim);
      else
        ++round.rays;
    }
    std::erase_if(targets, [&](ObjectId target) { return !open(target); });
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
  s.wide_margin = std::max(s.margin, RayScene::float_error(reach + s.check.radius()));
  for (std::uint32_t o = 0; o < s.skip.size(); ++o)
    s.skip[o] = s.scene->object(ObjectId{o}).occludee == 0;
  s.seen = VisibleSet::none(s.scene->object_count());
  s.witnesses.clear();
}

SamplingRound Sampler::look_around(std::uint64_t rays) {
  State& s = *state_;
  const double far = 4 * (s.check.radius() + 1);
  for (std::uint64_t done = 0; done < rays;) {
    const Vec3 eye = viewpoint(s.cell, s.random.below(24), s.random);
    for (std::size_t i = 0; i < RayScene::kBatch / 4 && done < rays; ++i, ++done)
      s.add(eye, eye + direction(s.random) * far, kNoAim);
  }
  s.settle();
  return s.finish();
}

SamplingRound Sampler::aim(const VisibleSet& targets, std::uint64_t rays) {
  State& s = *state_;
  std::vector<ObjectId> open;
  targets.for_each([&](ObjectId id) {
    if (s.open(id)) open.push_back(id);
  });
  s.aim_plainly(open, rays - rays / 4);
  s.aim_past_blockers(open, rays / 4);
  return s.finish();
}

SamplingRound Sampler::consider(const Vec3& eye, std::span<const SightCandidate> candidates) {
  State& s = *state_;
  for (const SightCandidate& c : candidates)
    s.credit_hit(c.triangle, {eye, eye + c.direction}, s.wide_margin);
  return s.finish();
}

const VisibleSet& Sampler::seen() const { return state_->seen; }
const std::vector<Witness>& Sampler::witnesses() const { return state_->witnesses; }
double Sampler::margin() const { return state_->margin; }

std::uint64_t Sampler::most_triangles_from_a_point(std::uint32_t viewpoints) {
  State& s = *state_;
  constexpr int kAims = 4;
  std::uint64_t most = 0;
  const std::vector<Witness> witnesses = s.witnesses;
  const std::vector<std::uint8_t> skip = s.skip;
  for (std::uint32_t v = 0; v < viewpoints; ++v) {
    const Vec3 eye = v == 0 ? s.cell.center() : viewpoint(s.cell, 9 + v, s.random);
    for (const Witness& w : witnesses) s.skip[index_of(w.object)] = 0;
    std::uint64_t sum = 0;
    s.witnesses.clear();
    for (int k = 0; k < kAims; ++k) {
      for (const Witness& w : witnesses) {
        if (!s.open(w.object)) continue;
        const auto aim = k % 2 == 0 ? s.aims.corner(w.object, s.random.next(), eye, s.wide_margin)
                                    : s.aims.anywhere(w.object, s.random, eye, s.wide_margin);
        if (aim) s.add(eye, aim->point, aim->triangle);
      }
      s.settle();
    }
    for (const Witness& w : s.witnesses) sum += s.scene->object(w.object).triangle_count;
    most = std::max(most, sum);
  }
  s.witnesses = witnesses;
  s.skip = skip;
  s.round = {};
  return most;
}

}  // namespace pvsfarm
