#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "common/base/file.hpp"
#include "coordinator/picture/color_scale.hpp"
#include "coordinator/picture/map_painter.hpp"
#include "coordinator/picture/sight_plan.hpp"
#include "coordinator/picture/text.hpp"
#include "coordinator/picture/top_view.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

Color pixel(const Image& image, int x, int y) {
  const std::size_t at = (static_cast<std::size_t>(y) * image.width_px + x) * 3;
  return {image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]};
}

bool operator==(const Color& a, const Color& b) {
  return a.red == b.red && a.green == b.green && a.blue == b.blue;
}

double lightness(const Color& c) { return 0.2126 * c.red + 0.7152 * c.green + 0.0722 * c.blue; }

// A street with a cell in the middle, a visible house to the north, a culled one to the south.
TopView street() {
  TopView view{.title = "A street", .subtitle = "two houses"};
  view.objects = {{{{0, 0, 0}, {100, 100, 0}}, TopViewState::kVisible},  // the ground
                  {{{10, 60, 0}, {90, 90, 10}}, TopViewState::kVisible},
                  {{{10, 10, 0}, {90, 40, 10}}, TopViewState::kCulled}};
  view.cells = {{footprint_of({{0, 45, 1.5}, {10, 55, 1.9}}), 3, false},
                {footprint_of({{45, 45, 1.5}, {55, 55, 1.9}}), 30, true}};
  return view;
}

TEST(MapPainter, shows_each_thing_in_its_colour_where_it_is_with_north_up) {
  const TopView view = street();
  const MapPainter map(view);
  Canvas canvas(200, 200, rgb(0));
  // A scene of 100 x 100 in 200 x 200 pixels: (x, y) is at pixel (2x, 200 - 2y).
  EXPECT_DOUBLE_EQ(map.paint(canvas, {{0, 0}, {200, 200}}, {{0, 0}, {100, 100}}, 1), 2);
  const Image image = canvas.resolve();
  EXPECT_TRUE(pixel(image, 100, 50) == kVisibleColor);
  EXPECT_TRUE(pixel(image, 100, 150) == kCulledColor);
  EXPECT_TRUE(pixel(image, 10, 100) == scale_color(0));   // the cell of the lowest value
  EXPECT_TRUE(pixel(image, 100, 100) == scale_color(1));  // the cell of the highest
  EXPECT_FALSE(pixel(image, 180, 100) == kVisibleColor);  // the ground is but a backdrop
  EXPECT_EQ(map.lowest(), 3);
  EXPECT_EQ(map.highest(), 30);
}

TEST(MapPainter, shows_what_is_smaller_on_top_whatever_the_order) {
  for (const bool car_first : {false, true}) {
    TopView view;
    const TopViewObject car{{{48, 48, 0}, {52, 52, 1}}, TopViewState::kVisible};
    const TopViewObject house{{{40, 40, 0}, {60, 60, 9}}, TopViewState::kCulled};
    view.objects = car_first ? std::vector{car, house} : std::vector{house, car};
    const MapPainter map(view);
    Canvas canvas(100, 100, rgb(0));
    map.paint(canvas, {{0, 0}, {100, 100}}, {{0, 0}, {100, 100}}, 0.1);
    EXPECT_TRUE(pixel(canvas.resolve(), 50, 50) == kVisibleColor);
  }
}

TEST(MapPainter, never_paints_outside_its_panel) {
  const TopView view = street();
  const MapPainter map(view);
  Canvas canvas(100, 100, rgb(0x123456));
  map.paint(canvas, {{30, 30}, {70, 70}}, {{40, 40}, {60, 60}}, 1);
  const Image image = canvas.resolve();
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x)
      if (x < 30 || y < 30 || x >= 70 || y >= 70) {
        ASSERT_TRUE(pixel(image, x, y) == rgb(0x123456)) << x << ' ' << y;
      }
}

TEST(MapPainter, shows_surroundings_that_hold_the_cell_and_stay_within_the_scene) {
  TopView view;
  view.objects = {{{{0, 0, 0}, {2000, 2000, 0}}},
                  {{{20, 20, 0}, {30, 30, 9}}, TopViewState::kVisible}};
  view.cells = {{footprint_of({{0, 0, 1.5}, {10, 10, 1.9}}), 1, true}};
  const MapPainter map(view);
  const Window around = map.surroundings(), whole = map.whole();
  EXPECT_LT(around.size().x, 0.5 * whole.size().x);
  EXPECT_GE(around.lo.x, whole.lo.x);
  EXPECT_GE(around.lo.y, whole.lo.y);
  EXPECT_LE(around.lo.x, 0);
  EXPECT_GE(around.hi.x, 30);

  view.cells[0].chosen = false;
  EXPECT_EQ(MapPainter(view).surroundings().size(), whole.size());
}

TEST(ColorScale, gets_darker_with_every_step) {
  for (int i = 0; i < 100; ++i)
    EXPECT_GT(lightness(scale_color(i / 100.0)), lightness(scale_color((i + 1) / 100.0)));
  EXPECT_TRUE(scale_color(-1) == scale_color(0));
  EXPECT_TRUE(scale_color(2) == scale_color(1));
}

TEST(ColorScale, marks_round_numbers_within_the_range) {
  EXPECT_EQ(round_marks(3, 41, 5), (std::vector<double>{10, 20, 30, 40}));
  EXPECT_EQ(round_marks(7, 7, 5), (std::vector<double>{7}));
  for (const double hi : {0.37, 1.0, 9.0, 1234.0, 5e7}) {
    const auto marks = round_marks(0, hi, 6);
    EXPECT_LE(marks.size(), 6u);
    EXPECT_GE(marks.size(), 2u);
    EXPECT_LE(marks.back(), hi);
  }
}

TEST(ColorScale, writes_numbers_as_people_read_them) {
  EXPECT_EQ(plain_number(0), "0");
  EXPECT_EQ(plain_number(999), "999");
  EXPECT_EQ(plain_number(1234567), "1,234,567");
  EXPECT_EQ(plain_number(-1000), "-1,000");
  EXPECT_EQ(plain_number(-100), "-100");
  EXPECT_EQ(plain_number(0.25), "0.25");
}

TEST(Text, of_every_printable_character_leaves_ink_of_its_own) {
  std::vector<std::vector<std::uint8_t>> seen;
  for (char c = '!'; c <= '~'; ++c) {
    Canvas canvas(40, 40, rgb(0xffffff));
    draw_text(canvas, {20, 25}, std::string(1, c),
              {.height_px = 14, .color = rgb(0), .align = Align::kMiddle});
    const Image image = canvas.resolve();
    EXPECT_LT(*std::min_element(image.rgb.begin(), image.rgb.end()), 100) << c;
    if (c == 'O') continue;  // as in many a font, like a zero
    EXPECT_EQ(std::find(seen.begin(), seen.end(), image.rgb), seen.end()) << c;
    seen.push_back(image.rgb);
  }
}

TEST(Text, is_as_wide_as_it_says) {
  const std::string text = "visible 0123";
  const double width = text_width(text, 14);
  Canvas canvas(300, 40, rgb(0xffffff));
  draw_text(canvas, {250, 25}, text, {.height_px = 14, .color = rgb(0), .align = Align::kRight});
  const Image image = canvas.resolve();
  int first = 300, last = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 300; ++x)
      if (!(pixel(image, x, y) == rgb(0xffffff)))
        first = std::min(first, x), last = std::max(last, x);
  EXPECT_NEAR(last + 1, 250, 2);
  EXPECT_NEAR(first, 250 - width, 2);
}

class TopViewFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "pvsfarm-picture-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }
  std::string bytes(const char* name) const { return read_file(path(name)).value(); }
  fs::path folder_;
};

TEST_F(TopViewFile, is_a_png_of_the_width_asked_for_and_the_same_every_time) {
  TopView view = street();
  view.width_px = 500;
  ASSERT_TRUE(render_top_view(view, (folder_ / "a.png").string()).ok());
  ASSERT_TRUE(render_top_view(view, (folder_ / "b.png").string()).ok());
  const std::string png = read_file((folder_ / "a.png").string()).value();
  EXPECT_EQ(png, read_file((folder_ / "b.png").string()).value());
  ASSERT_GT(png.size(), 1000u);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(12, 8), std::string("IHDR\0\0\x01\xf4", 8));  // 500
}

TEST_F(TopViewFile, of_cells_alone_or_objects_alone_is_drawn) {
  TopView cells = street(), objects = street();
  cells.objects.clear();
  objects.cells.clear();
  cells.width_px = objects.width_px = 400;
  EXPECT_TRUE(render_top_view(cells, (folder_ / "cells.png").string()).ok());
  EXPECT_TRUE(render_top_view(objects, (folder_ / "objects.png").string()).ok());
}

TEST_F(TopViewFile, of_an_explanation_is_a_png_and_the_same_every_time) {
  SightPlan plan{.title = "why",
                 .surroundings = {{{0, 0, 0}, {100, 100, 0}}, {{20, 40, 0}, {30, 60, 9}}},
                 .cells = {footprint_of(Box{{0, 45, 1}, {5, 55, 2}})},
                 .object = {{60, 45, 0}, {70, 55, 5}},
                 .object_name = "house",
                 .hidden = true,
                 .blockers = {{{{{20, 40, 0}, {30, 60, 9}}}, "wall"}},
                 .planes = {{Vec2{35, 42}, Vec2{35, 58}, Vec2{35, 58}, Vec2{35, 42}}},
                 .width_px = 500};
  ASSERT_TRUE(render_sight_plan(plan, path("a.png")));
  ASSERT_TRUE(render_sight_plan(plan, path("b.png")));
  EXPECT_EQ(bytes("a.png"), bytes("b.png"));
  plan.hidden = false;
  plan.lines = {{{5, 50}, {60, 50}}};
  plan.passed = {{{30, 50}, "wall"}};
  ASSERT_TRUE(render_sight_plan(plan, path("c.png")));
  EXPECT_NE(bytes("a.png"), bytes("c.png"));
}

TEST_F(TopViewFile, that_cannot_be_written_is_an_io_error_that_names_it) {
  const std::string path = (folder_ / "none" / "a.png").string();
  const Status status = render_top_view(street(), path);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kIo);
  EXPECT_NE(status.error().text.find(path), std::string::npos);
}

}  // namespace
}  // namespace pvsfarm
