// ShieldTester: does one connected surface hide two convex cells from each other?
//
// Source: Navazo 2003 (walk, invade); theory C.2 (flood), C.3, I 18 and 21. As printed the method
// is unsound twice: it answers after the first component without a hole, and its perturbation
// need not enlarge the cells. `flood` is the form to build on.
#pragma once

#include "common/base/random.hpp"
#include "tests/adversarial/reference/shield_tube.hpp"

namespace pvsfarm::reference {

enum class ShieldAnswer {
  kFree,    // the one ray tried does not meet the surface
  kHidden,  // every segment between the cells meets the surface
  kUnknown,
};

// How much of the interior must be without a hole before the parity counts.
enum class Invasion {
  kUntilFirstClosedPart,  // as printed: "IF NOT Invade THEN IF parityIsOdd RETURN occluded"
  kAllParts,
};

// The published algorithm. Requires: an oriented manifold, disjoint from both cells.
// Degenerate signs: kUnknown.
ShieldAnswer walk_and_invade(const TriangleMesh& mesh, const Corners& a, const Corners& b,
                             Invasion invasion);

// Parity of a set of triangles that has no border where the cells' hull is (theory C.2).
// Requires: nothing of the mesh; triangles that touch a cell make the part they belong to useless.
ShieldAnswer flood(const TriangleMesh& mesh, const IntBox& a, const IntBox& b, Random& random);

// The published remedy for degenerate signs: every corner moved "outside". `moves` are the
// caller's. kChecked accepts only moves after which the cells still hold the old ones (theory C.4),
// else kUnknown.
enum class Perturbation { kAsPrinted, kChecked };
struct CellMoves {
  Corners a, b;  // added to the corners
};
ShieldAnswer walk_perturbed(const TriangleMesh& mesh, const IntBox& a, const IntBox& b,
                            const CellMoves& moves, Perturbation perturbation);

}  // namespace pvsfarm::reference
