#include "coordinator/picture/canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pvsfarm {
namespace {

constexpr int kSamples = 3;  // along a pixel's side

double linear_from_srgb(int value) {
  const double v = value / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

std::uint8_t srgb_from_linear(double v) {
  const double s = v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::clamp(s * 255 + 0.5, 0.0, 255.0));
}

// The samples whose middles lie in [lo, hi), in pixels.
int first_sample(double px) { return static_cast<int>(std::ceil(px * kSamples - 0.5)); }

// Far beyond any canvas, and safe to make an int of.
double tame(double px) { return std::clamp(px, -1e5, 1e5); }

}  // namespace

Canvas::Canvas(int width_px, int height_px, Color background)
    : width_px_(width_px),
      height_px_(height_px),
      samples_(static_cast<std::size_t>(width_px) * height_px * kSamples * kSamples, background) {
  clip_to_all();
}

void Canvas::clip_to(const Area& area) {
  clip_x_lo_ = std::max(0, first_sample(tame(area.lo.x)));
  clip_y_lo_ = std::max(0, first_sample(tame(area.lo.y)));
  clip_x_hi_ = std::min(width_px_ * kSamples, first_sample(tame(area.hi.x)));
  clip_y_hi_ = std::min(height_px_ * kSamples, first_sample(tame(area.hi.y)));
}

void Canvas::clip_to_all() {
  clip_to({{0, 0}, {static_cast<double>(width_px_), static_cast<double>(height_px_)}});
}

void Canvas::fill_span(int row, double x_lo, double x_hi, Color color) {
  const int first = std::max(clip_x_lo_, first_sample(tame(x_lo)));
  const int last = std::min(clip_x_hi_, first_sample(tame(x_hi)));
  if (first >= last) return;
  const auto begin = samples_.begin() + static_cast<std::ptrdiff_t>(row) * width_px_ * kSamples;
  std::fill(begin + first, begin + last, color);
}

void Canvas::fill_polygon(std::span<const Vec2> points, Color color) {
  double top = points[0].y, bottom = points[0].y;
  for (const Vec2& p : points) top = std::min(top, p.y), bottom = std::max(bottom, p.y);
  const int first = std::max(clip_y_lo_, first_sample(tame(top)));
  const int last = std::min(clip_y_hi_, first_sample(tame(bottom)));
  for (int row = first; row < last; ++row) {
    const double y = (row + 0.5) / kSamples;
    double x_lo = 1e300, x_hi = -1e300;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec2 &a = points[i], &b = points[(i + 1) % points.size()];
      if ((a.y <= y) == (b.y <= y)) continue;
      const double x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
      x_lo = std::min(x_lo, x), x_hi = std::max(x_hi, x);
    }
    if (x_lo < x_hi) fill_span(row, x_lo, x_hi, color);
  }
}

void Canvas::fill_rectangle(const Area& area, Color color) {
  fill_polygon(std::array{area.lo, Vec2{area.hi.x, area.lo.y}, area.hi, Vec2{area.lo.x, area.hi.y}},
               color);
}

void Canvas::draw_line(const Vec2& a, const Vec2& b, double width, Color color) {
  const double radius = width / 2;
  const Vec2 along = b - a;
  const double squared = dot(along, along);
  const int first = std::max(clip_y_lo_, first_sample(tame(std::min(a.y, b.y) - radius)));
  const int last = std::min(clip_y_hi_, first_sample(tame(std::max(a.y, b.y) + radius)));
  const int x_first = std::max(clip_x_lo_, first_sample(tame(std::min(a.x, b.x) - radius)));
  const int x_last = std::min(clip_x_hi_, first_sample(tame(std::max(a.x, b.x) + radius)));
  for (int row = first; row < last; ++row)
    for (int column = x_first; column < x_last; ++column) {
      const Vec2 p{(column + 0.5) / kSamples, (row + 0.5) / kSamples};
      const double t = squared > 0 ? std::clamp(dot(p - a, along) / squared, 0.0, 1.0) : 0;
      const Vec2 off = p - a - along * t;
      if (dot(off, off) <= radius * radius)
        samples_[static_cast<std::size_t>(row) * width_px_ * kSamples + column] = color;
    }
}

void Canvas::draw_polygon(std::span<const Vec2> points, double width, Color color) {
  for (std::size_t i = 0; i < points.size(); ++i)
    draw_line(points[i], points[(i + 1) % points.size()], width, color);
}

void Canvas::draw_circle(const Vec2& center, double radius, double width, Color color) {
  constexpr int kCorners = 48;
  Vec2 last = center + Vec2{radius, 0};
  for (int i = 1; i <= kCorners; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kCorners;
    const Vec2 next = center + Vec2{std::cos(angle), std::sin(angle)} * radius;
    draw_line(last, next, width, color);
    last = next;
  }
}

Image Canvas::resolve() const {
  std::array<double, 256> linear;
  for (int v = 0; v < 256; ++v) linear[v] = linear_from_srgb(v) / (kSamples * kSamples);
  Image image{width_px_, height_px_, {}};
  image.rgb.reserve(static_cast<std::size_t>(width_px_) * height_px_ * 3);
  for (int y = 0; y < height_px_; ++y)
    for (int x = 0; x < width_px_; ++x) {
      double red = 0, green = 0, blue = 0;
      for (int row = y * kSamples; row < (y + 1) * kSamples; ++row)
        for (int column = x * kSamples; column < (x + 1) * kSamples; ++column) {
          const Color c = samples_[static_cast<std::size_t>(row) * width_px_ * kSamples + column];
          red += linear[c.red], green += linear[c.green], blue += linear[c.blue];
        }
      for (const double v : {red, green, blue}) image.rgb.push_back(srgb_from_linear(v));
    }
  return image;
}

}  // namespace pvsfarm
