#include "coordinator/generate/generated_scene.hpp"

#include <cmath>
#include <string>

namespace pvsfarm {

double snap(double v) { return std::nearbyint(v * 1024) / 1024; }

Random stream_of(std::uint64_t seed, std::uint64_t index) {
  return Random(Random(seed).next() + index * 0xd1342543de82ef95ull);
}

std::string numbered(std::string_view kind, std::initializer_list<int> numbers) {
  std::string name(kind);
  for (const int number : numbers) {
    name += '_';
    name += std::to_string(number);
  }
  return name;
}

std::vector<double> even_steps(double lo, double hi, double step) {
  PVS_CHECK_LT(lo, hi);
  // A step that fits but for rounding fits.
  const int count = std::max(1, static_cast<int>(std::ceil((hi - lo) / step - 1e-9)));
  std::vector<double> at{lo};
  for (int i = 1; i < count; ++i) at.push_back(snap(lo + (hi - lo) * i / count));
  at.push_back(hi);
  return at;
}

void tile_cells(std::vector<RootCell>& cells, const Box& region, double cell_size) {
  tile_cells(cells, region, Vec2{cell_size, cell_size});
}

void tile_cells(std::vector<RootCell>& cells, const Box& region, const Vec2& longest) {
  const std::vector<double> xs = even_steps(region.lo.x, region.hi.x, longest.x);
  const std::vector<double> ys = even_steps(region.lo.y, region.hi.y, longest.y);
  for (std::size_t y = 0; y + 1 < ys.size(); ++y)
    for (std::size_t x = 0; x + 1 < xs.size(); ++x) {
      const Box box{{xs[x], ys[y], kEyeLow_m}, {xs[x + 1], ys[y + 1], kEyeHigh_m}};
      cells.push_back({static_cast<std::int64_t>(cells.size()), Cell::aligned(box)});
    }
}

Box StreetNetwork::ground_tile(int bx, int by) const {
  const auto end = [&](int b, int blocks) {
    return b + 1 == blocks ? extent_m(blocks) : street_begin(b + 1);
  };
  return {{street_begin(bx), street_begin(by), 0}, {end(bx, columns), end(by, rows), 0}};
}

namespace {

// The longest cell of each part of a street, in x and y.
struct StreetSteps {
  Vec2 crossing, along_x, along_y;
};

struct BlockRange {
  int first_column, columns, first_row, rows;
};

void tile_range(std::vector<RootCell>& cells, const StreetNetwork& network, const BlockRange& range,
                const StreetSteps& steps) {
  constexpr double k = kClearOfFronts_m;
  const int columns_end = range.first_column + range.columns;
  const int rows_end = range.first_row + range.rows;
  const double block_m = network.block_m + 2 * k;
  for (int y = range.first_row; y <= rows_end; ++y)
    for (int x = range.first_column; x <= columns_end; ++x) {
      const double sx = network.street_begin(x) + k, sy = network.street_begin(y) + k;
      const double bx = network.block_begin(x) - k, by = network.block_begin(y) - k;
      tile_cells(cells, {{sx, sy, 0}, {bx, by, 0}}, steps.crossing);
      if (x < columns_end) tile_cells(cells, {{bx, sy, 0}, {bx + block_m, by, 0}}, steps.along_x);
      if (y < rows_end) tile_cells(cells, {{sx, by, 0}, {bx, by + block_m, 0}}, steps.along_y);
    }
}

}  // namespace

void tile_streets(std::vector<RootCell>& cells, const StreetNetwork& network, double cell_size) {
  const Vec2 step{cell_size, cell_size};
  tile_range(cells, network, {0, network.columns, 0, network.rows}, {step, step, step});
}

void tile_lanes(std::vector<RootCell>& cells, const StreetNetwork& network, const Lanes& lanes) {
  const double across = (network.street_m - 2 * kClearOfFronts_m) / lanes.abreast;
  const Vec2 along_x{lanes.cell_size, across}, along_y{across, lanes.cell_size};
  tile_range(cells, network, {lanes.first_column, lanes.columns, lanes.first_row, lanes.rows},
             {along_x, along_x, along_y});
}

Status check_cell_size(double cell_size, double free_area_m2) {
  if (!(cell_size >= kMinCellSize_m && cell_size <= kMaxCoordinate_m))
    return Error{ErrorKind::kCommandLine, "--cell-size must be a number of metres from 0.125 up"};
  // Rounding up to whole cells along both sides at most quadruples the count.
  if (4 * free_area_m2 / (cell_size * cell_size) > static_cast<double>(kMaxRootCells))
    return Error{ErrorKind::kCommandLine, "--cell-size makes more than " +
                                              std::to_string(kMaxRootCells) +
                                              " cells; use larger cells or a smaller scene"};
  return {};
}

Status check_range(const char* option, std::int64_t value, std::int64_t lo, std::int64_t hi) {
  if (lo <= value && value <= hi) return {};
  return Error{ErrorKind::kCommandLine, std::string(option) + " must be from " +
                                            std::to_string(lo) + " to " + std::to_string(hi) +
                                            ", not " + std::to_string(value)};
}

}  // namespace pvsfarm
