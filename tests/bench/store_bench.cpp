// Google Benchmark of stores: write a cell, read a random cell's set, find the cell of a point, and
// how many bytes a cell takes. The sets are real: the first street cells of a generated city.
#include <benchmark/benchmark.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/base/random.hpp"
#include "common/pvs/pvs_reader.h"
#include "common/pvs/store_reader.hpp"
#include "tests/bench/bench_scene.hpp"
#include "worker/evaluator/evaluator.hpp"

namespace pvsfarm::bench {
namespace {

constexpr int kBlocks = 6;
constexpr std::size_t kCells = 512;

struct BakedCity {
  std::shared_ptr<const Scene> scene;
  std::vector<StoreNode> nodes;
  std::string path;

  ~BakedCity() { std::filesystem::remove(path); }
};

void write_store(const BakedCity& city) {
  auto writer = StoreWriter::create(city.path, {}, *city.scene).value();
  for (const StoreNode& node : city.nodes) PVS_CHECK(writer->add(node).ok());
  PVS_CHECK(writer->finish().ok());
}

const BakedCity& city() {
  static const BakedCity baked = [] {
    const BenchScene bench = make_bench_scene("city", kBlocks, 5).value();
    BakedCity made{.scene = bench.scene};
    made.path = std::filesystem::temp_directory_path() /
                ("pvsfarm_bench_" + std::to_string(::getpid()) + ".pvs");
    Evaluator evaluator(bench.scene, {});
    const VisibleSet all = all_occludees(*bench.scene);
    for (std::uint32_t i = 0; i < std::min(kCells, bench.cells.size()); ++i) {
      StoreNode node{.key = {i, 1},
                     .root_id = bench.cells[i].id,
                     .cell = bench.cells[i].cell,
                     .visible = all,
                     .seen = VisibleSet::none(all.universe())};
      node.visible.remove_all(evaluator.evaluate(node.key, node.cell, all).hidden);
      made.nodes.push_back(std::move(node));
    }
    write_store(made);
    return made;
  }();
  return baked;
}

void write_cells(benchmark::State& state) {
  const BakedCity& baked = city();
  for (auto _ : state) write_store(baked);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(baked.nodes.size()));
  const auto reader = StoreReader::open(baked.path).value();
  const double cells = static_cast<double>(baked.nodes.size());
  double objects = 0;
  for (const StoreNode& node : baked.nodes) objects += node.visible.count();
  state.counters["set_bytes_a_cell"] = static_cast<double>(reader->sizes().set_bytes) / cells;
  state.counters["visible_a_cell"] = objects / cells;
  state.counters["objects"] = baked.scene->object_count();
}

void read_a_random_set(benchmark::State& state) {
  const BakedCity& baked = city();
  pvs_store store;
  PVS_CHECK_EQ(pvs_open_file(&store, baked.path.c_str(), nullptr), PVS_OK);
  std::vector<std::uint64_t> words(store.word_count), scratch(pvs_scratch_words(&store));
  Random random(1);
  for (auto _ : state) {
    const auto cell = static_cast<std::uint32_t>(random.below(store.node_count));
    benchmark::DoNotOptimize(pvs_read_sets(&store, cell, words.data(), nullptr, scratch.data()));
    const auto expected = baked.nodes[cell].visible.words();
    if (words[cell % words.size()] != expected[cell % words.size()]) {
      state.SkipWithError("the set is not the one that was written");
      break;
    }
  }
  pvs_close(&store);
}

void find_the_cell_of_a_point(benchmark::State& state) {
  const BakedCity& baked = city();
  pvs_store store;
  PVS_CHECK_EQ(pvs_open_file(&store, baked.path.c_str(), nullptr), PVS_OK);
  Random random(1);
  for (auto _ : state) {
    const auto cell = static_cast<std::uint32_t>(random.below(store.node_count));
    const Vec3 p = file_from_internal(baked.scene->file_up(), baked.nodes[cell].cell.center());
    const double point[3] = {p.x, p.y, p.z};
    std::uint32_t found[8], count = 0;
    benchmark::DoNotOptimize(pvs_find(&store, point, found, 8, &count));
    if (std::find(found, found + std::min(count, 8u), cell) == found + std::min(count, 8u)) {
      state.SkipWithError("a cell was not found at its own centre");
      break;
    }
  }
  pvs_close(&store);
}

BENCHMARK(write_cells)->Unit(benchmark::kMillisecond);
BENCHMARK(read_a_random_set);
BENCHMARK(find_the_cell_of_a_point);

}  // namespace
}  // namespace pvsfarm::bench

BENCHMARK_MAIN();
