#include "coordinator/chart/measure.hpp"

#include <algorithm>
#include <numeric>

#include "coordinator/chart/sample.hpp"

namespace pvsfarm {
namespace {

struct Point {
  const Series* series = nullptr;
  SeriesPoint point;
  std::size_t evaluation = 0;  // which of the different settings
};

struct Plan {
  std::vector<Point> points;
  std::vector<EvaluatorSettings> evaluations;  // all different
  std::vector<std::uint32_t> cells;            // indices in the request
};

Plan plan(const ChartRequest& request) {
  Plan out;
  for (const Series* series : request.series) {
    for (SeriesPoint& point : series->points(request.base)) {
      const auto known = std::find(out.evaluations.begin(), out.evaluations.end(), point.settings);
      const auto index = static_cast<std::size_t>(known - out.evaluations.begin());
      if (known == out.evaluations.end()) out.evaluations.push_back(point.settings);
      out.points.push_back({series, std::move(point), index});
    }
  }
  out.cells = spread_sample(request.cells, request.sample, request.seed);
  return out;
}

// In deltas, the answer for `cell` of the plan under `evaluation`.
std::size_t place(const Plan& plan, std::size_t evaluation, std::size_t cell) {
  return evaluation * plan.cells.size() + cell;
}

Result<std::vector<CellDelta>> evaluate_all(const ChartRequest& request, const Plan& plan,
                                            const EvaluateChartTasks& evaluate) {
  std::vector<ChartTask> tasks;
  for (const EvaluatorSettings& settings : plan.evaluations)
    for (const std::uint32_t cell : plan.cells)
      tasks.push_back({settings, {cell, 1}, request.cells[cell].cell});
  auto first = evaluate(tasks);
  if (!first) return first.error();
  std::vector<CellDelta> least = std::move(first).value();
  PVS_CHECK_EQ(least.size(), tasks.size());
  for (int run = 1; run < request.runs; ++run) {
    std::vector<ChartTask> repeated;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      if (least[i].statistics.cpu_ms > kLongEvaluation_ms) continue;
      repeated.push_back(tasks[i]);
      places.push_back(i);
    }
    const auto deltas = evaluate(repeated);
    if (!deltas) return deltas.error();
    PVS_CHECK_EQ(deltas->size(), repeated.size());
    for (std::size_t k = 0; k < places.size(); ++k) {
      CellDelta& kept = least[places[k]];
      const CellDelta& again = (*deltas)[k];
      if (!(again.hidden == kept.hidden && again.seen == kept.seen))
        return runtime_error("cell " + std::to_string(request.cells[repeated[k].key.root].id) +
                             ": two evaluations of it with the same settings differ");
      kept.statistics.cpu_ms = std::min(kept.statistics.cpu_ms, again.statistics.cpu_ms);
    }
  }
  return least;
}

struct Size {
  double objects = 0, triangles = 0;
  void add(const Size& other) {
    objects += other.objects;
    triangles += other.triangles;
  }
};

Size size_of(const Scene& scene, const VisibleSet& set) {
  Size size;
  set.for_each([&](ObjectId id) {
    size.objects += 1;
    size.triangles += scene.object(id).triangle_count;
  });
  return size;
}

VisibleSet both(VisibleSet a, const VisibleSet& b) {
  a.keep_only(b);
  return a;
}

// Of each cell, what any point saw.
std::vector<VisibleSet> references(const Plan& plan, std::span<const CellDelta> deltas) {
  std::vector<VisibleSet> out;
  for (std::size_t c = 0; c < plan.cells.size(); ++c) {
    const VisibleSet& first = deltas[place(plan, 0, c)].seen;
    std::vector<std::uint64_t> words(first.words().begin(), first.words().end());
    for (std::size_t e = 1; e < plan.evaluations.size(); ++e) {
      const auto more = deltas[place(plan, e, c)].seen.words();
      for (std::size_t w = 0; w < words.size(); ++w) words[w] |= more[w];
    }
    out.push_back(VisibleSet::from_words(first.universe(), std::move(words)));
  }
  return out;
}

std::string joined(Methods methods) {
  std::string text;
  for (int i = 0; i < kMethodCount; ++i) {
    if (!methods.has(static_cast<Method>(i))) continue;
    if (!text.empty()) text += '+';
    text += to_string(static_cast<Method>(i));
  }
  return text;
}

// What does not come from the evaluations.
ChartRow describe(const ChartRequest& request, const Point& point, const Size& everything) {
  const EvaluatorSettings& s = point.point.settings;
  return {.scene = request.scene_name,
          .scene_objects = static_cast<std::uint64_t>(everything.objects),
          .scene_triangles = static_cast<std::uint64_t>(everything.triangles),
          .series = point.series->name,
          .label = point.point.label,
          .value = point.point.value,
          .proves = point.series->proves,
          .raster = to_string(s.raster),
          .methods = joined(s.methods),
          .resolution_px = s.resolution_px,
          .planes_per_face = s.planes_per_face,
          .item_buffer_px = s.item_buffer_px,
          .extent = s.extent,
          .asked_gap = s.gap,
          .max_rays = s.max_rays,
          .cells_in_all = request.cells.size()};
}

double ratio(double a, double b, double if_none) { return b > 0 ? a / b : if_none; }

class Figures {
 public:
  Figures(const ChartRequest& request, const Plan& plan, std::span<const CellDelta> deltas)
      : request_(request),
        plan_(plan),
        deltas_(deltas),
        references_(references(plan, deltas)),
        everything_(VisibleSet::all(request.scene->object_count())) {
    for (std::uint32_t i = 0; i < request.scene->object_count(); ++i)
      if (!request.scene->object(ObjectId{i}).occludee) everything_.remove(ObjectId{i});
    for (const VisibleSet& set : references_) reference_.add(size_of(*request.scene, set));
  }

  ChartRow row(const Point& point) const {
    const Scene& scene = *request_.scene;
    const Size everything = size_of(scene, everything_);
    ChartRow row = describe(request_, point, everything);
    Size pvs, seen;
    std::vector<double> times;
    for (std::size_t c = 0; c < plan_.cells.size(); ++c) {
      const CellDelta& delta = deltas_[place(plan_, point.evaluation, c)];
      VisibleSet visible = everything_;
      visible.remove_all(delta.hidden);
      const Size saw = size_of(scene, delta.seen);
      seen.add(saw);
      pvs.add(row.proves ? size_of(scene, visible) : saw);
      row.violations +=
          both(delta.hidden, references_[c]).count() + delta.statistics.contradictions;
      times.push_back(delta.statistics.cpu_ms);
    }
    std::sort(times.begin(), times.end());
    const auto cells = static_cast<double>(times.size());
    row.cells = times.size();
    row.cpu_ms = std::accumulate(times.begin(), times.end(), 0.0) / cells;
    row.cpu_ms_median = times[times.size() / 2];
    row.cpu_ms_most = times.back();
    row.pvs_objects = pvs.objects / cells;
    row.pvs_triangles = pvs.triangles / cells;
    row.culled_percent = 100 - 100 * pvs.triangles / (cells * everything.triangles);
    if (row.proves && seen.objects > 0)
      row.gap = ratio(pvs.triangles - seen.triangles, pvs.triangles, 0);
    row.pvs_over_seen_objects = ratio(pvs.objects, reference_.objects, 1);
    row.pvs_over_seen_triangles = ratio(pvs.triangles, reference_.triangles, 1);
    row.found_objects = ratio(seen.objects, reference_.objects, 1);
    row.found_triangles = ratio(seen.triangles, reference_.triangles, 1);
    return row;
  }

 private:
  const ChartRequest& request_;
  const Plan& plan_;
  std::span<const CellDelta> deltas_;
  std::vector<VisibleSet> references_;
  VisibleSet everything_;
  Size reference_;  // sum over the cells
};

}  // namespace

Result<std::vector<ChartRow>> measure(const ChartRequest& request,
                                      const EvaluateChartTasks& evaluate) {
  if (request.cells.empty() || request.sample == 0)
    return invalid_input(request.scene_name + ": no cells to evaluate");
  const Plan planned = plan(request);
  if (planned.points.empty())
    return invalid_input(request.scene_name + ": no series with a point to measure");
  const auto deltas = evaluate_all(request, planned, evaluate);
  if (!deltas) return deltas.error();
  const Figures figures(request, planned, *deltas);
  std::vector<ChartRow> rows;
  for (const Point& point : planned.points) rows.push_back(figures.row(point));
  return rows;
}

}  // namespace pvsfarm
