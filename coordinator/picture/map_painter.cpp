#include "coordinator/picture/map_painter.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/check.hpp"
#include "coordinator/picture/color_scale.hpp"

namespace pvsfarm {
namespace {

constexpr Color kBackground = rgb(0xffffff);
constexpr Color kGroundColor = rgb(0xf1f2f4), kVisibleGroundColor = rgb(0xfdeadd);

Vec2 middle_of(const TopViewCell& cell) {
  Vec2 sum{0};
  for (const Vec2& p : cell.footprint) sum += p;
  return sum / 4.0;
}

double area_of(const std::array<Vec2, 4>& quad) {
  double twice = 0;
  for (int i = 0; i < 4; ++i) {
    const Vec2 &a = quad[i], &b = quad[(i + 1) % 4];
    twice += a.x * b.y - a.y * b.x;
  }
  return std::abs(twice) / 2;
}

double area_of(const Box& box) { return box.size().x * box.size().y; }

// Maps the scene to a panel: uniform scale, y turned over, the window in the middle.
struct Placement {
  Vec2 window_middle{0}, panel_middle{0};
  double scale = 1;
  Vec2 operator()(const Vec2& p) const {
    const Vec2 d = (p - window_middle) * scale;
    return panel_middle + Vec2{d.x, -d.y};
  }
};

Placement placement_of(const Area& panel, const Window& window) {
  return {(window.lo + window.hi) * 0.5, (panel.lo + panel.hi) * 0.5,
          std::min(panel.size().x / window.size().x, panel.size().y / window.size().y)};
}

struct Style {
  Color fill, edge;
};
Style style_of(TopViewState state) {
  switch (state) {
    case TopViewState::kVisible:
      return {kVisibleColor, kVisibleEdge};
    case TopViewState::kCulled:
      return {kCulledColor, kCulledEdge};
    case TopViewState::kPlain:
      break;
  }
  return {kPlainColor, kPlainEdge};
}

}  // namespace

std::array<Vec2, 4> footprint_of(const Box& box) {
  return {Vec2{box.lo.x, box.lo.y}, Vec2{box.hi.x, box.lo.y}, Vec2{box.hi.x, box.hi.y},
          Vec2{box.lo.x, box.hi.y}};
}

std::array<Vec2, 4> footprint_of(const Cell& cell) {
  const bool upright =
      std::abs(cell.axes[2].x) < kAxisTolerance && std::abs(cell.axes[2].y) < kAxisTolerance;
  if (!upright) return footprint_of(cell.bounds());
  std::array<Vec2, 4> footprint;
  const int around[4] = {0, 1, 3, 2};
  for (int i = 0; i < 4; ++i) {
    const Vec3 corner = cell.corner(around[i]);
    footprint[i] = {corner.x, corner.y};
  }
  return footprint;
}

MapPainter::MapPainter(const TopView& view) : view_(view) {
  PVS_CHECK(!view.objects.empty() || !view.cells.empty());
  Box all;
  std::vector<double> areas;
  lowest_ = view.cells.empty() ? 0 : view.cells[0].value;
  highest_ = lowest_;
  for (const TopViewCell& cell : view.cells) {
    for (const Vec2& p : cell.footprint) all.add({p.x, p.y, 0});
    areas.push_back(area_of(cell.footprint));
    cell_middles_.push_back(middle_of(cell));
    lowest_ = std::min(lowest_, cell.value), highest_ = std::max(highest_, cell.value);
  }
  std::sort(cell_middles_.begin(), cell_middles_.end(),
            [](const Vec2& a, const Vec2& b) { return a.x < b.x; });
  if (!areas.empty()) {
    std::nth_element(areas.begin(), areas.begin() + areas.size() / 2, areas.end());
    typical_cell_area_ = areas[areas.size() / 2];
  }
  for (const TopViewObject& object : view.objects) all.add(object.box);
  const double border = 0.02 * std::max({all.size().x, all.size().y, 1e-6});
  whole_ = {{all.lo.x - border, all.lo.y - border}, {all.hi.x + border, all.hi.y + border}};

  for (std::size_t i = 0; i < view.objects.size(); ++i) {
    const Box& box = view.objects[i].box;
    items_.push_back({area_of(box), i, false, lies_under_cells(box)});
  }
  for (std::size_t i = 0; i < view.cells.size(); ++i)
    items_.push_back({area_of(view.cells[i].footprint), i, true, false});
  std::stable_sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) {
    if (a.is_ground != b.is_ground) return a.is_ground;
    return a.area > b.area;
  });
}

// Cells lie beside buildings and furniture, but on grounds, floors and terrain, and below ceilings:
// what is level, or what is low for its extent and covered by cells to a good part. (A building
// that stands askew has cells in its box as well.)
bool MapPainter::lies_under_cells(const Box& box) const {
  constexpr double kLevel = 0.02, kLow = 0.35, kCoveredShare = 0.08;
  if (area_of(box) < 3 * typical_cell_area_) return false;
  const double shape = box.size().z / std::min(box.size().x, box.size().y);
  if (shape > kLow) return false;
  double covered = 0;
  const auto by_x = [](const Vec2& p, double x) { return p.x < x; };
  for (auto at = std::lower_bound(cell_middles_.begin(), cell_middles_.end(), box.lo.x, by_x);
       at != cell_middles_.end() && at->x <= box.hi.x; ++at)
    if (box.lo.y <= at->y && at->y <= box.hi.y) covered += typical_cell_area_;
  return covered > (shape < kLevel ? 0 : kCoveredShare * area_of(box));
}

Window MapPainter::surroundings() const {
  const auto chosen = std::find_if(view_.cells.begin(), view_.cells.end(),
                                   [](const TopViewCell& cell) { return cell.chosen; });
  if (chosen == view_.cells.end()) return whole_;
  const Vec2 middle = middle_of(*chosen);
  std::vector<double> distances;
  for (const Item& item : items_) {
    if (item.is_cell || item.is_ground) continue;
    const TopViewObject& object = view_.objects[item.index];
    if (object.state != TopViewState::kVisible) continue;
    const Vec3 center = object.box.center();
    distances.push_back(std::max(std::abs(center.x - middle.x), std::abs(center.y - middle.y)));
  }
  constexpr double kMostOf = 0.8, kLeastCells = 8, kWorthwhile = 0.5;
  double half = kLeastCells * std::sqrt(typical_cell_area_);
  if (!distances.empty()) {
    const auto at = distances.begin() + static_cast<std::ptrdiff_t>(
                                            kMostOf * static_cast<double>(distances.size() - 1));
    std::nth_element(distances.begin(), at, distances.end());
    half = std::max(half, *at * 1.1);
  }
  const double extent = std::max(whole_.size().x, whole_.size().y);
  half = std::min(half, extent / 6);
  if (half < 2 * std::sqrt(typical_cell_area_) || 2 * half > kWorthwhile * extent) return whole_;
  Vec2 center = middle;  // moved so that the window stays within the scene where it can
  for (int a = 0; a < 2; ++a) {
    const double lo = whole_.lo[a] + half, hi = whole_.hi[a] - half;
    center[a] = lo <= hi ? std::clamp(middle[a], lo, hi) : (lo + hi) / 2;
  }
  return {center - Vec2{half, half}, center + Vec2{half, half}};
}

Area MapPainter::place(const Area& panel, Window of, const Window& window) {
  const Placement placement = placement_of(panel, of);
  const Vec2 a = placement(window.lo), b = placement(window.hi);
  return {{a.x, b.y}, {b.x, a.y}};
}

double MapPainter::paint(Canvas& canvas, const Area& panel, Window window, double line_px) const {
  const Placement placement = placement_of(panel, window);
  canvas.clip_to(panel);
  canvas.fill_rectangle(panel, kBackground);
  std::array<Vec2, 4> quad;
  const auto place_all = [&](const std::array<Vec2, 4>& footprint) {
    for (int i = 0; i < 4; ++i) quad[i] = placement(footprint[i]);
  };
  // Edges of all or of none, so that the map is even.
  const bool has_edges = placement.scale * std::sqrt(typical_cell_area_) > 4 * line_px;
  for (const Item& item : items_) {
    if (item.is_cell) {
      const TopViewCell& cell = view_.cells[item.index];
      const double range = highest_ - lowest_;
      place_all(cell.footprint);
      canvas.fill_polygon(quad, scale_color(range > 0 ? (cell.value - lowest_) / range : 0.5));
      continue;
    }
    const TopViewObject& object = view_.objects[item.index];
    place_all(footprint_of(object.box));
    if (item.is_ground) {
      const bool visible = object.state == TopViewState::kVisible;
      canvas.fill_polygon(quad, visible ? kVisibleGroundColor : kGroundColor);
      continue;
    }
    const Style style = style_of(object.state);
    const Vec3 size_px = object.box.size() * placement.scale;
    // A thin wall is a line, seen from however far.
    if (std::min(size_px.x, size_px.y) < line_px) {
      const bool flat = size_px.x > size_px.y;
      const Vec2 a = (quad[0] + quad[flat ? 3 : 1]) * 0.5, b = (quad[2] + quad[flat ? 1 : 3]) * 0.5;
      if (std::max(size_px.x, size_px.y) > line_px) {
        canvas.draw_line(a, b, line_px, style.fill);
        continue;
      }
    }
    canvas.fill_polygon(quad, style.fill);
    if (has_edges && std::min(size_px.x, size_px.y) > 6 * line_px)
      canvas.draw_polygon(quad, line_px, style.edge);
  }
  for (const TopViewCell& cell : view_.cells) {
    if (!cell.chosen) continue;
    place_all(cell.footprint);
    canvas.draw_polygon(quad, 2.5 * line_px, kInkColor);
    const double reach = length(quad[2] - quad[0]) / 2;
    canvas.draw_circle(placement(middle_of(cell)), std::max(9 * line_px, reach + 4 * line_px),
                       2 * line_px, kInkColor);
  }
  canvas.clip_to_all();
  return placement.scale;
}

}  // namespace pvsfarm
