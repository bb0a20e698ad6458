// Tears by rounding: a file's few digits put a vertex a little beside the edge it belongs on. Where
// that makes two faces of one plane overlap, the sliver of matter they both have is taken from the
// one with the long edge, and they share edges again. Where it leaves a gap, the gap stays: rays go
// through it.
#pragma once

#include "common/scene/surface_splits.hpp"

namespace pvsfarm {

// Never more matter than before. A triangle with an edge of its own loses the strip between that
// edge and vertices that lie in the triangle, exactly in its plane, and beside the edge by at most
// kTearWidth of the largest coordinate; only where others have an edge between such vertices.
// [limit] kMaxTearRounds, as a triangle loses a strip at one of its edges at a time.
void close_overlapping_tears(SheetMesh& mesh);
inline constexpr double kTearWidth = 0x1p-18;  // some steps of a float
inline constexpr int kMaxTearRounds = 3;

}  // namespace pvsfarm
