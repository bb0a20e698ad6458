#include "worker/evaluator/shaft_prover.hpp"

#include <algorithm>
#include <array>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kMostTriangles = 4096;  // of an object that is tested by what they fill
constexpr std::size_t kTargets = 4;             // triangles looked at for a target

// Where in a box: odd places, since scenes are symmetric.
constexpr Vec3 kEye{0.5685, 0.3945, 0.5865}, kTarget{0.4377, 0.5613, 0.4711};
// Where on a triangle.
constexpr Vec3 kWeights[] = {
    {0.37, 0.31, 0.32}, {0.61, 0.23, 0.16}, {0.17, 0.62, 0.21}, {0.22, 0.18, 0.6}};

Vec3 inside(const Box& box, const Vec3& share) { return box.lo + box.size() * share; }

int longest(const Box& box) {
  const Vec3 size = box.size();
  int axis = 0;
  for (int a = 1; a < 3; ++a)
    if (size[a] > size[axis]) axis = a;
  return axis;
}

std::array<Box, 2> halves_of(const Box& box) {
  const int axis = longest(box);
  Box low = box, high = box;
  low.hi[axis] = high.lo[axis] = box.center()[axis];
  return {low, high};
}

}  // namespace

ShaftProver::ShaftProver(const Scene& scene, const ShaftEffort& effort)
    : scene_(scene), effort_(effort), chain_builder_(scene) {}

// Whether what was settled is worth what was spent.
bool ShaftProver::pays() const {
  const double settled = static_cast<double>(settled_triangles_) /
                         static_cast<double>(std::max<std::uint64_t>(open_triangles_, 1));
  return static_cast<double>(cover_.work()) <=
         (effort_.first_share + settled) * static_cast<double>(effort_.most_edges);
}

std::optional<std::uint32_t> ShaftProver::aim(const Part& part, Vec3& target) const {
  target = inside(part.box, kTarget);
  const auto triangles = scene_.triangles(object_);
  for (std::size_t i = part.first; i < std::min(part.end, part.first + kTargets); ++i) {
    const Triangle& triangle = triangles[boxes_[i].triangle];
    Vec3 corners[3];
    for (int k = 0; k < 3; ++k)
      corners[k] = frame_->local_from_world(scene_.vertices()[triangle.vertex[k]]);
    for (const Vec3& w : kWeights) {
      const Vec3 point = corners[0] * w.x + corners[1] * w.y + corners[2] * w.z;
      if (!part.box.contains(point)) continue;
      target = point;
      return boxes_[i].triangle;
    }
  }
  return std::nullopt;
}

void ShaftProver::note_clear(const Vec3& eye, const Vec3& target, std::uint32_t triangle) {
  const auto& axes = frame_->axes();
  const auto turned = [&](const Vec3& local) {
    return axes[0] * local.x + axes[1] * local.y + axes[2] * local.z;
  };
  const auto first = scene_.triangles(object_).data() - scene_.all_triangles().data();
  clear_lines_.push_back({cell_->center() + turned(eye),
                          {static_cast<std::uint32_t>(first) + triangle, turned(target - eye)}});
}

// All of the object: what moves, and what has very many triangles, is anywhere in its box.
ShaftProver::Part ShaftProver::whole(ObjectId id) {
  const ObjectRecord& object = scene_.object(id);
  boxes_.clear();
  if (object.dynamic != 0 || object.triangle_count > kMostTriangles)
    return {frame_->local_around_world(object.box), 0, 0};
  Part part{{}, 0, 0};
  for (const Triangle& triangle : scene_.triangles(id)) {
    TriangleBox& own = boxes_.emplace_back();
    own.triangle = static_cast<std::uint32_t>(part.end++);
    for (const std::uint32_t vertex : triangle.vertex)
      own.box.add(frame_->local_around_point(scene_.vertices()[vertex]));
    part.box.add(own.box);
  }
  return part.end > 0 ? part : Part{frame_->local_around_world(object.box), 0, 0};
}

// On top of boxes_.
ShaftProver::Part ShaftProver::half_of(const Part& part, const Box& half) {
  const std::size_t first = boxes_.size();
  if (part.first == part.end) return {half, first, first};
  Part inner{{}, first, first};
  for (std::size_t i = part.first; i < part.end; ++i) {
    TriangleBox own = boxes_[i];
    own.box.lo = glm::max(own.box.lo, half.lo);
    own.box.hi = glm::min(own.box.hi, half.hi);
    if (own.box.empty()) continue;
    inner.box.add(own.box);
    boxes_.push_back(own);
  }
  inner.end = boxes_.size();
  return inner;
}

// Of the larger of the two, along its longest side.
bool ShaftProver::halves_hidden(const Box& eyes, const Part& part,
                                const ShaftCover::Candidates& candidates, int halvings) {
  if (eyes.size()[longest(eyes)] > part.box.size()[longest(part.box)]) {
    for (const Box& half : halves_of(eyes))
      if (!pair_hidden(half, part, candidates, halvings)) return false;
    return true;
  }
  for (const Box& half : halves_of(part.box)) {
    const std::size_t top = boxes_.size();
    const Part inner = half_of(part, half);
    const bool hidden = inner.box.empty() || pair_hidden(eyes, inner, candidates, halvings);
    boxes_.resize(top);
    if (!hidden) return false;
  }
  return true;
}

bool ShaftProver::pair_hidden(const Box& eyes, const Part& part, ShaftCover::Candidates candidates,
                              int halvings) {
  given_up_ = given_up_ || shafts_left_ == 0 || !pays();
  if (given_up_) return false;
  --shafts_left_;
  ++shafts_;
  const ShaftCover::Candidates outer = candidates;
  ShaftCover::Ends ends{
      .eyes = eyes, .matter = part.box, .eye = inside(eyes, kEye), .within = within_};
  const auto triangle = aim(part, ends.target);
  const ShaftAnswer answer = cover_.ask(ends, candidates);
  bool hidden = answer == ShaftAnswer::kHidden;
  if (!hidden) {
    const bool clear = answer == ShaftAnswer::kClear && triangle.has_value();
    if (clear) note_clear(ends.eye, ends.target, *triangle);
    given_up_ = halvings == 0 || clear;
    hidden = !given_up_ && halves_hidden(eyes, part, candidates, halvings - 1);
  }
  cover_.drop_above(outer);
  return hidden;
}

bool ShaftProver::object_hidden(ObjectId id, const ShaftCover::Candidates& candidates) {
  object_ = id;
  within_ = within_faces(scene_.object(id).box, *cell_);
  shafts_left_ = effort_.shafts_an_object;
  given_up_ = false;
  if (!pair_hidden(eyes_, whole(id), candidates, effort_.halvings)) return false;
  settled_triangles_ += scene_.object(id).triangle_count;
  return true;
}

void ShaftProver::visit(std::uint32_t index, ShaftCover::Candidates candidates, VisibleSet& open) {
  const BvhNode& node = scene_.bvh()[index];
  if (node.box.empty() || !open.any_in(node.first, node.count) || !pays()) return;
  const ShaftCover::Candidates outer = candidates;
  const Box matter = frame_->local_around_world(node.box);
  ++shafts_;
  const bool hidden = cover_.ask({.eyes = eyes_,
                                  .matter = matter,
                                  .eye = inside(eyes_, kEye),
                                  .target = inside(matter, kTarget),
                                  .within = within_faces(node.box, *cell_)},
                                 candidates) == ShaftAnswer::kHidden;
  if (hidden || node.child == 0) {
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const ObjectId id{i};
      if (!open.contains(id)) continue;
      if (hidden) settled_triangles_ += scene_.object(id).triangle_count;
      if (hidden || object_hidden(id, candidates)) open.remove(id);
    }
  } else {
    visit(node.child, candidates, open);
    visit(node.child + 1, candidates, open);
  }
  cover_.drop_above(outer);
}

ShaftWork ShaftProver::run(const Cell& cell, VisibleSet& visible, VisibleSet& open,
                           Evidence* evidence) {
  const CellFrame frame(cell);
  cell_ = &cell;
  frame_ = &frame;
  eyes_ = {-frame.half(), frame.half()};
  shafts_ = open_triangles_ = settled_triangles_ = 0;
  clear_lines_.clear();
  chain_builder_.build(cell, frame, {.near_m = effort_.near_m, .parts = true}, chain_);
  if (chain_.triangles.empty()) return {};
  open.for_each([&](ObjectId id) { open_triangles_ += scene_.object(id).triangle_count; });
  const Box around = frame.local_around_world(scene_.bounds());
  double reach = 0;
  for (int a = 0; a < 3; ++a) reach = std::max({reach, -around.lo[a], around.hi[a]});
  VisibleSet hidden = open;
  visit(0, cover_.begin(frame, chain_, reach), open);
  hidden.remove_all(open);
  visible.remove_all(hidden);
  if (evidence != nullptr && hidden.contains(evidence->object)) evidence->parts.clear();
  return {shafts_, cover_.work()};
}

}  // namespace pvsfarm
