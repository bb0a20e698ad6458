// The picture of `pvsfarm inspect --picture`: a store seen from above.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "coordinator/cli/inspect_summary.hpp"

namespace pvsfarm {

struct PictureRequest {
  std::string path;                   // a PNG
  bool by_gap = false;                // the cells' colour: their gap, not the size of their sets
  std::optional<std::uint32_t> cell;  // whose visible and culled objects are shown
};

// Errors: kIo, kCommandLine (no such cell), kInvalidInput (damaged, or nothing to draw).
Status draw_store(StoreReader& store, const StoreSummary& summary, const PictureRequest& request);

}  // namespace pvsfarm
