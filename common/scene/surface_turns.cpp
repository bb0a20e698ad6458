#include "common/scene/surface_turns.hpp"

#include <array>

namespace pvsfarm {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;
constexpr std::uint8_t kUnknown = 2;

struct Neighbour {
  std::uint32_t sheet = kNone;
  bool agrees = true;  // with both in ascending order, they run along their edge oppositely
};
using Neighbours = std::vector<std::array<Neighbour, 3>>;

// Ascending, a triangle runs up its edges but for the one between its first and last vertex.
bool runs_up(const Sheet& sheet, const EdgeUse& use) {
  return sheet.v[1] == use.low() || sheet.v[1] == use.high();
}

Neighbours neighbours_of(const SheetMesh& mesh, const std::vector<EdgeUse>& uses) {
  Neighbours neighbours(mesh.sheets.size());
  const auto add = [&neighbours](std::uint32_t sheet, const Neighbour& n) {
    for (Neighbour& slot : neighbours[sheet])
      if (slot.sheet == kNone) {
        slot = n;
        return;
      }
  };
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2) return;
    const std::uint32_t s = uses[first].sheet, t = uses[first + 1].sheet;
    const bool agrees =
        runs_up(mesh.sheets[s], uses[first]) != runs_up(mesh.sheets[t], uses[first + 1]);
    add(s, {t, agrees});
    add(t, {s, agrees});
  });
  return neighbours;
}

// A sheet's own front, if it has one.
std::uint8_t own_front(const Sheet& sheet) {
  if (sheet.sides != Sheet::kBoth) return sheet.sides == Sheet::kDescending;
  if (sheet.outer == Sheet::kAscending) return 0;
  if (sheet.outer == Sheet::kDescending) return 1;
  return kUnknown;
}

}  // namespace

std::vector<std::uint8_t> choose_fronts(const SheetMesh& mesh, const std::vector<EdgeUse>& uses) {
  const Neighbours neighbours = neighbours_of(mesh, uses);
  std::vector<std::uint8_t> front;
  std::vector<std::uint32_t> queue;
  for (std::uint32_t s = 0; s < mesh.sheets.size(); ++s) {
    front.push_back(own_front(mesh.sheets[s]));
    if (front[s] != kUnknown) queue.push_back(s);
  }
  const auto spread = [&] {
    while (!queue.empty()) {
      const std::uint32_t s = queue.back();
      queue.pop_back();
      for (const Neighbour& n : neighbours[s]) {
        if (n.sheet == kNone || front[n.sheet] != kUnknown) continue;
        front[n.sheet] = n.agrees ? front[s] : static_cast<std::uint8_t>(1 - front[s]);
        queue.push_back(n.sheet);
      }
    }
  };
  spread();
  for (std::uint32_t s = 0; s < front.size(); ++s) {
    if (front[s] != kUnknown) continue;
    front[s] = 0;
    queue.push_back(s);
    spread();
  }
  return front;
}

}  // namespace pvsfarm
