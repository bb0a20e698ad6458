// A first look at a cell's occluders for one plane: which can have a Projection that holds a pixel.
//
// The views of a box's corners bound the views of all that lies in the box: where the eight views
// of an occluder's box have less than a pixel in common, its Projection covers nothing (theory A.4,
// step 4, for the box). Most occluders of most planes end here.
// Threads: one object, one thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/visibility/cell_frame.hpp"
#include "worker/visibility/occlusion_map.hpp"

namespace pvsfarm {

class OccluderScreen {
 public:
  void clear();
  void add(const Box& local_box);  // of the occluder, ground extension included
  std::size_t size() const { return lo_[0].size(); }

  // One that may cover pixels, all of them in `pixels`, at `depth` or deeper.
  struct Passed {
    std::uint32_t index;
    float depth;
    PixelRange pixels;
  };
  // Of the occluders added from `from` on, those that may cover a pixel, in order: a superset of
  // those for which make_pieces and project give something. Valid until the next call.
  std::span<const Passed> pass(const ProjectionPlane& plane, double near_m, std::size_t from);

 private:
  std::array<std::vector<double>, 3> lo_, hi_;
  std::vector<Passed> passed_;
};

}  // namespace pvsfarm
