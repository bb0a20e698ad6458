#include "common/pvs/settings.hpp"

namespace pvsfarm {

void add_to_digest(DigestBuilder& digest, const EvaluatorSettings& s) {
  digest.add_u64(static_cast<std::uint64_t>(s.raster))
      .add_u64(static_cast<std::uint64_t>(s.resolution_px))
      .add_u64(static_cast<std::uint64_t>(s.planes_per_face))
      .add_f64(s.extent)
      .add_f64(s.near_m)
      .add_u64(s.methods.bits())
      .add_f64(s.gap)
      .add_u64(s.max_rays)
      .add_f64(s.time_ms)
      .add_u64(static_cast<std::uint64_t>(s.item_buffer_px))
      .add_u64(s.budget_triangles);
  // Not at all where there are none: bakes without hints are what they were before there were any.
  if (s.hint_viewpoints > 0) digest.add("hints").add_u64(s.hint_viewpoints);
}

void add_to_digest(DigestBuilder& digest, const BakeSettings& s) {
  add_to_digest(digest, s.evaluator);
  digest.add_u64(s.subdivision.budget_triangles)
      .add_f64(s.subdivision.min_cell_m)
      .add_f64(s.subdivision.split_gain)
      .add_f64(s.subdivision.merge_tolerance);
}

const char* to_string(RasterKind kind) { return kind == RasterKind::kDirect ? "direct" : "osmesa"; }

}  // namespace pvsfarm
