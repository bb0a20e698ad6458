// A picture of one explanation, seen from above: a cell, an object, and between them the line that
// sees it, or the planes and blockers that hide it.
#pragma once

#include <string>
#include <vector>

#include "coordinator/picture/top_view.hpp"

namespace pvsfarm {

struct SightPlan {
  std::string title, subtitle;    // as in TopView
  std::vector<Box> surroundings;  // every object of the scene
  std::vector<std::array<Vec2, 4>> cells;
  Box object;
  std::string object_name;
  bool hidden = false;
  struct Blocker {
    std::vector<Box> boxes;  // one an owner
    std::string label;
  };
  std::vector<Blocker> blockers;
  std::vector<std::array<Vec2, 4>> planes;  // what the views touch of each; a line if upright
  struct Line {
    Vec2 eye{0}, point{0};
  };
  std::vector<Line> lines;
  struct Mark {
    Vec2 at{0};
    std::string label;
  };
  std::vector<Mark> passed;  // where a line passes by something
  int width_px = 1600;       // [limit] 400 to 4000
};

// Zooms to what is named, with the outline of all that lies between cells and object. The same
// plan gives the same bytes. Errors: kIo. Requires: a cell, finite coordinates.
Status render_sight_plan(const SightPlan& plan, const std::string& path);

}  // namespace pvsfarm
