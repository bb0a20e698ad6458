#include <array>
#include <string>
#include <vector>

#include "coordinator/generate/generate.hpp"
#include "coordinator/generate/mesh_kit.hpp"

namespace pvsfarm {
namespace {

constexpr int kMaxRooms = 500;
constexpr std::array<double, 2> kPitch_m{6, 5};
constexpr double kHalfWall_m = 0.125, kHeight_m = 3, kTessellation_m = 0.5;
constexpr double kDoorWidth_m = 0.9375, kDoorHeight_m = 2.125;
constexpr double kWindowWidth_m = 1.25, kWindowLow_m = 0.875, kWindowHigh_m = 2.125;
constexpr double kExtraDoors = 0.5;  // the share of the walls with a door that no one needs
constexpr double kHighestFurniture_m = 1.375;

// A wall of the grid: on the low side of room (x, y) along `axis`, or past the last room.
struct WallPlace {
  int axis = 0;
  int x = 0, y = 0;
};

struct Opening {
  double lo = 0, hi = 0;  // along the wall
  double bottom = 0, top = 0;
};

Box wall_box(const WallPlace& at) {
  const Vec3 node{at.x * kPitch_m[0], at.y * kPitch_m[1], 0};
  Box box{node - Vec3{kHalfWall_m, kHalfWall_m, 0},
          node + Vec3{kHalfWall_m, kHalfWall_m, kHeight_m}};
  const int along = 1 - at.axis;
  box.lo[along] = node[along] + kHalfWall_m;
  box.hi[along] = node[along] + kPitch_m[along] - kHalfWall_m;
  return box;
}

// The steps of a tessellation with cuts at `lo` and `hi` as well.
std::vector<double> steps_with_cuts(double begin, double lo, double hi, double end) {
  std::vector<double> steps{begin};
  for (const double to : {lo, hi, end}) {
    if (!(steps.back() < to)) continue;
    const std::vector<double> part = even_steps(steps.back(), to, kTessellation_m);
    steps.insert(steps.end(), part.begin() + 1, part.end());
  }
  return steps;
}

SourceObject make_wall(const WallPlace& at, const Opening& opening, std::string name) {
  const Box box = wall_box(at);
  const int along = 1 - at.axis;
  const auto run = steps_with_cuts(box.lo[along], opening.lo, opening.hi, box.hi[along]);
  const auto zs = steps_with_cuts(0, opening.bottom, opening.top, kHeight_m);
  const std::vector<double> across{box.lo[at.axis], box.hi[at.axis]};
  SourceObject wall{.name = std::move(name)};
  add_lattice(wall, {.xs = along == 0 ? run : across,
                     .ys = along == 1 ? run : across,
                     .zs = zs,
                     .solid = [&](int i, int j, int k) {
                       const double s = run[along == 0 ? i : j];
                       return !(opening.lo <= s && s < opening.hi && opening.bottom <= zs[k] &&
                                zs[k] < opening.top);
                     }});
  return wall;
}

// A door's hole in the floor plan is viewing space too.
void add_wall(GeneratedScene& scene, Random& random, const RoomsRequest& request,
              const WallPlace& at, bool door) {
  const bool outer = (at.axis == 0 ? at.x : at.y) % request.rooms == 0;
  const int along = 1 - at.axis;
  const Box box = wall_box(at);
  Opening opening;
  const double width = outer ? kWindowWidth_m : kDoorWidth_m;
  opening.lo = snap(random.between(box.lo[along] + 0.5, box.hi[along] - 0.5 - width));
  opening.hi = opening.lo + width;
  opening.bottom = outer ? kWindowLow_m : 0;
  opening.top = outer ? kWindowHigh_m : door ? kDoorHeight_m : 0;
  const std::string name = numbered(at.axis == 0 ? "wall_x" : "wall_y", {at.x, at.y});
  scene.source.objects.push_back(make_wall(at, opening, name));
  if (outer || !door) return;
  Box hole = box;
  hole.lo[along] = opening.lo;
  hole.hi[along] = opening.hi;
  tile_cells(scene.cells, hole, request.cell_size);
}

SourceObject make_post(int x, int y) {
  const Vec3 node{x * kPitch_m[0], y * kPitch_m[1], 0};
  const std::vector<double> xs{node.x - kHalfWall_m, node.x + kHalfWall_m};
  const std::vector<double> ys{node.y - kHalfWall_m, node.y + kHalfWall_m};
  SourceObject post{.name = numbered("post", {x, y})};
  add_lattice(post, {.xs = xs,
                     .ys = ys,
                     .zs = even_steps(0, kHeight_m, kTessellation_m),
                     .solid = [](int, int, int) { return true; }});
  return post;
}

// One piece in each quarter of the room.
void add_furniture(GeneratedScene& scene, Random& random, const Box& room, int x, int y) {
  for (int quarter = 0; quarter < 4; ++quarter) {
    Box box;
    for (int a = 0; a < 2; ++a) {
      const double half = room.size()[a] / 2;
      const double from = room.lo[a] + (quarter >> a & 1) * half;
      const double width = random.between(0.5, 1.5);
      box.lo[a] = snap(from + random.between(0.1, half - width - 0.1));
      box.hi[a] = snap(box.lo[a] + width);
    }
    box.lo.z = 0;
    box.hi.z = snap(random.between(0.4, kHighestFurniture_m));
    scene.source.objects.push_back(box_object(numbered("furniture", {x, y, quarter}), box));
  }
}

void add_room(GeneratedScene& scene, const RoomsRequest& request, int x, int y) {
  Random random = stream_of(request.seed, static_cast<std::uint64_t>(y) * (kMaxRooms + 1) + x);
  const bool inside_x = x < request.rooms, inside_y = y < request.rooms;
  scene.source.objects.push_back(make_post(x, y));
  // A door to the lower neighbour along x or along y for every room connects them all.
  const bool door_along_x = y == 0 || (x > 0 && random.below(2) == 0);
  const bool extra = random.unit() < kExtraDoors;
  if (inside_y) add_wall(scene, random, request, {0, x, y}, door_along_x || extra);
  if (inside_x) add_wall(scene, random, request, {1, x, y}, !door_along_x || extra);
  if (!inside_x || !inside_y) return;

  const Vec3 corner{x * kPitch_m[0], y * kPitch_m[1], 0};
  Box slab{corner, corner + Vec3{kPitch_m[0], kPitch_m[1], 0}};
  SourceObject floor{.name = numbered("floor", {x, y})};
  add_ground(floor, slab, kTessellation_m);
  scene.source.objects.push_back(std::move(floor));
  slab.lo.z = slab.hi.z = kHeight_m;
  SourceObject ceiling{.name = numbered("ceiling", {x, y})};
  add_ground(ceiling, slab, kTessellation_m);
  scene.source.objects.push_back(std::move(ceiling));

  const Vec3 border{kHalfWall_m, kHalfWall_m, 0};
  const Box room{corner + border, corner + Vec3{kPitch_m[0], kPitch_m[1], 0} - border};
  add_furniture(scene, random, room, x, y);
  tile_cells(scene.cells, room, request.cell_size);
}

}  // namespace

Result<GeneratedScene> generate_rooms(const RoomsRequest& request) {
  if (Status s = check_range("--rooms", request.rooms, 1, kMaxRooms); !s) return s.error();
  const double area = kPitch_m[0] * kPitch_m[1] * request.rooms * request.rooms;
  if (Status s = check_cell_size(request.cell_size, area); !s) return s.error();

  GeneratedScene scene;
  for (int y = 0; y <= request.rooms; ++y)
    for (int x = 0; x <= request.rooms; ++x) add_room(scene, request, x, y);
  return scene;
}

}  // namespace pvsfarm
