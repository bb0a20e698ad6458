#include "tests/bench/bench_scene.hpp"

#include <utility>

#include "common/scene/scene_build.hpp"
#include "coordinator/chart/sample.hpp"
#include "coordinator/generate/generate.hpp"

namespace pvsfarm::bench {
namespace {

Result<GeneratedScene> generate(const std::string& kind, int size, double cell_size_m) {
  const auto or_default = [size](int fallback) { return size > 0 ? size : fallback; };
  if (kind == "city" || kind == "closed-city") {
    CityRequest request;
    request.blocks = or_default(request.blocks);
    request.cell_size = cell_size_m;
    return kind == "city" ? generate_city(request) : generate_closed_city(request);
  }
  if (kind == "forest") {
    ForestRequest request;
    request.trees = or_default(request.trees);
    request.cell_size = cell_size_m;
    return generate_forest(request);
  }
  if (kind == "rooms") {
    RoomsRequest request;
    request.rooms = or_default(request.rooms);
    request.cell_size = cell_size_m;
    return generate_rooms(request);
  }
  if (kind == "terrain") {
    TerrainRequest request;
    request.tiles = or_default(request.tiles);
    request.cell_size = cell_size_m;
    return generate_terrain(request);
  }
  if (kind == "maze") {
    MazeRequest request;
    request.size = or_default(request.size);
    request.cell_size = cell_size_m;
    return generate_maze(request);
  }
  return Error{ErrorKind::kCommandLine, "no generator is called " + kind};
}

}  // namespace

Result<BenchScene> make_bench_scene(const std::string& kind, int size, double cell_size_m) {
  Result<GeneratedScene> generated = generate(kind, size, cell_size_m);
  if (!generated.ok()) return generated.error();
  Result<std::shared_ptr<const Scene>> scene = build_scene(generated->source);
  if (!scene.ok()) return scene.error();
  return BenchScene{std::move(generated->source), std::move(*scene), std::move(generated->cells)};
}

std::vector<RootCell> sample_cells(const std::vector<RootCell>& cells, std::size_t count,
                                   std::uint64_t seed) {
  std::vector<RootCell> sample;
  for (const std::uint32_t i : spread_sample(cells, count, seed)) sample.push_back(cells[i]);
  return sample;
}

std::uint64_t triangles_in(const Scene& scene, const VisibleSet& set) {
  std::uint64_t total = 0;
  set.for_each([&](ObjectId id) { total += scene.object(id).triangle_count; });
  return total;
}

}  // namespace pvsfarm::bench
