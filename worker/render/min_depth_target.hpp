// Draws convex polygons of constant depth with OSMesa, one batched draw at a time, and reads back
// the least depth at every pixel.
//
// Depth is kept in a 32-bit float colour target under MIN blending: exact for any float, where a
// depth buffer would need a mapping to [0, 1].
#pragma once

#include <memory>
#include <span>
#include <vector>

namespace pvsfarm {

// [pixels] of the window, origin lower left; pixel (i, j) has its centre at (i + 0.5, j + 0.5).
struct WindowVertex {
  float x, y, depth;
};

class MinDepthTarget {
 public:
  // A square target with an OpenGL context of its own, which every draw makes current: several may
  // live in a process. See OsmesaContext for threads.
  explicit MinDepthTarget(int side_px);
  ~MinDepthTarget();

  // Draws triangles (three vertices each; the pixels whose centres they hold) and returns the least
  // depth a pixel, row by row from the bottom, infinity where nothing was drawn. The view is valid
  // until the next draw.
  std::span<const float> draw(std::span<const WindowVertex> triangles);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm
