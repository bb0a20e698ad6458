#include "worker/visibility/shaft.hpp"

#include <cmath>

#include "worker/visibility/dispatch.hpp"

namespace pvsfarm {
namespace {

constexpr int kSides = 6;

// `box`: low x, y, z, high x, y, z. `sides`: nx, ny, nz, most of each.
PVSFARM_DISPATCH
void find_beyond_sides(const double* ax, const double* ay, const double* az, const double* bx,
                       const double* by, const double* bz, std::size_t n, const double* box,
                       const double* sides, double* beyond) {
  for (std::size_t i = 0; i < n; ++i) {
    const double low_x = ax[i] < bx[i] ? ax[i] : bx[i], high_x = ax[i] < bx[i] ? bx[i] : ax[i];
    const double low_y = ay[i] < by[i] ? ay[i] : by[i], high_y = ay[i] < by[i] ? by[i] : ay[i];
    const double low_z = az[i] < bz[i] ? az[i] : bz[i], high_z = az[i] < bz[i] ? bz[i] : az[i];
    int out = (high_x < box[0]) | (high_y < box[1]) | (high_z < box[2]) | (low_x > box[3]) |
              (low_y > box[4]) | (low_z > box[5]);
    for (int k = 0; k < kSides; ++k) {
      const double* side = sides + 4 * k;
      const double a = side[0] * ax[i] + side[1] * ay[i] + side[2] * az[i];
      const double b = side[0] * bx[i] + side[1] * by[i] + side[2] * bz[i];
      out |= (a > side[3]) & (b > side[3]);
    }
    beyond[i] = out != 0 ? 1 : 0;
  }
}

}  // namespace

// Any direction gives a valid side, as far as both boxes reach along it: rounding of the direction
// does no harm.
Shaft::Shaft(const Box& from, const Box& to, double margin) : around_(from) {
  around_.add(to);
  around_.lo -= Vec3(margin);
  around_.hi += Vec3(margin);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int corner = 0; corner < 4 && count_ < kMostSides; ++corner) {
      const bool high_u = (corner & 1) != 0, high_v = (corner & 2) != 0;
      const auto at = [&](const Box& box, int a, bool high) {
        return high ? box.hi[a] : box.lo[a];
      };
      const double du = at(to, u, high_u) - at(from, u, high_u);
      const double dv = at(to, v, high_v) - at(from, v, high_v);
      // At right angles to the line between like corners, outwards for both.
      const double su = high_u ? 1 : -1, sv = high_v ? 1 : -1;
      double nu = su * std::abs(dv), nv = sv * std::abs(du);
      if (!(nu != 0 && nv != 0) || ((du > 0) == (dv > 0)) != (high_u != high_v)) continue;
      const double size = std::abs(nu) + std::abs(nv);
      nu /= size;
      nv /= size;
      const auto reach = [&](const Box& box) {
        return nu * at(box, u, nu > 0) + nv * at(box, v, nv > 0);
      };
      sides_[count_++] = {u, v, nu, nv, std::max(reach(from), reach(to)) + margin};
    }
  }
}

void Shaft::find_beyond(const std::array<const double*, 6>& ends, std::size_t n,
                        double* lies_beyond) const {
  static_assert(kSides == kMostSides);
  const double box[6] = {around_.lo.x, around_.lo.y, around_.lo.z,
                         around_.hi.x, around_.hi.y, around_.hi.z};
  double sides[4 * kSides] = {};  // those that there are not leave nothing out: 0 <= 0
  for (int k = 0; k < count_; ++k) {
    sides[4 * k + sides_[k].u] = sides_[k].nu;
    sides[4 * k + sides_[k].v] = sides_[k].nv;
    sides[4 * k + 3] = sides_[k].most;
  }
  find_beyond_sides(ends[0], ends[1], ends[2], ends[3], ends[4], ends[5], n, box, sides,
                    lies_beyond);
}

}  // namespace pvsfarm
