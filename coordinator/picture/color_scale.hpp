// From numbers to colours, and the round numbers to mark along a scale.
#pragma once

#include <string>
#include <vector>

#include "coordinator/picture/canvas.hpp"

namespace pvsfarm {

// Pale green for 0 to deep blue for 1, its lightness falling evenly (the anchors are ColorBrewer's
// sequential GnBu).
Color scale_color(double t);

// Round numbers (1, 2 or 5 times a power of ten apart) within [lo, hi], at most `most` of them.
std::vector<double> round_marks(double lo, double hi, int most);
// The largest such number not above `limit`.
double round_below(double limit);
// "1,234", "0.5": a number as people read it.
std::string plain_number(double value);

}  // namespace pvsfarm
