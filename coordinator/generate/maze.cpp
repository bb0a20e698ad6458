#include <array>
#include <string>
#include <vector>

#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr int kMaxSize = 1000;
constexpr double kPitch_m = 3, kHalfWall_m = 0.125, kHeight_m = 3;
constexpr int kGroundTile = 8;  // places

// Which walls stand. Wall (axis 0, x, y) lies on the low x side of place (x, y); axis 1 on the low
// y side. Both run one past the last place, for the border.
class Walls {
 public:
  explicit Walls(int size)
      : size_(size), open_(2 * static_cast<std::size_t>(size + 1) * (size + 1)) {}
  bool stands(int axis, int x, int y) const { return !open_[index(axis, x, y)]; }
  void open(int axis, int x, int y) { open_[index(axis, x, y)] = true; }

 private:
  std::size_t index(int axis, int x, int y) const {
    return (static_cast<std::size_t>(axis) * (size_ + 1) + y) * (size_ + 1) + x;
  }
  int size_;
  std::vector<bool> open_;
};

// Depth-first carving: from a place go on to a random unvisited neighbour, or back.
Walls carve(Random& random, int size) {
  Walls walls(size);
  std::vector<bool> visited(static_cast<std::size_t>(size) * size);
  std::vector<std::array<int, 2>> trail{{0, 0}};
  visited[0] = true;
  constexpr std::array<std::array<int, 2>, 4> kSteps{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  while (!trail.empty()) {
    const auto [x, y] = trail.back();
    std::array<int, 4> choices;
    int count = 0;
    for (int d = 0; d < 4; ++d) {
      const int nx = x + kSteps[d][0], ny = y + kSteps[d][1];
      if (nx < 0 || ny < 0 || nx >= size || ny >= size) continue;
      if (!visited[static_cast<std::size_t>(ny) * size + nx]) choices[count++] = d;
    }
    if (count == 0) {
      trail.pop_back();
      continue;
    }
    const int d = choices[random.below(count)];
    const int nx = x + kSteps[d][0], ny = y + kSteps[d][1];
    walls.open(d / 2, std::max(x, nx), std::max(y, ny));
    visited[static_cast<std::size_t>(ny) * size + nx] = true;
    trail.push_back({nx, ny});
  }
  return walls;
}

// Between the posts at both ends of wall (axis, x, y).
Box wall_box(int axis, int x, int y) {
  Box box{{x * kPitch_m - kHalfWall_m, y * kPitch_m - kHalfWall_m, 0},
          {x * kPitch_m + kHalfWall_m, y * kPitch_m + kHalfWall_m, kHeight_m}};
  const int along = 1 - axis;
  box.lo[along] = (along == 0 ? x : y) * kPitch_m + kHalfWall_m;
  box.hi[along] = box.lo[along] + kPitch_m - 2 * kHalfWall_m;
  return box;
}

void add_walls(GeneratedScene& scene, const Walls& walls, const MazeRequest& request) {
  for (int y = 0; y <= request.size; ++y)
    for (int x = 0; x <= request.size; ++x) {
      const Vec3 node{x * kPitch_m, y * kPitch_m, 0};
      scene.source.objects.push_back(
          box_object(numbered("post", {x, y}), {node - Vec3{kHalfWall_m, kHalfWall_m, 0},
                                                node + Vec3{kHalfWall_m, kHalfWall_m, kHeight_m}}));
      for (int axis = 0; axis < 2; ++axis) {
        if ((axis == 0 ? y : x) == request.size) continue;  // it would leave the maze
        const Box box = wall_box(axis, x, y);
        if (walls.stands(axis, x, y))
          scene.source.objects.push_back(
              box_object(numbered(axis == 0 ? "wall_x" : "wall_y", {x, y}), box));
        else
          tile_cells(scene.cells, box, request.cell_size);
      }
    }
}

void add_places(GeneratedScene& scene, const MazeRequest& request) {
  const double extent = request.size * kPitch_m;
  for (int y = 0; y < request.size; ++y)
    for (int x = 0; x < request.size; ++x) {
      const Vec3 corner{x * kPitch_m, y * kPitch_m, 0};
      const Vec3 border{kHalfWall_m, kHalfWall_m, 0};
      tile_cells(scene.cells, {corner + border, corner + Vec3{kPitch_m, kPitch_m, 0} - border},
                 request.cell_size);
      if (x % kGroundTile != 0 || y % kGroundTile != 0) continue;
      SourceObject ground{.name = numbered("ground", {x, y}), .occluder = false};
      const Vec3 far = corner + Vec3{kGroundTile * kPitch_m, kGroundTile * kPitch_m, 0};
      add_ground(ground, {corner, {std::min(far.x, extent), std::min(far.y, extent), 0}},
                 kMaxCoordinate_m);
      scene.source.objects.push_back(std::move(ground));
    }
}

}  // namespace

Result<GeneratedScene> generate_maze(const MazeRequest& request) {
  if (Status s = check_range("--size", request.size, 1, kMaxSize); !s) return s.error();
  const double extent = request.size * kPitch_m;
  if (Status s = check_cell_size(request.cell_size, extent * extent); !s) return s.error();

  Random random(request.seed);
  GeneratedScene scene;
  add_walls(scene, carve(random, request.size), request);
  add_places(scene, request);
  return scene;
}

}  // namespace pvsfarm
