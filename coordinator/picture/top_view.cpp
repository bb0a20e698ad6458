// Layout: a title; the map, or the map and the chosen cell's surroundings side by side; a legend.
#include "coordinator/picture/top_view.hpp"

#include <algorithm>
#include <cmath>

#include "coordinator/picture/color_scale.hpp"
#include "coordinator/picture/map_painter.hpp"
#include "coordinator/picture/png_file.hpp"
#include "coordinator/picture/text.hpp"

namespace pvsfarm {
namespace {

constexpr Color kPage = rgb(0xfafaf8), kFrame = rgb(0xc9cdd3);
constexpr int kLeastWidth = 400, kMostWidth = 4000;

struct Layout {
  double unit = 1;  // scales with the width, so that a wide picture has as large a text
  double margin = 0;
  double title_line = 0, subtitle_line = 0;  // base lines
  std::vector<Area> panels;
  double legend_top = 0;
  int width_px = 0, height_px = 0;
};

Layout lay_out(const TopView& view, const Vec2& extent, int panels) {
  Layout layout;
  layout.width_px = std::clamp(view.width_px, kLeastWidth, kMostWidth);
  const double unit = layout.unit = layout.width_px / 1600.0;
  layout.margin = 40 * unit;
  layout.title_line = layout.margin + 24 * unit;
  layout.subtitle_line = layout.title_line + 34 * unit;
  const double top = (view.subtitle.empty() ? layout.title_line : layout.subtitle_line) + 28 * unit;

  const double width = (layout.width_px - (panels + 1) * layout.margin) / panels;
  const double shape = std::clamp(extent.y / extent.x, 0.35, panels == 1 ? 0.8 : 1.25);
  for (int i = 0; i < panels; ++i) {
    const double left = layout.margin + i * (width + layout.margin);
    layout.panels.push_back({{left, top}, {left + width, top + width * shape}});
  }
  layout.legend_top = top + width * shape + 30 * unit;
  layout.height_px = static_cast<int>(layout.legend_top + 66 * unit + layout.margin);
  return layout;
}

void draw_frame(Canvas& canvas, const Area& area, double width, Color color) {
  const std::array<Vec2, 4> corners{area.lo, Vec2{area.hi.x, area.lo.y}, area.hi,
                                    Vec2{area.lo.x, area.hi.y}};
  canvas.draw_polygon(corners, width, color);
}

// A bar of a round length below the right end of a panel.
void draw_scale_bar(Canvas& canvas, const Area& panel, const Layout& layout, double px_per_m) {
  const double unit = layout.unit;
  const double length_m = round_below(panel.size().x * 0.2 / px_per_m);
  const Vec2 b{panel.hi.x, layout.legend_top + 6 * unit}, a = b - Vec2{length_m * px_per_m, 0};
  canvas.draw_line(a, b, 2 * unit, kInkColor);
  for (const Vec2& end : {a, b})
    canvas.draw_line(end - Vec2{0, 5 * unit}, end + Vec2{0, 5 * unit}, 2 * unit, kInkColor);
  draw_text(canvas, {b.x, b.y + 24 * unit}, plain_number(length_m) + " m",
            {.height_px = 12 * unit, .color = kInkColor, .align = Align::kRight});
}

void draw_color_scale(Canvas& canvas, const Layout& layout, const MapPainter& map,
                      const std::string& label) {
  const double unit = layout.unit, width = 440 * unit, height = 16 * unit;
  const Vec2 corner{layout.margin, layout.legend_top};
  constexpr int kSteps = 256;
  for (int i = 0; i < kSteps; ++i)
    canvas.fill_rectangle(
        {corner + Vec2{width * i / kSteps, 0}, corner + Vec2{width * (i + 1) / kSteps, height}},
        scale_color((i + 0.5) / kSteps));
  draw_frame(canvas, {corner, corner + Vec2{width, height}}, unit, kFrame);
  const double lo = map.lowest(), hi = map.highest();
  for (const double mark : round_marks(lo, hi, 6)) {
    const double x = corner.x + (hi > lo ? (mark - lo) / (hi - lo) : 0.5) * width;
    canvas.draw_line({x, corner.y + height}, {x, corner.y + height + 5 * unit}, 1.5 * unit,
                     kFaintInkColor);
    draw_text(canvas, {x, corner.y + height + 22 * unit}, plain_number(mark),
              {.height_px = 11 * unit, .color = kFaintInkColor, .align = Align::kMiddle});
  }
  draw_text(canvas, {corner.x, corner.y + height + 46 * unit}, label,
            {.height_px = 12 * unit, .color = kInkColor});
}

void draw_swatches(Canvas& canvas, const Layout& layout, const TopView& view) {
  std::array<std::size_t, 3> counts{};
  for (const TopViewObject& object : view.objects) ++counts[static_cast<int>(object.state)];
  struct Swatch {
    Color fill, edge;
    std::size_t count;
    const char* text;
  };
  const std::array<Swatch, 3> swatches{
      {{kVisibleColor, kVisibleEdge, counts[1], " visible objects"},
       {kCulledColor, kCulledEdge, counts[2], " culled objects"},
       {kPlainColor, kPlainEdge, counts[0], " objects"}}};
  const double unit = layout.unit;
  // Below the second panel, or beside the colour scale.
  const bool beside = layout.panels.size() == 1;
  Vec2 at{beside ? layout.margin + 520 * unit : layout.panels[1].lo.x, layout.legend_top};
  const bool chosen = std::any_of(view.cells.begin(), view.cells.end(),
                                  [](const TopViewCell& cell) { return cell.chosen; });
  if (chosen) {
    canvas.draw_circle(at + Vec2{8, 8} * unit, 7 * unit, 2 * unit, kInkColor);
    draw_text(canvas, at + Vec2{26, 13} * unit, "the chosen cell",
              {.height_px = 12 * unit, .color = kInkColor});
    at.y += 27 * unit;
  }
  for (const Swatch& swatch : swatches) {
    if (swatch.count == 0) continue;
    const Area box{at, at + Vec2{16, 16} * unit};
    canvas.fill_rectangle(box, swatch.fill);
    draw_frame(canvas, box, unit, swatch.edge);
    draw_text(canvas, at + Vec2{26, 13} * unit,
              plain_number(static_cast<double>(swatch.count)) + swatch.text,
              {.height_px = 12 * unit, .color = kInkColor});
    at.y += 27 * unit;
  }
}

// A line of text from the left margin, made smaller where it would not fit.
void draw_heading(Canvas& canvas, const Layout& layout, double base_line, const std::string& text,
                  TextStyle style) {
  const double room = layout.width_px - 2 * layout.margin;
  style.height_px *= std::min(1.0, room / std::max(1.0, text_width(text, style.height_px)));
  draw_text(canvas, {layout.margin, base_line}, text, style);
}

}  // namespace

Status render_top_view(const TopView& view, const std::string& path) {
  const MapPainter map(view);
  std::vector<Window> windows{map.whole()};
  const Window detail = map.surroundings();
  const bool has_detail = detail.size() != map.whole().size();
  if (has_detail) windows.push_back(detail);
  const Layout layout = lay_out(view, map.whole().size(), static_cast<int>(windows.size()));
  const double unit = layout.unit;

  Canvas canvas(layout.width_px, layout.height_px, kPage);
  draw_heading(canvas, layout, layout.title_line, view.title,
               {.height_px = 22 * unit, .color = kInkColor});
  draw_heading(canvas, layout, layout.subtitle_line, view.subtitle,
               {.height_px = 13 * unit, .color = kFaintInkColor});
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const Area& panel = layout.panels[i];
    const double px_per_m = map.paint(canvas, panel, windows[i], unit);
    if (i == 0 && has_detail) {
      canvas.clip_to(panel);
      draw_frame(canvas, MapPainter::place(panel, windows[0], detail), 1.5 * unit, kInkColor);
      canvas.clip_to_all();
    }
    draw_frame(canvas, panel, i == 0 ? 1.5 * unit : 2 * unit, i == 0 ? kFrame : kInkColor);
    draw_scale_bar(canvas, panel, layout, px_per_m);
  }
  if (!view.cells.empty()) draw_color_scale(canvas, layout, map, view.value_label);
  draw_swatches(canvas, layout, view);
  return write_png(canvas.resolve(), path);
}

}  // namespace pvsfarm
