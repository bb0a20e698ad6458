#include "common/pvs/settings.hpp"

namespace pvsfarm {

void add_to_digest(DigestBuilder& digest, const EvaluatorSettings& s) {
  digest.add_u64(static_cast<std::uint64_t>(s.raster))
      .add_u64(static_cast<std::uint64_t>(s.resolution_px))
      .add_u64(static_cast<std::uint64_t>(s.planes_per_face))
      .add_f64(s.extent)
      .add_f64(s.near_m);
}

void add_to_digest(DigestBuilder& digest, const BakeSettings& s) {
  add_to_digest(digest, s.evaluator);
  digest.add_u64(s.subdivision.budget_triangles).add_f64(s.subdivision.min_cell_m);
}

const char* to_string(RasterKind kind) { return kind == RasterKind::kDirect ? "direct" : "osmesa"; }

}  // namespace pvsfarm
