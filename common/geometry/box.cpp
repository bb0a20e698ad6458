#include "common/geometry/box.hpp"

namespace pvsfarm {
namespace {
std::uint64_t spread_by_three(std::uint64_t v) {  // 21 bits, two zeros after each
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffull;
  v = (v | v << 16) & 0x1f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  v = (v | v << 2) & 0x1249249249249249ull;
  return v;
}
}  // namespace

std::uint64_t morton_code(const Vec3& p, const Box& bounds) {
  std::uint64_t code = 0;
  for (int a = 0; a < 3; ++a) {
    const double extent = bounds.hi[a] - bounds.lo[a];
    const double t = extent > 0 ? (p[a] - bounds.lo[a]) / extent : 0;
    const double steps = std::clamp(t * 2097152.0, 0.0, 2097151.0);
    code |= spread_by_three(static_cast<std::uint64_t>(steps)) << a;
  }
  return code;
}

}  // namespace pvsfarm
