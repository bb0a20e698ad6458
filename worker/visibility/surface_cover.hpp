// The pixels of an occlusion map that a chain of surface triangles covers from all of the cell.
//
// Source: docs/algorithm.md A.14. Triangles of the chain block every ray from the cell to a pixel
// if one of the rays crosses them an odd number of times and neither their border nor their section
// with the plane is met between the cell and the pixel. The map is cut into quarters down to
// pixels. In each square only what may be met there counts, and of that any choice will do, so that
// a near silhouette does not spoil the wall behind it.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "worker/visibility/occlusion_map.hpp"
#include "worker/visibility/sheet_finder.hpp"
#include "worker/visibility/surface_chain.hpp"
#include "worker/visibility/surface_shadow.hpp"

namespace pvsfarm {

// The 16 x 16 tiles of a map, row by row: where it is worth while to cover anything.
inline constexpr int kTilesPerSide = 16;
using TileMask = std::bitset<kTilesPerSide * kTilesPerSide>;

// The tiles that the box, in the local frame, may be seen through, where what is covered up to the
// plane may hide it. Only a hint: no answer rests on it.
void add_wanted(const OcclusionMap& map, const Box& local_box, TileMask& wanted);

// Threads: one object, one thread. Keeps scratch memory from map to map.
class SurfaceCover {
 public:
  // Lowers Z to the plane, or to the sheet's greatest depth if it ends before the plane, in every
  // pixel of the wanted tiles that some sheet covers, and perhaps in others. The pyramids are left
  // stale. Returns the squares looked at.
  std::uint32_t draw(const SurfaceChain& chain, const CellFrame& frame, const TileMask& wanted,
                     OcclusionMap& map);

 private:
  struct Range {
    std::size_t first, end;
  };
  struct Square {
    int level, i, j;  // 2^level pixels a side, the (i, j)th of them
  };
  using Active = SheetFinder::Active;

  void prepare(const SurfaceChain& chain, const CellFrame& frame, const ProjectionPlane& plane);
  void prepare_edges(const SurfaceChain& chain, const ProjectionPlane& plane,
                     const ShadowMaker& maker);
  void prepare_triangles(const SurfaceChain& chain, const ShadowMaker& maker);
  void visit(const Square& square, Range edges, Range triangles, OcclusionMap& map);
  bool collect(const Vec2& middle, const Vec2& half, Range triangles, const Vec3& sample,
               float& depth);
  bool some_sheet_covers(std::span<Active> active, const Vec3& sample, float& depth);
  std::optional<bool> crossing(std::uint32_t triangle, const Vec3& sample) const;

  bool is_wanted(const Square& square) const;

  const SurfaceChain* chain_ = nullptr;
  const TileMask* wanted_ = nullptr;
  int tile_level_ = 0;  // of squares as large as a tile
  Vec3 eye_{0};
  double scale_ = 0;
  std::vector<Vec3> vertices_;  // in the plane's frame
  std::vector<Shadow> edge_shadows_, section_shadows_;
  std::vector<std::int32_t> section_of_;  // of a triangle, -1: it does not come to the plane
  std::vector<float> depth_of_;           // of a triangle, the greatest, at most 0
  std::vector<std::uint32_t> edge_stack_;
  std::vector<Active> triangle_stack_;
  SheetFinder finder_;
  std::uint32_t squares_ = 0;
};

}  // namespace pvsfarm
