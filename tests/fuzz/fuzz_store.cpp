// Store files, as an engine's run-time reader (C) and the tools' reader meet them.
#include "common/base/file.hpp"
#include "common/pvs/pvs_load.h"
#include "common/pvs/pvs_reader.h"
#include "tests/fuzz/driver.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm::fuzz {

const char* const kTarget = "store";
const std::size_t kMaxInput = 64 << 10;

std::vector<Input> seeds() {
  const TempFolder folder;
  std::vector<Input> all;
  for (const SampleShape& shape :
       {SampleShape{.objects = 20, .roots = 1, .max_depth = 1}, SampleShape{.objects = 70},
        SampleShape{.objects = 130, .roots = 3, .with_seen = false}}) {
    PVS_CHECK(random_store(5 + all.size(), shape).write(folder.file("a.pvs")).ok());
    all.push_back(input_of(read_file(folder.file("a.pvs")).value()));
  }
  return all;
}

void run(std::span<const std::uint8_t> input) {
  constexpr std::uint32_t kMostNodes = 300, kMostObjects = 300, kMostWords = 1 << 16;
  pvs_store store;
  pvs_damage damage{};
  if (pvs_open_memory(&store, input.data(), input.size(), &damage) != PVS_OK) return;
  pvs_verify(&store, &damage);
  std::uint32_t cells[4], count = 0;
  for (int i = 0; i < 8; ++i) {
    const double p[3] = {i * 23.0 - 90, 9.0 * i - 30, 10.0 - 5 * i};
    pvs_find(&store, p, cells, 4, &count);
    PVS_CHECK(count == 0 || cells[0] < store.node_count);
  }
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < std::min(store.object_count + 1, kMostObjects); ++i) {
    pvs_object_info info;
    if (pvs_object(&store, i, &info) == PVS_OK)
      for (std::uint64_t k = 0; k < info.name_bytes; ++k)
        sum += static_cast<unsigned char>(info.name[k]);
  }
  if (store.word_count > kMostWords || pvs_scratch_words(&store) > 64 * kMostWords) return;
  std::vector<std::uint64_t> visible(store.word_count), seen(store.word_count);
  std::vector<std::uint64_t> scratch(pvs_scratch_words(&store));
  for (std::uint32_t i = 0; i < std::min(store.node_count + 1, kMostNodes); ++i) {
    pvs_node_info info;
    pvs_node(&store, i, &info);
    if (pvs_read_sets(&store, i, visible.data(), seen.data(), scratch.data()) != PVS_OK) continue;
    if (store.object_count % 64 != 0)
      PVS_CHECK_EQ((visible.back() | seen.back()) >> (store.object_count % 64), 0u);
  }
  PVS_CHECK(sum + 1 > 0);
  pvs_close(&store);
}

}  // namespace pvsfarm::fuzz
