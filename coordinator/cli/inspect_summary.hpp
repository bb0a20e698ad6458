// What `pvsfarm inspect` says of a store.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

struct Spread {
  std::uint64_t min = 0, median = 0, max = 0;
  double mean = 0;
};
Spread spread_of(std::vector<std::uint64_t> values);  // of none: all 0

struct StoreSummary {
  std::string file;
  UpAxis up = UpAxis::kZ;
  std::uint32_t cells = 0, leaves = 0, roots = 0, quarantined = 0, objects = 0;
  int depth = 0;  // of the deepest leaf
  std::uint64_t triangles = 0;
  // Over the leaves.
  Spread visible_objects, visible_triangles, seen_objects, seen_triangles;
  bool any_seen = false;
  double gap_of_triangles = 0, gap_of_objects = 0;  // of each leaf, summed
  std::uint64_t leaf_triangles = 0, leaf_seen_triangles = 0, leaf_objects = 0, leaf_seen = 0;
  std::array<std::uint64_t, kLeafReasonCount> leaves_by_reason{};
  std::uint64_t file_bytes = 0;
  StoreSizes sizes;
  std::string settings_json;
  Digest scene_digest, bake_digest, file_digest;

  // [%] of the scene's triangles that a leaf need not draw, on average.
  double culled_percent() const;
  double per_cell(std::uint64_t bytes) const { return cells == 0 ? 0 : double(bytes) / cells; }
};

Result<StoreSummary> summarise(StoreReader& store);
std::string summary_text(const StoreSummary& summary);  // lines
std::string summary_json(const StoreSummary& summary);  // one line

}  // namespace pvsfarm
