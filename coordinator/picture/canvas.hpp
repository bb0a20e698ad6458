// A picture to paint on, anti-aliased by supersampling.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/vec.hpp"

namespace pvsfarm {

struct Color {
  std::uint8_t red = 0, green = 0, blue = 0;
};
constexpr Color rgb(std::uint32_t hex) {
  return {static_cast<std::uint8_t>(hex >> 16), static_cast<std::uint8_t>(hex >> 8),
          static_cast<std::uint8_t>(hex)};
}

// An upright rectangle. [px] y down.
struct Area {
  Vec2 lo{0}, hi{0};
  Vec2 size() const { return hi - lo; }
};

struct Image {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgb;  // rows from the top
};

// [px] x to the right, y down, the corner of the top left pixel is (0, 0).
class Canvas {
 public:
  Canvas(int width_px, int height_px, Color background);

  // What is painted from here on is cut to `area`.
  void clip_to(const Area& area);
  void clip_to_all();

  void fill_polygon(std::span<const Vec2> points, Color color);  // convex, either turn
  void fill_rectangle(const Area& area, Color color);
  void draw_line(const Vec2& a, const Vec2& b, double width, Color color);  // round ends
  void draw_polygon(std::span<const Vec2> points, double width, Color color);
  void draw_circle(const Vec2& center, double radius, double width, Color color);

  Image resolve() const;  // averaged in linear light

 private:
  void fill_span(int row, double x_lo, double x_hi, Color color);

  int width_px_, height_px_;
  int clip_x_lo_, clip_x_hi_, clip_y_lo_, clip_y_hi_;  // samples
  std::vector<Color> samples_;                         // kSamples x kSamples a pixel
};

}  // namespace pvsfarm
