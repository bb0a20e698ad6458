// The map of a top view: objects and cells of one window of the scene, painted into one panel.
#pragma once

#include <vector>

#include "coordinator/picture/canvas.hpp"
#include "coordinator/picture/top_view.hpp"

namespace pvsfarm {

// The colours of the map, for its legend.
inline constexpr Color kVisibleColor = rgb(0xf0622d), kVisibleEdge = rgb(0xa93c10);
inline constexpr Color kCulledColor = rgb(0xd9dce1), kCulledEdge = rgb(0xbcc1c9);
inline constexpr Color kPlainColor = rgb(0xc3c8d0), kPlainEdge = rgb(0x9aa1ac);
inline constexpr Color kInkColor = rgb(0x20242a), kFaintInkColor = rgb(0x6b7280);

// The rectangle of the scene, seen from above, that a panel shows. Scene units, y up.
struct Window {
  Vec2 lo{0}, hi{0};
  Vec2 size() const { return hi - lo; }
};

class MapPainter {
 public:
  explicit MapPainter(const TopView& view);

  // What holds all objects and cells, and a little border.
  const Window& whole() const { return whole_; }
  // The surroundings of the chosen cell that hold most of what it sees; equal to whole() where that
  // is not much less, or where no cell is chosen.
  Window surroundings() const;
  double lowest() const { return lowest_; }  // of the cells' values
  double highest() const { return highest_; }

  // Fills `panel` with `window`, which is widened to the panel's shape; `line_px` is the width of
  // the finest lines. Returns pixels a scene unit.
  double paint(Canvas& canvas, const Area& panel, Window window, double line_px) const;
  // Where `window` lies in a panel painted with paint(..., of).
  static Area place(const Area& panel, Window of, const Window& window);

 private:
  struct Item {
    double area = 0;
    std::size_t index = 0;
    bool is_cell = false;
    bool is_ground = false;  // walked on, or a roof over it: a backdrop
  };
  bool lies_under_cells(const Box& box) const;

  const TopView& view_;
  std::vector<Item> items_;         // in painting order
  std::vector<Vec2> cell_middles_;  // by x
  double typical_cell_area_ = 0;
  double lowest_ = 0, highest_ = 0;
  Window whole_;
};

}  // namespace pvsfarm
