#include "worker/evaluator/occludee_hierarchy.hpp"

#include <algorithm>

namespace pvsfarm {
namespace {

void push_open(const BvhNode& node, const VisibleSet& open, std::vector<ObjectId>& objects) {
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
    if (open.contains(ObjectId{i})) objects.push_back(ObjectId{i});
}

}  // namespace

// The rule on one map.
PlaneAnswer HierarchyTest::ask(std::size_t map, const Box& local_box) {
  ++box_tests_;
  const Group& group = groups_[group_of_[map]];
  if (!placed_.test(group_of_[map])) {
    placed_.set(group_of_[map]);
    groups_[group_of_[map]].planes.place(local_box);
  }
  const PlaneAnswer answer = group.planes.answer(map - group.first);
  improved_.reset();
  if (answer != PlaneAnswer::kUnknown || rule_ != BoxRule::kImproved) return answer;
  ++improved_tests_;
  improved_ = improved_test(maps_[map], local_box);
  if (!improved_) return answer;
  improved_helped_ = true;
  return PlaneAnswer::kHidden;
}

// The rule on every map that is not yet known to be futile; `useful` loses those found futile.
// What hid the box before this one, its neighbour, often hides this one too: it is asked first.
bool HierarchyTest::hidden(const Box& local_box, MapMask& useful) {
  placed_.reset();
  const std::size_t likely = hidden_by_;
  if (useful.test(likely) && ask(likely, local_box) == PlaneAnswer::kHidden) return true;
  for (std::size_t m = useful._Find_first(); m < maps_.size(); m = useful._Find_next(m)) {
    if (m == likely) continue;
    const PlaneAnswer answer = ask(m, local_box);
    if (answer == PlaneAnswer::kHidden) {
      hidden_by_ = m;
      return true;
    }
    if (answer == PlaneAnswer::kFutile) useful.reset(m);
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
  if (splits_ == 0 || useful.none()) return false;
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
  if (useful.none()) return;  // no plane can hide any part of what is in here
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
  for (std::size_t m = 0; m < maps_.size(); ++m) all.set(m);
  groups_.clear();
  group_of_.clear();
  for (std::size_t m = 0; m < maps_.size(); m = group_of_.size()) {
    const std::size_t count = groups_.emplace_back(Group{.first = m}).planes.set(maps_.subspan(m));
    group_of_.resize(m + count, groups_.size() - 1);
  }
  hidden_by_ = 0;
  visit(0, all, open);
}

}  // namespace pvsfarm
