#include "tests/property/lattice_worlds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/property/random_shapes.hpp"
#include "tests/support/make_objects.hpp"
#include "tests/support/make_solids.hpp"

namespace pvsfarm {
namespace {

constexpr int kOccludees = 10, kCells = 3;

bool is_box_or_plate(const Box& box) {
  const Vec3 size = box.size();
  return (size.x == 0) + (size.y == 0) + (size.z == 0) <= 1;
}

class Builder {
 public:
  explicit Builder(std::uint64_t seed)
      : random_(seed), reach_(in(3, 12)), ground_(chance(0.3)), ground_z_(in(-2, 0)) {}

  LatticeWorld make() {
    if (chance(0.2)) room();
    const int count = in(1, 6);
    for (int k = 0; k < count; ++k) {
      add_something();
      if (chance(0.1)) double_something();
    }
    for (int k = 0; k < kOccludees; ++k) add_occludee();
    const double grow = in(1, 3);
    for (SourceObject& object : world_.source.objects)
      for (Vec3& v : object.vertices) v *= grow;
    for (int k = 0; k < kCells; ++k) add_cell();
    if (ground_) level();
    displace();
    return std::move(world_);
  }

 private:
  bool chance(double p) { return random_.unit() < p; }
  int in(int lo, int hi) {
    return lo + static_cast<int>(random_.below(static_cast<std::uint64_t>(hi - lo + 1)));
  }
  int any(int count) { return in(0, count - 1); }
  Vec3 point() {
    Vec3 p;
    for (int a = 0; a < 3; ++a) p[a] = in(-reach_, reach_);
    return p;
  }
  Box box() {
    for (;;) {
      Box box;
      box.add(point());
      box.add(point());
      if (is_box_or_plate(box)) return box;
    }
  }
  std::vector<SourceObject>& objects() { return world_.source.objects; }
  const SourceObject& an_object() { return objects()[any(static_cast<int>(objects().size()))]; }

  void add(SourceObject object, Role role) {
    if (object.triangles.empty()) return;
    object.name = "object " + std::to_string(objects().size());
    set_role(object, role);
    objects().push_back(std::move(object));
  }
  // Both sides or one, and either of them the front.
  void add_matter(SourceObject object) {
    object.two_sided = chance(0.55);
    if (chance(0.2)) turn_inside_out(object);
    const int role = any(4);
    add(std::move(object), role < 2    ? Role::kBoth
                           : role == 2 ? Role::kOnlyOccludes
                                       : Role::kOnlyOccluded);
    if (!objects().empty() && chance(0.03)) objects().back().dynamic = true;
  }

  void add_something() {
    switch (any(7)) {
      case 0:
        return cubes();
      case 1:
        return sheet();
      case 2:
        return loose_triangles();
      case 3:
      case 4:
        return plate();
      case 5: {
        SourceObject object = box_object("", box());
        if (chance(0.2)) append(object, box_object("", box()));
        return add_matter(std::move(object));
      }
      default:
        return tetrahedra();
    }
  }

  void double_something() {
    if (objects().empty()) return;
    SourceObject copy = an_object();
    copy.two_sided = chance(0.5);
    add_matter(std::move(copy));
  }

  // What bounds a heap of cubes, edges of four faces and corners of one point included.
  void cubes() {
    constexpr int kMost = 5;
    const int n = in(2, kMost);
    bool full[kMost + 2][kMost + 2][kMost + 2] = {};
    const double share = random_.between(0.4, 1), lost = chance(0.7) ? 0 : 0.05, step = in(1, 6);
    for (int k = 0; k < n * n * n; ++k)
      full[1 + k % n][1 + k / n % n][1 + k / n / n] = chance(share);
    const Vec3 at = point();
    SourceObject object;
    for (int k = 0; k < n * n * n; ++k)
      for (int side = 0; side < 6; ++side) {
        const int cube[3] = {1 + k % n, 1 + k / n % n, 1 + k / n / n};
        int next[3] = {cube[0], cube[1], cube[2]};
        next[side / 2] += side % 2 == 0 ? -1 : 1;
        if (!full[cube[0]][cube[1]][cube[2]] || full[next[0]][next[1]][next[2]] || chance(lost))
          continue;
        const Vec3 corner = at + Vec3(cube[0], cube[1], cube[2]) * step;
        append(object, fine_box({corner, corner + Vec3(step)}, 1, 1 << side));
      }
    add_matter(std::move(object));
  }

  void sheet() {
    const int n = in(2, 5), axis = any(3), at = in(-reach_, reach_), step = in(1, 3);
    const int u0 = in(-reach_, 0), v0 = in(-reach_, 0);
    const bool bumpy = chance(0.3);
    SourceObject object;
    add_sheet(object, n, [&](int i, int j) {
      Vec3 p;
      p[axis] = at + (bumpy && i % n != 0 && j % n != 0 ? any(2) : 0);
      p[(axis + 1) % 3] = u0 + i * step;
      p[(axis + 2) % 3] = v0 + j * step;
      return p;
    });
    const double holes = chance(0.5) ? 0 : random_.between(0, 0.3);
    std::erase_if(object.triangles, [&](const auto&) { return chance(holes); });
    if (!object.triangles.empty() && chance(0.3)) damage(object, random_);
    add_matter(std::move(object));
  }

  void loose_triangles() {
    const int count = in(1, 5);
    std::vector<Vec3> corners;
    for (int k = 0; k < count + 2; ++k) corners.push_back(point());
    SourceObject object;
    for (int k = 0; k < 3 * count; ++k) object.vertices.push_back(corners[any(count + 2)]);
    for (std::uint32_t k = 0; k < 3 * static_cast<std::uint32_t>(count); k += 3)
      object.triangles.push_back({k, k + 1, k + 2});
    add_matter(std::move(object));
  }

  // Large along two axes, of little or no thickness; of one piece or of many.
  void plate() {
    Box wall = box();
    const int axis = any(3);
    if (chance(0.5))
      for (int a = 0; a < 3; ++a) {
        if (a == axis) continue;
        if (chance(0.7)) wall.lo[a] = -reach_ * in(1, 3);
        if (chance(0.7)) wall.hi[a] = reach_ * in(1, 3);
      }
    if (chance(0.7)) wall.hi[axis] = wall.lo[axis];
    if (!is_box_or_plate(wall)) return;
    const Vec3 size = wall.size();
    if (size.x == 0 || size.y == 0 || size.z == 0 || chance(0.5))
      return add_matter(box_object("", wall));
    add_matter(fine_box(wall, in(1, 5), ground_ && chance(0.6) ? kAllSides & ~kLowZ : kAllSides));
  }

  // Closed, some of them sharing a face.
  void tetrahedra() {
    SourceObject object;
    const int count = in(1, 3);
    for (int k = 0; k < count; ++k) {
      const auto base = static_cast<std::uint32_t>(object.vertices.size());
      Vec3 p[4] = {point(), point(), point(), point()};
      if (k > 0 && chance(0.7)) std::copy_n(object.vertices.end() - 4, 3, p);
      if (dot(cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) < 0) std::swap(p[1], p[2]);
      object.vertices.insert(object.vertices.end(), p, p + 4);
      constexpr std::uint32_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
      for (const auto& f : kFaces)
        object.triangles.push_back({base + f[0], base + f[1], base + f[2]});
    }
    add_matter(std::move(object));
  }

  // Around all cells.
  void room() {
    Box walls = box();
    walls.lo = glm::min(walls.lo, Vec3(-reach_));
    walls.hi = glm::max(walls.hi, Vec3(reach_));
    SourceObject object = fine_box(walls, in(1, 6), sides_but_perhaps_one(random_, 0.4));
    if (chance(0.5)) turn_inside_out(object);
    object.two_sided = chance(0.6);
    add(std::move(object), Role::kOnlyOccludes);
  }

  // Behind some triangle, as a rule.
  void add_occludee() {
    const double half = chance(0.5) ? 0.25 : 0.5;
    Vec3 middle = point() * static_cast<double>(in(1, 2));
    if (!objects().empty() && chance(0.7)) {
      const SourceObject& object = an_object();
      const auto& t = object.triangles[any(static_cast<int>(object.triangles.size()))];
      middle = (object.vertices[t[0]] + object.vertices[t[1]] + object.vertices[t[2]]) / 3.0;
      middle *= chance(0.5) ? 2 : random_.between(1, 3);
      if (chance(0.7)) middle = glm::round(middle * 2.0) / 2.0;
    }
    Box small{middle - Vec3(half), middle + Vec3(half)};
    if (chance(0.2)) small.hi[any(3)] = middle[0];
    for (int a = 0; a < 3; ++a)
      if (small.hi[a] < small.lo[a]) std::swap(small.lo[a], small.hi[a]);
    if (chance(0.2)) small = box();
    if (!is_box_or_plate(small)) return;
    add(box_object("", small), chance(0.2) ? Role::kBoth : Role::kOnlyOccluded);
    objects().back().dynamic = chance(0.05);
  }

  void add_cell() {
    Cell cell;
    for (int a = 0; a < 3; ++a) {
      cell.lo[a] = in(-3, 2);
      cell.hi[a] = cell.lo[a] + (chance(0.9) ? in(1, 3) : 0);
    }
    if (chance(0.3)) {
      const double eighth = std::numbers::pi / 4;
      cell.axes = chance(0.5) ? frame_about_z(in(0, 8) * eighth) : random_frame(random_);
      if (chance(0.5)) cell.origin = point();
      if (chance(0.3))  // at right angles up to kAxisTolerance
        for (Vec3& axis : cell.axes) axis += Vec3(any(3) - 1, any(3) - 1, any(3) - 1) * 2e-7;
    } else if (chance(0.3)) {  // the world's axes, in any order, perhaps left-handed
      std::swap(cell.axes[any(3)], cell.axes[any(3)]);
      for (Vec3& axis : cell.axes)
        if (chance(0.5)) axis = -axis;
    }
    world_.cells.push_back(cell);
  }

  // Nearly nothing below the ground, and most cells on it or above it.
  void level() {
    for (SourceObject& object : objects())
      for (Vec3& v : object.vertices)
        if (!chance(0.02)) v.z = std::max(v.z, ground_z_);
    for (Cell& cell : world_.cells) {
      if (cell.axes != Cell{}.axes && chance(0.5)) cell.axes = frame_about_z(random_.between(0, 7));
      if (chance(0.2)) continue;
      cell.origin.z = 0;
      cell.lo.z = std::max(cell.lo.z, ground_z_);
      cell.hi.z = std::max(cell.hi.z, cell.lo.z + (chance(0.9) ? 1 : 0));
    }
  }

  void displace() {
    const double scales[] = {1, 1, 1, 0.1, 1e-3, 1000, 1.0 / 3}, steps[] = {1, 100, 1e5, 1e7};
    const double scale = scales[any(7)], step = scale * steps[any(4)];
    Vec3 offset(0);
    if (chance(0.4)) offset = {step * in(-3, 3), step * in(-3, 3), ground_ ? 0 : step * in(-3, 3)};
    const bool turned = !ground_ && chance(0.15);
    const Frame frame = turned ? random_frame(random_) : frame_about_z(0);
    const auto displaced = [&](const Vec3& p) {
      return (turned ? pvsfarm::apply(frame, p) : p) * scale + offset;
    };
    for (SourceObject& object : objects())
      for (Vec3& v : object.vertices) v = displaced(v);
    for (Cell& cell : world_.cells) {
      if (!turned && cell.axes == Cell{}.axes && cell.origin == Vec3(0)) {
        cell.lo = displaced(cell.lo);
        cell.hi = displaced(cell.hi);
        continue;
      }
      cell.lo *= scale;
      cell.hi *= scale;
      cell.origin = displaced(cell.origin);
      if (turned)
        for (Vec3& axis : cell.axes) axis = pvsfarm::apply(frame, axis);
    }
  }

  Random random_;
  int reach_;
  bool ground_;
  double ground_z_;
  LatticeWorld world_;
};

}  // namespace

LatticeWorld lattice_world(std::uint64_t seed) { return Builder(seed).make(); }

}  // namespace pvsfarm
