#include "coordinator/chart/series.hpp"

#include <array>
#include <cstdio>

namespace pvsfarm {
namespace {

using Points = std::vector<SeriesPoint>;

std::string text(const char* format, double value) {
  std::array<char, 64> buffer;
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

// 30000: "3e4"
std::string count_text(double value) {
  int exponent = 0;
  for (; value >= 10; value /= 10) ++exponent;
  return text("%g", value) + "e" + std::to_string(exponent);
}

// Projections alone, nothing looked for: what varies is seen best without the rest of the cascade.
EvaluatorSettings projection_alone(const SeriesBase& base) {
  EvaluatorSettings settings = base.settings;
  settings.methods = {Method::kProjection};
  settings.gap = 0;
  return settings;
}

Points bake(const SeriesBase& base) {
  return {{"gap " + text("%g", base.settings.gap), base.settings.gap, base.settings}};
}

Points projection(const SeriesBase& base) {
  return {{"projection alone", 0, projection_alone(base)}};
}

// The bake's methods with one of them left out, or one of the others put in. Nothing stops before
// all have had their turn: what one does not settle another may, at its own price.
Points ingredients(const SeriesBase& base) {
  EvaluatorSettings all = base.settings;
  all.gap = 0;
  Points points{{kAllIngredients, 0, all}};
  for (int i = 0; i < kMethodCount; ++i) {
    const auto method = static_cast<Method>(i);
    const bool has = all.methods.has(method);
    EvaluatorSettings settings = all;
    settings.methods = Methods::from_bits(all.methods.bits() ^ Methods{method}.bits());
    points.push_back({std::string(has ? kWithout : kWith) + to_string(method),
                      static_cast<double>(points.size()), settings});
  }
  return points;
}

Points cascade(const SeriesBase& base) {
  Points points;
  for (const double gap : {0.5, 0.3, 0.2, 0.15, 0.1, 0.05, 0.02}) {
    points.push_back({"gap " + text("%g", gap), gap, base.settings});
    points.back().settings.gap = gap;
  }
  return points;
}

Points item_buffers(const SeriesBase& base) {
  Points points;
  for (const int px : {32, 128, 512}) {
    EvaluatorSettings settings = base.settings;
    settings.methods = {Method::kItemBuffers, Method::kProjection, Method::kFineProjection};
    settings.gap = 0;
    settings.item_buffer_px = px;
    points.push_back({std::to_string(px) + " px", double(px), settings});
  }
  return points;
}

Points resolution(const SeriesBase& base) {
  Points points;
  for (const int px : {64, 128, 256, 512, 1024}) {
    points.push_back({std::to_string(px) + " px", double(px), projection_alone(base)});
    points.back().settings.resolution_px = px;
  }
  return points;
}

Points planes(const SeriesBase& base) {
  Points points;
  for (const int count : {1, 2, 4, 6, 8, 12, 16}) {
    const char* noun = count == 1 ? " plane" : " planes";
    points.push_back({std::to_string(count) + noun, double(count), projection_alone(base)});
    points.back().settings.planes_per_face = count;
  }
  return points;
}

Points extent(const SeriesBase& base) {
  Points points;
  for (const double value : {0.7, 0.9, 1.1, 1.3, 1.6, 2.0}) {
    points.push_back({"extent " + text("%g", value), value, projection_alone(base)});
    points.back().settings.extent = value;
  }
  return points;
}

Points raster(const SeriesBase& base) {
  Points points;
  for (const RasterKind kind : {RasterKind::kDirect, RasterKind::kOsmesa}) {
    points.push_back({to_string(kind), double(points.size()), projection_alone(base)});
    points.back().settings.raster = kind;
    points.back().settings.resolution_px = 256;
  }
  return points;
}

// What a sweep settles: alone, and after Projections.
Points sweep(const SeriesBase& base) {
  EvaluatorSettings alone = base.settings, after = base.settings;
  alone.methods = {Method::kSweep};
  after.methods = {Method::kProjection, Method::kFineProjection, Method::kSweep};
  alone.gap = after.gap = 0;
  return {{"sweep alone", 0, alone}, {"sweep after Projections", 1, after}};
}

// What the sections of solids settle: alone, and after Projections.
Points slices(const SeriesBase& base) {
  EvaluatorSettings alone = base.settings, before = projection_alone(base), after = before;
  alone.methods = {Method::kSlices};
  after.methods = {Method::kProjection, Method::kSlices};
  alone.gap = 0;
  return {{"slices alone", 0, alone},
          {"Projections alone", 1, before},
          {"slices after Projections", 2, after}};
}

// The improved Projection as its paper measured it: with Projections, and nothing else.
Points improved(const SeriesBase& base) {
  EvaluatorSettings with = projection_alone(base);
  with.methods = {Method::kProjection, Method::kImproved};
  return {{kPlainProjections, 0, projection_alone(base)}, {kImprovedProjections, 1, with}};
}

Points sampling(const SeriesBase& base) {
  Points points;
  const auto add = [&](double rays) {
    if (rays > static_cast<double>(base.max_sampling_rays)) return;
    EvaluatorSettings settings = base.settings;
    settings.methods = {Method::kLookAround};
    settings.gap = 0;
    settings.max_rays = static_cast<std::uint64_t>(rays);
    points.push_back({count_text(rays) + " rays", rays, settings});
  };
  for (double decade = 1e4; decade <= 1e9; decade *= 10) {
    add(decade);
    add(decade * 3);
  }
  return points;
}

constexpr Series kSeries[] = {
    {"bake", "a bake's settings", "#1a1a1a", true, bake},
    {"cascade", "cascade, to gaps from 0.5 to 0.02", "#1f5fae", true, cascade},
    {"projection", "Projections alone", "#1c9a86", true, projection},
    {"item-buffers", "item buffers of 32 to 512 px", "#8a5bb3", true, item_buffers},
    {"resolution", "Projections, maps of 64 to 1024 px", "#1c9a86", true, resolution},
    {"planes", "Projections, 1 to 16 planes a face", "#e39a2d", true, planes},
    {"extent", "Projections, extent 0.7 to 2", "#8c8c8c", true, extent},
    {"raster", "Projections, direct and OSMesa", "#7a4a2b", true, raster},
    {"sweep", "occlusion sweep, alone and after Projections", "#4f7f1f", true, sweep},
    {"slices", "slices of solids, alone and after Projections", "#8f3a5c", true, slices},
    {"improved", "Projections, plain and improved", "#2aa5c9", true, improved},
    {"ingredients", "a method more or less", "#b0833a", true, ingredients},
    {"sampling", "random rays (prove nothing)", "#d1414f", false, sampling},
};

}  // namespace

std::span<const Series> all_series() { return kSeries; }

const Series* series_named(std::string_view name) {
  for (const Series& series : kSeries)
    if (name == series.name) return &series;
  return nullptr;
}

}  // namespace pvsfarm
