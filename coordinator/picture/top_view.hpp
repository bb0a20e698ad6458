// A picture of a bake seen from above: the objects as footprints, the cells coloured by the size of
// their visible set, and, for one chosen cell, what it sees in one strong colour.
// The only include of libpng is in this folder (png_file.cpp).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/cells/cell.hpp"
#include "common/geometry/box.hpp"

namespace pvsfarm {

// What the picture says of an object. kPlain is for pictures without a chosen cell.
enum class TopViewState : std::uint8_t { kPlain, kVisible, kCulled };

struct TopViewObject {
  Box box;
  TopViewState state = TopViewState::kPlain;
};

struct TopViewCell {
  std::array<Vec2, 4> footprint;  // convex, in order around it
  double value = 0;               // what its colour shows, such as the size of its visible set
  bool chosen = false;            // outlined
};

struct TopView {
  std::string title;     // one line, large: name and headline figures
  std::string subtitle;  // one line below it, or ""; ASCII, as all text here
  std::string value_label = "visible objects of a cell";  // below the colour scale
  std::vector<TopViewObject> objects;
  std::vector<TopViewCell> cells;
  int width_px = 1600;  // [limit] 400 to 4000; the height follows from the scene
};

std::array<Vec2, 4> footprint_of(const Box& box);
std::array<Vec2, 4> footprint_of(const Cell& cell);  // that of its bounds, if it is not upright

// Draws `view` and writes it as a PNG, whole or not at all. The same view gives the same bytes.
// Everything is painted in order of footprint area, the largest first, so that a car lies on its
// street and a street's cell on the ground. With a chosen cell in a scene much larger than the
// street it stands in, a second panel shows its surroundings enlarged.
// Errors: kIo. Requires: at least one object or cell, finite coordinates.
Status render_top_view(const TopView& view, const std::string& path);

}  // namespace pvsfarm
