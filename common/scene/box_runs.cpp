#include "common/scene/box_runs.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>

#include "common/scene/hierarchy.hpp"

namespace pvsfarm {
namespace {

// A neighbour that would leave less of the cross-section is another row.
constexpr double kMinKeptShare = 0.5;

// Finds the boxes that meet a box, in no particular order.
class BoxIndex {
 public:
  explicit BoxIndex(std::span<const Box> boxes) {
    const ObjectOrder order = morton_order(boxes);
    numbers_ = order.file_index;
    for (const std::uint32_t i : numbers_) {
      records_.emplace_back().box = boxes[i];
      records_.back().occludee = 1;
    }
    nodes_ = build_bvh(records_, order.morton);
  }

  template <class Fn>
  void for_each_meeting(const Box& box, Fn&& fn) const {
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const BvhNode& node = nodes_[stack.back()];
      stack.pop_back();
      if (!node.box.meets(box)) continue;
      if (node.child != 0) {
        stack.push_back(node.child);
        stack.push_back(node.child + 1);
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        if (records_[i].box.meets(box)) fn(numbers_[i]);
    }
  }

 private:
  std::vector<std::uint32_t> numbers_;
  std::vector<ObjectRecord> records_;
  std::vector<BvhNode> nodes_;
};

bool holds(const Box& outer, const Box& inner) {
  return outer.contains(inner.lo) && outer.contains(inner.hi);
}

// Along which of the two cross axes a run may lose width as it grows.
struct Growth {
  int axis;
  std::array<bool, 3> may_shrink;  // the entry of `axis` is unused
};

class RunFinder {
 public:
  explicit RunFinder(std::span<const Box> boxes) : boxes_(boxes), index_(boxes) {}

  BoxRun grow_from(std::uint32_t start, const Growth& growth) const {
    BoxRun run{boxes_[start], {start}};
    while (run.members.size() < kMaxRunBoxes) {
      const std::optional<Neighbour> low = best_neighbour(run.box, growth, false);
      const std::optional<Neighbour> high = best_neighbour(run.box, growth, true);
      if (!low && !high) break;
      extend(run, growth, low && (!high || low->score >= high->score) ? *low : *high);
    }
    std::sort(run.members.begin(), run.members.end());
    return run;
  }

 private:
  struct Neighbour {
    std::uint32_t box;
    bool high;                         // at the high end of the run
    std::tuple<double, double> score;  // share of the cross-section it leaves, then its reach
  };

  std::optional<Neighbour> best_neighbour(const Box& run, const Growth& growth, bool high) const {
    const int axis = growth.axis;
    const double end = high ? run.hi[axis] : run.lo[axis];
    Box face = run;
    face.lo[axis] = face.hi[axis] = end;
    std::optional<Neighbour> best;
    index_.for_each_meeting(face, [&](std::uint32_t i) {
      const double reach = high ? boxes_[i].hi[axis] - end : end - boxes_[i].lo[axis];
      const double kept = kept_share(run, boxes_[i], growth);
      if (!(reach > 0) || kept < kMinKeptShare) return;
      const Neighbour next{i, high, {kept, reach}};
      if (!best || next.score > best->score || (next.score == best->score && i < best->box))
        best = next;
    });
    return best;
  }

  void extend(BoxRun& run, const Growth& growth, const Neighbour& by) const {
    const Box& next = boxes_[by.box];
    for (int a = 0; a < 3; ++a) {
      if (a == growth.axis) continue;
      run.box.lo[a] = std::max(run.box.lo[a], next.lo[a]);
      run.box.hi[a] = std::min(run.box.hi[a], next.hi[a]);
    }
    Vec3& end = by.high ? run.box.hi : run.box.lo;
    end[growth.axis] = by.high ? next.hi[growth.axis] : next.lo[growth.axis];
    run.members.push_back(by.box);
  }

  // How much of the run's cross-section `next` covers; 0 where it may not shrink and would.
  static double kept_share(const Box& run, const Box& next, const Growth& growth) {
    double share = 1;
    for (int a = 0; a < 3; ++a) {
      if (a == growth.axis) continue;
      const double lo = std::max(run.lo[a], next.lo[a]), hi = std::min(run.hi[a], next.hi[a]);
      if (!growth.may_shrink[a] && (lo != run.lo[a] || hi != run.hi[a])) return 0;
      share *= std::max(0.0, hi - lo) / (run.hi[a] - run.lo[a]);
    }
    return share;
  }

  std::span<const Box> boxes_;
  BoxIndex index_;
};

std::vector<BoxRun> without_repeats(std::vector<BoxRun> runs) {
  const auto key = [](const BoxRun& r) {
    return std::tuple(r.box.lo.x, r.box.lo.y, r.box.lo.z, r.box.hi.x, r.box.hi.y, r.box.hi.z);
  };
  std::vector<std::uint32_t> order(runs.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(key(runs[a]), a) < std::tuple(key(runs[b]), b);
  });
  const auto last = std::unique(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return key(runs[a]) == key(runs[b]);
  });
  order.erase(last, order.end());
  std::sort(order.begin(), order.end());
  std::vector<BoxRun> distinct;
  for (const std::uint32_t i : order) distinct.push_back(std::move(runs[i]));
  return distinct;
}

std::vector<BoxRun> without_contained(std::vector<BoxRun> runs, std::span<const Box> boxes) {
  if (runs.empty()) return runs;
  std::vector<Box> all(boxes.begin(), boxes.end());
  for (const BoxRun& run : runs) all.push_back(run.box);
  const BoxIndex index(all);
  std::vector<BoxRun> kept;
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    bool contained = false;
    const auto self = static_cast<std::uint32_t>(boxes.size()) + r;
    index.for_each_meeting(runs[r].box, [&](std::uint32_t i) {
      contained = contained || (i != self && holds(all[i], runs[r].box));
    });
    if (!contained) kept.push_back(runs[r]);
  }
  return kept;
}

}  // namespace

std::vector<BoxRun> find_box_runs(std::span<const Box> boxes) {
  if (boxes.size() < 2) return {};
  const RunFinder finder(boxes);
  std::vector<BoxRun> runs;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
      for (const auto& [shrink_u, shrink_v] :
           {std::pair(false, false), std::pair(true, false), std::pair(false, true)}) {
        Growth growth{axis, {}};
        growth.may_shrink[u] = shrink_u;
        growth.may_shrink[v] = shrink_v;
        BoxRun run = finder.grow_from(i, growth);
        if (run.members.size() > 1) runs.push_back(std::move(run));
      }
  }
  return without_contained(without_repeats(std::move(runs)), boxes);
}

}  // namespace pvsfarm
