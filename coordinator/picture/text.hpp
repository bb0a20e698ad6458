// Plain text on a canvas: printable ASCII in a built-in stroke font, proportional.
#pragma once

#include <string_view>

#include "coordinator/picture/canvas.hpp"

namespace pvsfarm {

enum class Align { kLeft, kMiddle, kRight };

struct TextStyle {
  double height_px = 14;  // of a capital letter
  Color color = rgb(0x20242a);
  Align align = Align::kLeft;
};

double text_width(std::string_view text, double height_px);
// `at` is on the base line: where the text begins, has its middle or ends. Anything that is not
// printable ASCII shows as '?'.
void draw_text(Canvas& canvas, const Vec2& at, std::string_view text, const TextStyle& style);

}  // namespace pvsfarm
