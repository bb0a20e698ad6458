#include "coordinator/generate/placement.hpp"

#include <cmath>

namespace pvsfarm {
namespace {

struct Turn {
  double cos = 1, sin = 0;

  bool quarter() const { return cos == 0 || sin == 0; }
  Vec3 operator()(const Vec3& p) const {
    return {cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z};
  }
};

// By Taylor's series and quarter turns: the library's last digits differ between machines.
Turn turn_by(double degrees) {
  constexpr double kPi = 3.14159265358979323846;
  const double whole = std::fmod(degrees, 360);
  const double quarters = std::floor(whole / 90 + 0.5);
  const double x = (whole - 90 * quarters) * (kPi / 180), xx = x * x;  // at most pi / 4
  double cos = 1, sin = x, power = 1;
  for (int n = 2; n <= 20; n += 2) {
    power *= -xx / (n * (n - 1));
    cos += power;
  }
  power = x;
  for (int n = 3; n <= 21; n += 2) {
    power *= -xx / (n * (n - 1));
    sin += power;
  }
  Turn turn{cos, sin};
  for (int k = 0; k < ((static_cast<int>(quarters) % 4) + 4) % 4; ++k)
    turn = {-turn.sin + 0.0, turn.cos};
  return turn;
}

Cell placed(const Cell& cell, const Turn& turn, const Vec3& move) {
  if (turn.quarter()) {
    Box box;
    box.add(turn(cell.lo) + move);
    box.add(turn(cell.hi) + move);
    return Cell::aligned(box);
  }
  const Vec3 half = cell.half();
  return {.origin = turn(cell.center()) + move,
          .axes = {turn({1, 0, 0}), turn({0, 1, 0}), Vec3{0, 0, 1}},
          .lo = -half,
          .hi = half};
}

bool within(const Vec3& p) {
  return std::abs(p.x) <= kMostPlaced_m && std::abs(p.y) <= kMostPlaced_m;
}

}  // namespace

Status place(GeneratedScene& scene, const Placement& placement) {
  if (!std::isfinite(placement.rotate_deg))
    return Error{ErrorKind::kCommandLine, "--rotate: not a number of degrees"};
  const Error too_far{ErrorKind::kCommandLine, "--move: farther than a scene can be moved"};
  const Turn turn = turn_by(placement.rotate_deg);
  const Vec3 move{placement.move_m.x, placement.move_m.y, 0};
  if (!within(move)) return too_far;
  for (SourceObject& object : scene.source.objects)
    for (Vec3& v : object.vertices) {
      v = turn(v) + move;
      if (!within(v)) return too_far;
    }
  for (RootCell& root : scene.cells) root.cell = placed(root.cell, turn, move);
  return {};
}

}  // namespace pvsfarm
