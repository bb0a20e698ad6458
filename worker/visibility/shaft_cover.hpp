// Whether a chain of surface triangles blocks every segment between eyes in one box and points in
// another.
//
// Source: docs/algorithm.md A.15. As for the pixels of a plane (A.14), with the points of an object
// in the place of those of a pixel: the segments between two convex boxes are one connected family.
// Triangles block them all if no segment meets their border, none of them reaches into either box,
// and one segment crosses them an odd number of times.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/cells/cell.hpp"
#include "worker/visibility/shaft.hpp"
#include "worker/visibility/sheet_finder.hpp"
#include "worker/visibility/surface_chain.hpp"

namespace pvsfarm {

enum class ShaftAnswer : std::uint8_t {
  kHidden,
  kUnknown,
  kClear,  // the segment to the target meets nothing of the chain: only a hint
};

// Threads: one object, one thread. Keeps scratch memory from cell to cell.
class ShaftCover {
 public:
  // What may be met in a shaft, and so in all shafts within it: ranges of the cover's own stacks.
  struct Candidates {
    std::size_t first_edge, last_edge, first_triangle, last_triangle;
  };
  struct Ends {
    Box eyes, matter;  // in the local frame; eyes: the cell or part of it
    Vec3 eye, target;  // inside them
    unsigned within =
        0;  // faces of the cell that `matter` is surely not beyond, see within_faces()
  };

  // `reach`: no coordinate of what will be asked about is larger. Keeps a reference to the chain.
  Candidates begin(const CellFrame& frame, const SurfaceChain& chain, double reach);

  // Narrows `candidates` down to those of this shaft, on top of the stacks.
  ShaftAnswer ask(const Ends& ends, Candidates& candidates);
  // Edges looked at since begin().
  std::uint64_t work() const { return work_; }
  // Takes from the stacks what lies on top of them.
  void drop_above(const Candidates& candidates);

 private:
  struct Plane {
    Vec3 normal;
    double offset, error;
  };
  void push_edge(std::uint32_t edge);
  void find_met(const Ends& ends, const Candidates& among);
  bool keeps_off(const Box& box, std::uint32_t triangle) const;
  bool in_front(const Box& box, std::uint32_t triangle) const;
  bool usable(const Ends& ends, std::uint32_t triangle) const;
  std::optional<bool> crossing(const Ends& ends, std::uint32_t triangle) const;
  ShaftAnswer search(const Ends& ends, const Candidates& own);

  const SurfaceChain* chain_ = nullptr;
  double scale_ = 0, margin_ = 0;
  std::uint64_t work_ = 0;
  std::vector<Plane> planes_;
  std::vector<Box> boxes_;
  // A stack of edges, with their ends in columns.
  std::vector<std::uint32_t> edges_;
  std::array<std::vector<double>, 6> ends_;
  std::vector<double> beyond_;  // scratch
  std::vector<SheetFinder::Active> triangles_;
  std::vector<SheetFinder::Active> active_;
  std::vector<std::optional<bool>> crossings_;
  SheetFinder finder_;
};

// Bit 2 a: no point of the world box is below the cell's low face of axis a, by exact comparison;
// bit 2 a + 1: above the high one. 0 unless has_world_coordinates(); no bits for an axis without
// extent.
unsigned within_faces(const Box& world, const Cell& cell);

}  // namespace pvsfarm
