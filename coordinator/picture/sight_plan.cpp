// Layout: a title; the plan; a legend of what is in it.
#include "coordinator/picture/sight_plan.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/check.hpp"
#include "coordinator/picture/color_scale.hpp"
#include "coordinator/picture/map_painter.hpp"
#include "coordinator/picture/png_file.hpp"
#include "coordinator/picture/text.hpp"

namespace pvsfarm {
namespace {

constexpr Color kPage = rgb(0xfafaf8), kFrame = rgb(0xc9cdd3), kWhite = rgb(0xffffff);
constexpr Color kBlockerColor = rgb(0x4a6fa5), kBlockerEdge = rgb(0x27426b);
constexpr Color kHiddenColor = rgb(0x8a8f98), kHiddenEdge = rgb(0x4b5058);
constexpr Color kCellColor = rgb(0xbfe5c8), kPlaneColor = rgb(0xb03a8c);
constexpr Color kLineColor = rgb(0x1b7f3b), kHullColor = rgb(0x6b7280);

double turn(const Vec2& o, const Vec2& a, const Vec2& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

// Andrew's monotone chain.
std::vector<Vec2> hull_of(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const Vec2& a, const Vec2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Vec2& p : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// All that is named, for the window; of a blocker only what reaches into it matters.
Window window_of(const SightPlan& plan) {
  Box all;
  const auto add = [&](const Vec2& p) { all.add(Vec3{p.x, p.y, 0}); };
  for (const auto& cell : plan.cells)
    for (const Vec2& p : cell) add(p);
  for (const Vec2& p : footprint_of(plan.object)) add(p);
  for (const auto& line : plan.lines) add(line.eye), add(line.point);
  const Vec3 core = all.size();
  const double reach = 0.25 * std::max(core.x, core.y);
  for (const auto& plane : plan.planes)
    for (const Vec2& p : plane)
      add({std::clamp(p.x, all.lo.x - reach, all.hi.x + reach),
           std::clamp(p.y, all.lo.y - reach, all.hi.y + reach)});
  const double border = 0.12 * std::max({all.size().x, all.size().y, 1e-3});
  return {{all.lo.x - border, all.lo.y - border}, {all.hi.x + border, all.hi.y + border}};
}

class Painter {
 public:
  explicit Painter(const SightPlan& plan);
  Image paint();

 private:
  Vec2 place(const Vec2& p) const { return MapPainter::place(panel_, window_, {p, p}).lo; }
  std::vector<Vec2> place(std::span<const Vec2> points) const;
  void fill(std::span<const Vec2> points, Color color, Color edge, double width);
  bool label(const Vec2& at, const std::string& text, Color color);
  bool label(const Box& box, const std::string& text, Color color);
  void label(const SightPlan::Blocker& blocker);
  void paint_plan();
  void paint_labels();
  void paint_legend();
  void heading(double base_line, const std::string& text, TextStyle style);

  const SightPlan& plan_;
  TopView backdrop_;
  Window window_;
  double unit_, margin_;
  Area panel_;
  double legend_top_;
  Canvas canvas_;
  double px_per_m_ = 1;
  std::vector<Area> labels_;  // taken
};

// Floors and grounds would hide what stands on them.
bool is_level(const Box& box) {
  constexpr double kLevel = 0.02;
  return box.size().z < kLevel * std::min(box.size().x, box.size().y);
}

TopView backdrop_of(const SightPlan& plan) {
  TopView view;
  for (const Box& box : plan.surroundings)
    if (!box.empty() && !is_level(box)) view.objects.push_back({box, TopViewState::kCulled});
  for (const auto& cell : plan.cells) view.cells.push_back({.footprint = cell});
  return view;
}

int clamped_width(const SightPlan& plan) { return std::clamp(plan.width_px, 400, 4000); }

Area panel_of(const SightPlan& plan, const Window& window) {
  const double unit = clamped_width(plan) / 1600.0, margin = 40 * unit;
  const double top = margin + (plan.subtitle.empty() ? 52 : 86) * unit;
  const double width = clamped_width(plan) - 2 * margin;
  const double shape = std::clamp(window.size().y / window.size().x, 0.4, 0.8);
  return {{margin, top}, {margin + width, top + width * shape}};
}

Painter::Painter(const SightPlan& plan)
    : plan_(plan),
      backdrop_(backdrop_of(plan)),
      window_(window_of(plan)),
      unit_(clamped_width(plan) / 1600.0),
      margin_(40 * unit_),
      panel_(panel_of(plan, window_)),
      legend_top_(panel_.hi.y + 30 * unit_),
      canvas_(clamped_width(plan), static_cast<int>(legend_top_ + 70 * unit_ + margin_), kPage) {}

std::vector<Vec2> Painter::place(std::span<const Vec2> points) const {
  std::vector<Vec2> out;
  for (const Vec2& p : points) out.push_back(place(p));
  return out;
}

void Painter::fill(std::span<const Vec2> points, Color color, Color edge, double width) {
  const std::vector<Vec2> placed = place(points);
  canvas_.fill_polygon(placed, color);
  canvas_.draw_polygon(placed, width, edge);
}

// With a white rim, near `at`, where no other label is. False: there is no room.
bool Painter::label(const Vec2& at, const std::string& text, Color color) {
  const double height = 13 * unit_, half = text_width(text, height) / 2 + 4 * unit_;
  for (const int step : {0, 1, -1, 2, -2, 3, -3}) {
    Vec2 base = at + Vec2{0, (step * 1.7 + 0.5) * height};
    base.x = std::min(std::max(base.x, panel_.lo.x + half), panel_.hi.x - half);
    const Area area{base - Vec2{half, height * 1.2}, base + Vec2{half, height * 0.4}};
    const bool inside = panel_.lo.x <= area.lo.x && panel_.lo.y < area.lo.y &&
                        area.hi.y < panel_.hi.y && std::abs(base.x - at.x) <= half;
    const bool free = std::none_of(labels_.begin(), labels_.end(), [&](const Area& other) {
      return area.lo.x < other.hi.x && other.lo.x < area.hi.x && area.lo.y < other.hi.y &&
             other.lo.y < area.hi.y;
    });
    if (!inside || !free) continue;
    labels_.push_back(area);
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        draw_text(canvas_, base + Vec2{2.0 * dx, 2.0 * dy} * unit_, text,
                  {.height_px = height, .color = kWhite, .align = Align::kMiddle});
    draw_text(canvas_, base, text, {.height_px = height, .color = color, .align = Align::kMiddle});
    return true;
  }
  return false;
}

// In the middle of what of the box is in the window, or below it where the text is the wider.
bool Painter::label(const Box& box, const std::string& text, Color color) {
  const Vec2 lo{std::max(box.lo.x, window_.lo.x), std::max(box.lo.y, window_.lo.y)};
  const Vec2 hi{std::min(box.hi.x, window_.hi.x), std::min(box.hi.y, window_.hi.y)};
  if (!(lo.x <= hi.x && lo.y <= hi.y)) return false;
  const Area shown = MapPainter::place(panel_, window_, {lo, hi});
  const Vec2 middle = (shown.lo + shown.hi) * 0.5;
  const double height = 13 * unit_;
  const bool fits = text_width(text, height) < shown.size().x && 1.5 * height < shown.size().y;
  return label(fits ? middle : Vec2{middle.x, shown.hi.y + height}, text, color);
}

// One name for all its boxes, at the one nearest to the middle of what is between.
void Painter::label(const SightPlan::Blocker& blocker) {
  const Vec2 a = (plan_.cells[0][0] + plan_.cells[0][2]) * 0.5;
  const Vec3 b = plan_.object.center();
  const Vec2 middle = (a + Vec2{b.x, b.y}) * 0.5;
  std::vector<Box> boxes = blocker.boxes;
  const auto distance = [&](const Box& box) {
    return length(Vec2{box.center().x, box.center().y} - middle);
  };
  std::stable_sort(boxes.begin(), boxes.end(),
                   [&](const Box& x, const Box& y) { return distance(x) < distance(y); });
  for (const Box& box : boxes)
    if (label(box, blocker.label, kBlockerEdge)) return;
}

void Painter::paint_plan() {
  px_per_m_ = MapPainter(backdrop_).paint(canvas_, panel_, window_, unit_);
  canvas_.clip_to(panel_);
  for (const auto& blocker : plan_.blockers)
    for (const Box& box : blocker.boxes)
      fill(footprint_of(box), kBlockerColor, kBlockerEdge, 1.5 * unit_);
  for (const auto& cell : plan_.cells) {
    std::vector<Vec2> between(cell.begin(), cell.end());
    for (const Vec2& p : footprint_of(plan_.object)) between.push_back(p);
    canvas_.draw_polygon(place(hull_of(std::move(between))), 1.5 * unit_, kHullColor);
  }
  for (const auto& cell : plan_.cells) fill(cell, kCellColor, kInkColor, 2 * unit_);
  fill(footprint_of(plan_.object), plan_.hidden ? kHiddenColor : kVisibleColor,
       plan_.hidden ? kHiddenEdge : kVisibleEdge, 2 * unit_);
  for (const auto& plane : plan_.planes)
    canvas_.draw_polygon(place(plane), 3.5 * unit_, kPlaneColor);
  for (const auto& line : plan_.lines) {
    canvas_.draw_line(place(line.eye), place(line.point), 3 * unit_, kLineColor);
    canvas_.draw_circle(place(line.eye), 5 * unit_, 3 * unit_, kLineColor);
  }
  for (const auto& mark : plan_.passed)
    canvas_.draw_circle(place(mark.at), 6 * unit_, 2 * unit_, kInkColor);
}

void Painter::paint_labels() {
  label(plan_.object, plan_.object_name, plan_.hidden ? kHiddenEdge : kVisibleEdge);
  for (const auto& cell : plan_.cells)
    label(place((cell[0] + cell[1] + cell[2] + cell[3]) * 0.25), "cell", kInkColor);
  for (const auto& blocker : plan_.blockers) label(blocker);
  for (const auto& mark : plan_.passed)
    label(place(mark.at) - Vec2{0, 14 * unit_}, mark.label, kInkColor);
}

void Painter::paint_legend() {
  const double size = 12 * unit_;
  Vec2 at{margin_, legend_top_};
  const auto entry = [&](const char* text, auto&& draw) {
    draw(at + Vec2{0, 8} * unit_);
    draw_text(canvas_, at + Vec2{34, 13} * unit_, text, {.height_px = size, .color = kInkColor});
    at.x += 34 * unit_ + text_width(text, size) + 34 * unit_;
  };
  const auto swatch = [&](Color color, Color edge) {
    return [this, color, edge](const Vec2& left) {
      const Area area{left + Vec2{4, -8} * unit_, left + Vec2{24, 8} * unit_};
      const std::array<Vec2, 4> corners{area.lo, Vec2{area.hi.x, area.lo.y}, area.hi,
                                        Vec2{area.lo.x, area.hi.y}};
      canvas_.fill_rectangle(area, color);
      canvas_.draw_polygon(corners, 1.5 * unit_, edge);
    };
  };
  const auto stroke = [&](Color color, double width) {
    return [this, color, width](const Vec2& left) {
      canvas_.draw_line(left, left + Vec2{26 * unit_, 0}, width * unit_, color);
    };
  };
  entry("the cell", swatch(kCellColor, kInkColor));
  if (plan_.hidden)
    entry("the object, hidden", swatch(kHiddenColor, kHiddenEdge));
  else
    entry("the object", swatch(kVisibleColor, kVisibleEdge));
  if (!plan_.blockers.empty()) entry("what covers it", swatch(kBlockerColor, kBlockerEdge));
  if (!plan_.planes.empty()) entry("its views on a plane", stroke(kPlaneColor, 3.5));
  if (!plan_.lines.empty()) entry("a line of sight", stroke(kLineColor, 3));
  if (!plan_.passed.empty())
    entry("passes by", [this](const Vec2& left) {
      canvas_.draw_circle(left + Vec2{14 * unit_, 0}, 6 * unit_, 2 * unit_, kInkColor);
    });
  entry("all between cell and object", stroke(kHullColor, 1.5));

  const double bar_m = round_below(panel_.size().x * 0.15 / px_per_m_);
  const Vec2 b{panel_.hi.x, legend_top_ + 46 * unit_}, a = b - Vec2{bar_m * px_per_m_, 0};
  canvas_.draw_line(a, b, 2 * unit_, kInkColor);
  for (const Vec2& end : {a, b})
    canvas_.draw_line(end - Vec2{0, 5 * unit_}, end + Vec2{0, 5 * unit_}, 2 * unit_, kInkColor);
  draw_text(canvas_, {a.x - 10 * unit_, b.y + 5 * unit_}, plain_number(bar_m) + " m",
            {.height_px = size, .color = kInkColor, .align = Align::kRight});
}

void Painter::heading(double base_line, const std::string& text, TextStyle style) {
  const double room = panel_.size().x;
  style.height_px *= std::min(1.0, room / std::max(1.0, text_width(text, style.height_px)));
  draw_text(canvas_, {margin_, base_line}, text, style);
}

Image Painter::paint() {
  heading(margin_ + 24 * unit_, plan_.title, {.height_px = 22 * unit_, .color = kInkColor});
  heading(margin_ + 58 * unit_, plan_.subtitle, {.height_px = 13 * unit_, .color = kFaintInkColor});
  paint_plan();
  paint_labels();
  canvas_.clip_to_all();
  const std::array<Vec2, 4> corners{panel_.lo, Vec2{panel_.hi.x, panel_.lo.y}, panel_.hi,
                                    Vec2{panel_.lo.x, panel_.hi.y}};
  canvas_.draw_polygon(corners, 1.5 * unit_, kFrame);
  paint_legend();
  return canvas_.resolve();
}

}  // namespace

Status render_sight_plan(const SightPlan& plan, const std::string& path) {
  PVS_CHECK(!plan.cells.empty());
  return write_png(Painter(plan).paint(), path);
}

}  // namespace pvsfarm
