// Hoops: closed lines that are seen convex from a whole cell, the shadow of what they span, and the
// octree in which shadows are joined.
//
// Source: Brunet 2001 as cited by Rios 2002, 4 (algorithms 2 and 3, tables 1 and 2); theory D,
// I 28 and 29. As printed the shadow lacks the plane behind the surface, and both tables colour
// nodes black that were found outside before.
#pragma once

#include <span>
#include <vector>

#include "tests/adversarial/reference/integer_geometry.hpp"

namespace pvsfarm::reference {

using Loop = std::vector<IntPoint>;  // counter-clockwise seen from the cell

// The points x with orientation(p, q, r, x) > 0.
struct HalfSpace {
  IntPoint p, q, r;
};
enum class Place { kOutside, kTraversed, kInside };
// kInside: all of the closed box; kOutside: none of it.
Place place(const IntBox& box, const HalfSpace& half_space);

// As ShieldTester's paper recalls it: every corner is a left turn from all of the cell. Accepts
// loops that wind twice.
bool turns_left(const IntBox& cell, const Loop& loop);
// Every other corner lies left of every edge, from all of the cell.
bool seen_convex(const IntBox& cell, const Loop& loop);

enum class Rear {
  kOpen,    // as printed: only planes through an edge of the loop and a corner of the cell
  kClosed,  // and the plane z = the farthest of the surface
};
// The half-spaces whose common part is the shadow. The surface and the loop lie beyond the cell
// along z, up to `farthest_z`. Requires: seen_convex.
std::vector<HalfSpace> shadow(const IntBox& cell, const Loop& loop, std::int64_t farthest_z,
                              Rear rear);

// An octree of integer boxes, coloured by shadows. Requires: the root is a cube of side 2^k, k at
// least the depth.
class ShadowOctree {
 public:
  enum class Colour { kUndetermined, kWhite, kInside, kBlack, kGrey };

  ShadowOctree(const IntBox& root, int depth, Colour colour);

  void update_first(const HalfSpace& plane) { update_first(0, plane); }    // algorithm 2, table 1
  void update_second(const HalfSpace& plane) { update_second(0, plane); }  // algorithm 3, table 2
  // The corrected form (theory D.3): all half-spaces of one hoop in one traversal.
  void add_shadow(const std::vector<HalfSpace>& half_spaces) { add_shadow(0, half_spaces); }

  // Leaves in the shadow; as in the paper, kInside counts as kBlack.
  std::vector<IntBox> black() const;

 private:
  struct Node {
    IntBox box;
    Colour colour;
    int depth_left;
    int children = -1;  // the first of eight
  };
  void split(int node, Colour colour);
  void update_first(int node, const HalfSpace& plane);
  void update_second(int node, const HalfSpace& plane);
  void add_shadow(int node, const std::vector<HalfSpace>& half_spaces);

  std::vector<Node> nodes_;
};

}  // namespace pvsfarm::reference
