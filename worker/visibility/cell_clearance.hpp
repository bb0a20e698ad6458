// How the triangles of surfaces lie to a cell: whether an eye may be on one, on which side of one
// the cell is, whether the near clip may take one away.
//
// Threads: functions of what they are given.
#pragma once

#include <cstdint>

#include "common/cells/cell.hpp"
#include "worker/visibility/cell_frame.hpp"

namespace pvsfarm {

// A triangle of the scene as a cell's frame has it.
struct CornersAtCell {
  Vec3 world[3], local[3];
};

// Whether coordinates of the world are those of the cell, bit for bit. CellFrame::aligned() does
// not say so: it is the frame of right_handed(cell), and that may be the cell's mirror image.
bool has_world_coordinates(const Cell& cell);

// Bit 2 a: the point is at or below the cell's low face of axis a; bit 2 a + 1: at or above the
// high one. Exact for aligned cells, else beyond doubt. Along an axis on which the cell has no
// depth "at" does not count: eyes lie in the face, and of the triangles that meet there some may go
// on above and some below them.
std::uint8_t beyond_faces(const Vec3& world, const Vec3& local, const Cell& cell,
                          const CellFrame& frame);

// On which side of the triangle's plane the inside of the cell lies: +1 in front, -1 behind, 0 on
// both, or doubt. The cell may touch the plane only where that is certain without rounding: along a
// face of an aligned cell that has some depth there.
int side_of_cell(const CornersAtCell& triangle, const Cell& cell, const CellFrame& frame);

// Whether the triangle may come nearer to the cell than near_m; never for 0.
bool near_cell(const CornersAtCell& triangle, const CellFrame& frame, double near_m);

}  // namespace pvsfarm
