// What differs between two stores. Cells are the same if root id and path are, objects if their
// names are (of several with one name: the first is the first, and so on).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

struct DiffCell {
  std::int64_t root_id = 0;
  CellKey key;
  std::uint32_t index = 0;  // in the store it is in; of a common cell in the first
};

struct ChangedCell {
  DiffCell cell;
  std::uint32_t index_in_b = 0;
  bool moved = false;                          // another box
  std::vector<std::string_view> lost, gained;  // names of objects visible in a only, in b only
  // Visible in both, but certified seen in a only, in b only.
  std::vector<std::string_view> seen_lost, seen_gained;
};

// Names are views of the two stores.
struct StoreDiff {
  bool same_bytes = false;  // by the digests the files state
  std::vector<std::string_view> objects_only_in_a, objects_only_in_b;
  std::vector<DiffCell> cells_only_in_a, cells_only_in_b;
  std::vector<ChangedCell> changed;
  std::uint32_t common_cells = 0;

  bool empty() const {
    return objects_only_in_a.empty() && objects_only_in_b.empty() && cells_only_in_a.empty() &&
           cells_only_in_b.empty() && changed.empty();
  }
};

Result<StoreDiff> diff_stores(StoreReader& a, StoreReader& b);

}  // namespace pvsfarm
