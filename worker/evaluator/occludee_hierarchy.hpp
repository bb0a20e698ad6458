// Tests the scene's hierarchy of occludee boxes against a set of occlusion maps.
//
// Source: Durand 2000, 2.4 and 6.1; theory A.3 (Rules P and S), A.9 (futility), A.10 (improved).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/evaluator/evidence.hpp"
#include "worker/visibility/box_on_planes.hpp"
#include "worker/visibility/improved_test.hpp"
#include "worker/visibility/stages.hpp"

namespace pvsfarm {

inline constexpr int kMaxMaps = 96;  // six faces, sixteen planes each
// Maps of one face that follow each other are asked together; twice as many faces if some have more
// maps than are asked at once.
inline constexpr std::size_t kMaxMapGroups = 12;

// A bit a map, by group.
struct MapMask {
  std::array<std::uint16_t, kMaxMapGroups> groups{};
  bool any() const {
    return std::any_of(groups.begin(), groups.end(), [](std::uint16_t g) { return g != 0; });
  }
};

// How a box is tested against one map.
enum class BoxRule : std::uint8_t {
  kPlain,     // rule P
  kImproved,  // rule P, or the improved Projection of what lies before the plane
};

// Threads: one object, one thread; made anew for every cell.
class HierarchyTest {
 public:
  HierarchyTest(const Scene& scene, const CellFrame& frame, std::span<const OcclusionMap> maps,
                BoxRule rule = BoxRule::kPlain)
      : scene_(scene), frame_(frame), maps_(maps), rule_(rule) {}

  // Removes from `open` every object proved hidden. Rule S: an object's box is halved up to
  // `splits` times in a row, and of each half only what the boxes of its triangles fill counts.
  void run(VisibleSet& open, int splits);
  // From now on the parts of evidence->object that are hidden, and by which map, are noted there.
  // It outlives the runs; null: nothing is noted.
  void watch(Evidence* evidence) { watched_ = evidence; }
  std::uint32_t box_tests() const { return box_tests_; }
  // Of them, those of the improved Projection; and the objects hidden that rule P alone would not
  // have hidden, by the same planes and parts.
  std::uint32_t improved_tests() const { return improved_tests_; }
  std::span<const ObjectId> improved_objects() const { return improved_objects_; }
  // From now on some of those tests are timed.
  void time_improved(CpuClock clock) { clock_ = clock; }
  // [ms] What all of them took, judged by those timed; 0 without a clock.
  double improved_ms() const;

 private:
  // Maps of one face.
  struct Group {
    BoxOnPlanes planes;
    std::size_t first = 0;  // into maps_
  };
  bool hidden_on(std::size_t group, std::uint16_t asked, const Box& local_box, MapMask& useful);
  std::optional<PlaneRect> ask_improved(std::size_t map, const Box& local_box);
  bool hidden(const Box& local_box, MapMask& useful);
  struct Range {
    std::size_t first, end;
  };
  bool object_hidden(ObjectId id, MapMask useful);
  bool part_hidden(const Box& local_box, Range part, MapMask useful, int splits_left);
  bool halves_hidden(const Box& local_box, Range part, const MapMask& useful, int splits_left);
  Box push_inside(const Box& half, Range part);
  void push_triangles(ObjectId id);
  Box local_box_of(ObjectId id) const;
  void visit(std::uint32_t node, MapMask useful, VisibleSet& open);

  const Scene& scene_;
  const CellFrame& frame_;
  std::span<const OcclusionMap> maps_;
  BoxRule rule_;
  std::vector<Group> groups_;
  unsigned placed_ = 0;  // a bit a group: it has placed the box being tested
  Evidence* watched_ = nullptr;
  bool noting_ = false;        // the box being tested is of the watched object
  std::size_t hidden_by_ = 0;  // the map of the last box found hidden, its group,
  std::size_t hidden_by_group_ = 0;
  std::optional<PlaneRect> improved_;  // and where on it, if not by rule P
  std::vector<Box> triangle_boxes_;    // of the object being tested, a stack; local frame
  // [limit] Of a run. Forests would spend their time on leaves.
  static constexpr std::uint32_t kTrianglesARun = 50'000;
  std::uint32_t triangles_left_ = 0;
  int splits_ = 0;
  std::uint32_t box_tests_ = 0, improved_tests_ = 0;
  CpuClock clock_ = nullptr;
  double timed_ms_ = 0;  // of every kTimed-th improved test
  std::uint32_t timed_tests_ = 0;
  bool improved_helped_ = false;  // some part of what is being tested is hidden by it alone
  std::vector<ObjectId> improved_objects_;
};

}  // namespace pvsfarm
