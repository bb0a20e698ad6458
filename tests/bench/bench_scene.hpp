// Generated scenes for measurements, and a sample of their cells.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.hpp"
#include "common/cells/cell_source.hpp"
#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm::bench {

struct BenchScene {
  SceneSource source;
  std::shared_ptr<const Scene> scene;
  std::vector<RootCell> cells;  // all of them, as the generator gives them
};

// `kind`: city, closed-city, forest, rooms, terrain, maze. `size`: blocks, trees, rooms, tiles or
// places a side; 0 for the generator's own.
Result<BenchScene> make_bench_scene(const std::string& kind, int size, double cell_size_m);

// `count` of the cells, spread evenly (coordinator/chart/sample.hpp).
std::vector<RootCell> sample_cells(const std::vector<RootCell>& cells, std::size_t count,
                                   std::uint64_t seed);

std::uint64_t triangles_in(const Scene& scene, const VisibleSet& set);

}  // namespace pvsfarm::bench
