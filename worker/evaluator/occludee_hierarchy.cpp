#include "worker/evaluator/occludee_hierarchy.hpp"

#include <algorithm>
#include <bit>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

void push_open(const BvhNode& node, const VisibleSet& open, std::vector<ObjectId>& objects) {
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
    if (open.contains(ObjectId{i})) objects.push_back(ObjectId{i});
}

// A clock costs about as much as a test: few tests are timed, and what the clock takes is told by
// asking it twice before.
constexpr std::uint32_t kTimed = 32;

}  // namespace

std::optional<PlaneRect> HierarchyTest::ask_improved(std::size_t map, const Box& local_box) {
  const bool timed = clock_ != nullptr && improved_tests_ % kTimed == 0;
  ++improved_tests_;
  if (!timed) return improved_test(maps_[map], local_box);
  const double early_ms = clock_(), start_ms = clock_();
  std::optional<PlaneRect> answer = improved_test(maps_[map], local_box);
  timed_ms_ += (clock_() - start_ms) - (start_ms - early_ms);
  ++timed_tests_;
  return answer;
}

double HierarchyTest::improved_ms() const {
  if (timed_tests_ == 0) return 0;
  return std::max(timed_ms_, 0.0) * improved_tests_ / timed_tests_;
}

// The rule on maps of one group, in their order; `useful` loses those found futile.
bool HierarchyTest::hidden_on(std::size_t group_index, std::uint16_t asked, const Box& local_box,
                              MapMask& useful) {
  Group& group = groups_[group_index];
  if ((placed_ >> group_index & 1) == 0) {
    placed_ |= 1u << group_index;
    group.planes.place(local_box);
  }
  unsigned futile = asked & group.planes.futile();
  for (unsigned rest = asked & group.planes.falls(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const PlaneAnswer answer = group.planes.answer_of_pixels(k);
    improved_.reset();
    if (answer == PlaneAnswer::kFutile) futile |= 1u << k;
    if (answer == PlaneAnswer::kUnknown && rule_ == BoxRule::kImproved &&
        group.planes.before_plane(k)) {
      improved_ = ask_improved(group.first + k, local_box);
      improved_helped_ = improved_helped_ || improved_;
    }
    if (answer != PlaneAnswer::kHidden && !improved_) continue;
    hidden_by_ = group.first + k;
    hidden_by_group_ = group_index;
    box_tests_ += static_cast<std::uint32_t>(std::popcount(asked & ((2u << k) - 1)));
    return true;
  }
  box_tests_ += static_cast<std::uint32_t>(std::popcount(unsigned{asked}));
  useful.groups[group_index] &= static_cast<std::uint16_t>(~futile);
  return false;
}

// The rule on every map that is not yet known to be futile; `useful` loses those found futile.
// What hid the box before this one, its neighbour, often hides this one too: it is asked first.
bool HierarchyTest::hidden(const Box& local_box, MapMask& useful) {
  placed_ = 0;
  const std::size_t first_group = hidden_by_group_;
  const auto likely = static_cast<std::uint16_t>(useful.groups[first_group] &
                                                 (1u << (hidden_by_ - groups_[first_group].first)));
  if (likely != 0 && hidden_on(first_group, likely, local_box, useful)) return true;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const auto asked = static_cast<std::uint16_t>(g == first_group ? useful.groups[g] & ~likely
                                                                   : useful.groups[g]);
    if (asked != 0 && hidden_on(g, asked, local_box, useful)) return true;
  }
  return false;
}

// Rule S: hidden if what of the object lies in each part is, by whatever plane.
bool HierarchyTest::part_hidden(const Box& local_box, Range part, MapMask useful, int splits_left) {
  if (hidden(local_box, useful)) {
    if (noting_) watched_->parts.push_back({local_box, hidden_by_, 1, improved_});
    return true;
  }
  return splits_left > 0 && useful.any() && halves_hidden(local_box, part, useful, splits_left - 1);
}

// `part`: the boxes of the triangles in the box; none: it is full.
bool HierarchyTest::halves_hidden(const Box& local_box, Range part, const MapMask& useful,
                                  int splits_left) {
  int axis = 0;
  const Vec3 size = local_box.size();
  for (int a = 1; a < 3; ++a)
    if (size[a] > size[axis]) axis = a;
  Box low = local_box, high = local_box;
  low.hi[axis] = high.lo[axis] = local_box.center()[axis];
  for (const Box& half : {high, low}) {
    const std::size_t first = triangle_boxes_.size();
    const Box inside = part.first == part.end ? half : push_inside(half, part);
    const bool all_hidden =
        inside.empty() || part_hidden(inside, {first, triangle_boxes_.size()}, useful, splits_left);
    triangle_boxes_.resize(first);
    if (!all_hidden) return false;
  }
  return true;
}

bool HierarchyTest::object_hidden(ObjectId id, MapMask useful) {
  const Box local_box = local_box_of(id);
  if (hidden(local_box, useful)) {
    if (noting_) watched_->parts.push_back({local_box, hidden_by_, 1, improved_});
    return true;
  }
  if (splits_ == 0 || !useful.any()) return false;
  triangle_boxes_.clear();
  push_triangles(id);
  return halves_hidden(local_box, {0, triangle_boxes_.size()}, useful, splits_ - 1);
}

// Pushes what the half holds of the boxes, and returns the box around that.
Box HierarchyTest::push_inside(const Box& half, Range part) {
  Box around;
  for (std::size_t i = part.first; i < part.end; ++i) {
    Box inside = triangle_boxes_[i];
    bool meets = true;
    for (int a = 0; a < 3; ++a) {
      inside.lo[a] = std::max(inside.lo[a], half.lo[a]);
      inside.hi[a] = std::min(inside.hi[a], half.hi[a]);
      meets = meets && inside.lo[a] <= inside.hi[a];
    }
    if (!meets) continue;
    around.add(inside.lo);
    around.add(inside.hi);
    triangle_boxes_.push_back(inside);
  }
  return around;
}

// The boxes of the triangles that it is to be halved among, while a run has so many left. What
// moves is anywhere in its box.
void HierarchyTest::push_triangles(ObjectId id) {
  const ObjectRecord& object = scene_.object(id);
  if (object.dynamic != 0 || object.triangle_count > triangles_left_) return;
  triangles_left_ -= object.triangle_count;
  for (const Triangle& triangle : scene_.triangles(id)) {
    Box& box = triangle_boxes_.emplace_back();
    for (const std::uint32_t vertex : triangle.vertex) {
      const Box point = frame_.local_around_point(scene_.vertices()[vertex]);
      box.add(point.lo);
      box.add(point.hi);
    }
  }
}

// In a turned cell the box of an object's box is up to twice as wide as the object: a house that
// stands as the cell does fills its own box again when that is taken from its corners.
Box HierarchyTest::local_box_of(ObjectId id) const {
  constexpr std::uint32_t kMostTriangles = 4096;
  const ObjectRecord& object = scene_.object(id);
  const Box around = frame_.local_around_world(object.box);
  // What moves is anywhere in its box.
  if (frame_.aligned() || object.dynamic != 0 || object.triangle_count > kMostTriangles)
    return around;
  Box tight;
  for (const Triangle& triangle : scene_.triangles(id))
    for (const std::uint32_t vertex : triangle.vertex) {
      const Box point = frame_.local_around_point(scene_.vertices()[vertex]);
      tight.add(point.lo);
      tight.add(point.hi);
    }
  return tight.empty() ? around : tight;
}

void HierarchyTest::visit(std::uint32_t index, MapMask useful, VisibleSet& open) {
  const BvhNode& node = scene_.bvh()[index];
  if (node.box.empty() || !open.any_in(node.first, node.count)) return;
  const Box local_box = frame_.local_around_world(node.box);
  improved_helped_ = false;
  if (hidden(local_box, useful)) {
    if (improved_helped_) push_open(node, open, improved_objects_);
    if (const std::uint32_t group = group_of_watched(watched_, open, node); group > 0)
      watched_->parts = {{local_box, hidden_by_, group, improved_}};
    open.remove_range(node.first, node.count);
    return;
  }
  if (!useful.any()) return;  // no plane can hide any part of what is in here
  if (node.child != 0) {
    visit(node.child, useful, open);
    visit(node.child + 1, useful, open);
    return;
  }
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    const ObjectId id{i};
    if (!open.contains(id)) continue;
    noting_ = watched_ != nullptr && id == watched_->object;
    improved_helped_ = false;
    if (object_hidden(id, useful)) {
      open.remove(id);
      if (improved_helped_) improved_objects_.push_back(id);
    } else if (noting_) {
      watched_->parts.clear();  // some parts are hidden, the whole is not
    }
    noting_ = false;
  }
}

void HierarchyTest::run(VisibleSet& open, int splits) {
  splits_ = splits;
  triangles_left_ = kTrianglesARun;
  MapMask all;
  groups_.clear();
  for (std::size_t m = 0; m < maps_.size();) {
    PVS_CHECK(groups_.size() < kMaxMapGroups);
    const std::size_t count = groups_.emplace_back(Group{.first = m}).planes.set(maps_.subspan(m));
    all.groups[groups_.size() - 1] = static_cast<std::uint16_t>((1u << count) - 1);
    m += count;
  }
  if (groups_.empty()) return;
  hidden_by_ = hidden_by_group_ = 0;
  visit(0, all, open);
}

}  // namespace pvsfarm
