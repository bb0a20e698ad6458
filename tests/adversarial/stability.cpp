#include "tests/adversarial/stability.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "tests/support/aimed_rays.hpp"
#include "tests/support/embree_witness.hpp"
#include "tests/support/evaluation.hpp"

namespace pvsfarm {
namespace {

double random_angle(std::uint64_t seed) { return Random(seed).between(0.1, 1.4); }

Frame frame_of(std::uint64_t seed) {
  Random random(seed);
  return random_frame(random);
}

const Frame kQuarterTurn{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}};
const Frame kMirror{Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};

void add_whole_world(std::vector<Perturbation>& all) {
  using S = std::uint64_t;
  all.push_back(
      {"renumbering", 0, [](World w, S s) { return renumbered(std::move(w), s); }, kSameSets});
  all.push_back(
      {"quarter turn", 0, [](World w, S) { return turned(std::move(w), kQuarterTurn); }, 1.05});
  all.push_back({"mirror", 0, [](World w, S) { return turned(std::move(w), kMirror); }, 1.05});
  // A turned box is no longer one exactly, and rows of houses are not seen to touch.
  all.push_back({"turn about z", 0, [](World w, S s) {
                   return turned(std::move(w), frame_about_z(random_angle(s)));
                 }});
  // Nor does anything stand on the ground.
  all.push_back({"turn", 0, [](World w, S s) { return turned(std::move(w), frame_of(s)); }});
  for (const double offset : {1e3, 1e6, 1e7})
    all.push_back({"move", offset,
                   [offset](World w, S) {
                     return moved(std::move(w), {offset, -offset, offset});
                   },
                   1.05});
  for (const double factor : {1e-3, 1e3})
    all.push_back(
        {"scale", factor, [factor](World w, S) { return scaled(std::move(w), factor); }, 1.05});
}

void add_vertices_and_triangles(std::vector<Perturbation>& all) {
  using S = std::uint64_t;
  for (const double amount : {1e-9, 1e-6, 1e-5, 1e-4, 1e-3})
    all.push_back(
        {"jitter", amount, [amount](World w, S s) { return jittered(std::move(w), amount, s); }});
  for (const double amount : {1e-9, 1e-6, 1e-3})
    all.push_back(
        {"tear", amount, [amount](World w, S s) { return torn(std::move(w), amount, s); }});
  all.push_back({"split in 4", 0, [](World w, S) { return quartered(std::move(w)); }, 1.1});
  for (const int steps : {2, 4})
    all.push_back(
        {"fan", 1.0 * steps, [steps](World w, S) { return fanned(std::move(w), steps); }, 1.15});
  all.push_back({"t-junctions", 0, [](World w, S) { return with_t_junctions(std::move(w)); }});
  for (const double share : {1e-3, 1e-9})
    all.push_back({"slivers", share,
                   [share](World w, S) { return with_slivers(std::move(w), share); }, 1.15});
  all.push_back({"duplicate faces", 0,
                 [](World w, S) { return with_duplicate_faces(std::move(w)); }, kSameSets});
}

void add_objects_and_cells(std::vector<Perturbation>& all) {
  using S = std::uint64_t;
  all.push_back({"twins", 0, [](World w, S) { return twinned(std::move(w)); }, 1.05});
  all.push_back({"divided objects", 0, [](World w, S) { return divided(std::move(w)); }});
  all.push_back({"flat walls", 0.25, [](World w, S) { return flattened(std::move(w), 0.25); }});
  for (const auto& [name, contact] : {std::pair("cell at a face", Contact::kFace),
                                      {"cell at an edge", Contact::kEdge},
                                      {"cell at a corner", Contact::kCorner},
                                      {"cell cuts matter", Contact::kCut},
                                      {"cell in matter", Contact::kInside}})
    all.push_back(
        {name, 0, [contact = contact](World w, S) { return in_contact(std::move(w), contact); }});
}

// Objects of `world` that an evaluation of one cell does not hide, merged by where they come from.
class Merger {
 public:
  Merger(const World& world, const World& unperturbed) : world_(world), base_(unperturbed) {}

  std::vector<char> visible(const std::vector<std::uint32_t>& hidden) const {
    std::vector<char> in_pvs(world_.source.objects.size(), 1);
    for (const std::uint32_t o : hidden) in_pvs[o] = 0;
    return by_origin([&](std::uint32_t o) { return in_pvs[o] != 0; });
  }
  template <class Fn>
  std::vector<char> by_origin(Fn&& is_set) const {
    std::vector<char> merged(base_.source.objects.size(), 0);
    for (std::uint32_t o = 0; o < world_.source.objects.size(); ++o)
      if (world_.source.objects[o].occludee && is_set(o)) merged[world_.origin[o]] = 1;
    return merged;
  }
  std::uint64_t triangles(const std::vector<char>& objects) const {
    std::uint64_t total = 0;
    for (std::size_t o = 0; o < objects.size(); ++o)
      if (objects[o] != 0) total += base_.source.objects[o].triangles.size();
    return total;
  }

 private:
  const World& world_;
  const World& base_;
};

}  // namespace

std::string to_string(const Perturbation& perturbation) {
  if (perturbation.amount == 0) return perturbation.name;
  char amount[32];
  std::snprintf(amount, sizeof amount, " %g", perturbation.amount);
  return perturbation.name + amount;
}

const std::vector<Perturbation>& all_perturbations() {
  static const std::vector<Perturbation> all = [] {
    std::vector<Perturbation> list;
    add_whole_world(list);
    add_vertices_and_triangles(list);
    add_objects_and_cells(list);
    return list;
  }();
  return all;
}

VisibleSets evaluate(const World& world, const World& unperturbed,
                     const EvaluatorSettings& settings) {
  return judge(world, unperturbed, settings, {}).sets;
}

Judgement judge(const World& world, const World& unperturbed, const EvaluatorSettings& settings,
                const Attack& attack) {
  const Merger merger(world, unperturbed);
  Evaluation evaluation(world.source, settings);
  const RayOracle oracle(world.source);
  const AimedRays aimed(world.source, oracle);
  std::optional<EmbreeWitness> witness;
  if (attack.witness_rays > 0) witness.emplace(world.source, oracle);
  Judgement judgement;
  for (std::size_t c = 0; c < world.cells.size(); ++c) {
    const Cell& cell = world.cells[c];
    const std::vector<std::uint32_t> hidden = evaluation.hidden_from(cell);
    judgement.sets.visible.push_back(merger.visible(hidden));
    judgement.sets.triangles += merger.triangles(judgement.sets.visible.back());

    const auto blame = [&](std::uint32_t object, const Segment& segment) {
      judgement.violations.push_back("cell " + std::to_string(c) + ", '" +
                                     world.source.objects[object].name +
                                     "': " + to_string(Violation{object, segment}));
    };
    Random random(attack.seed * 0x9e3779b97f4a7c15ull + c);
    const AimedReport report =
        aimed.search(cell, hidden, attack.rays_per_hidden_object * hidden.size(), random);
    judgement.rays += report.rays;
    for (const Violation& violation : report.violations) blame(violation.object, violation.witness);
    if (!witness) continue;

    std::vector<std::uint32_t> targets;
    for (std::uint32_t o = 0; o < world.source.objects.size(); ++o)
      if (world.source.objects[o].occludee) targets.push_back(o);
    const WitnessReport seen = witness->sample(cell,
                                               {.uniform_rays = attack.witness_rays / 2,
                                                .aimed_rays = attack.witness_rays / 2,
                                                .targets = targets},
                                               random);
    judgement.rays += seen.rays;
    judgement.seen_triangles +=
        merger.triangles(merger.by_origin([&](std::uint32_t o) { return seen.seen(o); }));
    for (const std::uint32_t o : hidden)
      if (seen.seen(o)) blame(o, *seen.witness[o]);
  }
  return judgement;
}

}  // namespace pvsfarm
