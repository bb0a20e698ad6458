#include "tests/adversarial/perturbations.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/random.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

using Key = std::tuple<double, double, double>;
Key key_of(const Vec3& p) { return {p.x, p.y, p.z}; }

bool is_aligned(const Cell& cell) { return cell.origin == Vec3{0} && cell.axes == Cell{}.axes; }

// Whether the frame only exchanges and reverses axes.
bool keeps_axes(const Frame& frame) {
  for (const Vec3& axis : frame)
    if ((axis.x != 0) + (axis.y != 0) + (axis.z != 0) != 1) return false;
  return true;
}

Cell turned(const Cell& cell, const Frame& frame) {
  if (is_aligned(cell) && keeps_axes(frame)) {
    Box box;
    box.add(pvsfarm::apply(frame, cell.lo));
    box.add(pvsfarm::apply(frame, cell.hi));
    return Cell::aligned(box);
  }
  Cell result = cell;
  result.origin = pvsfarm::apply(frame, cell.origin);
  for (Vec3& axis : result.axes) axis = pvsfarm::apply(frame, axis);
  if (dot(cross(result.axes[0], result.axes[1]), result.axes[2]) < 0) {
    result.axes[2] = -result.axes[2];  // right-handed again, the same box
    std::tie(result.lo.z, result.hi.z) = std::pair(-result.hi.z, -result.lo.z);
  }
  return result;
}

Vec3 random_offset(double amount, Random& random) {
  const double x = random.between(-amount, amount), y = random.between(-amount, amount);
  return {x, y, random.between(-amount, amount)};
}

}  // namespace

World world_of(SceneSource source, std::vector<Cell> cells) {
  World world{std::move(source), std::move(cells), {}};
  world.origin.resize(world.source.objects.size());
  std::iota(world.origin.begin(), world.origin.end(), 0u);
  return world;
}

World turned(World world, const Frame& frame) {
  const bool reflects = dot(cross(frame[0], frame[1]), frame[2]) < 0;
  for (SourceObject& object : world.source.objects) {
    transform(object, frame, Vec3{0});
    if (!reflects) continue;
    for (auto& t : object.triangles) std::swap(t[1], t[2]);
  }
  for (Cell& cell : world.cells) cell = turned(cell, frame);
  return world;
}

World moved(World world, const Vec3& offset) {
  for (SourceObject& object : world.source.objects)
    for (Vec3& v : object.vertices) v += offset;
  for (Cell& cell : world.cells) {
    if (is_aligned(cell)) {
      cell.lo += offset;
      cell.hi += offset;
    } else {
      cell.origin += offset;
    }
  }
  return world;
}

World scaled(World world, double factor) {
  for (SourceObject& object : world.source.objects)
    for (Vec3& v : object.vertices) v *= factor;
  for (Cell& cell : world.cells) {
    cell.origin *= factor;
    cell.lo *= factor;
    cell.hi *= factor;
  }
  return world;
}

World renumbered(World world, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = world.source.objects.size(); i > 1; --i) {
    const std::size_t k = random.below(i);
    std::swap(world.source.objects[i - 1], world.source.objects[k]);
    std::swap(world.origin[i - 1], world.origin[k]);
  }
  return world;
}

World jittered(World world, double amount_m, std::uint64_t seed) {
  Random random(seed);
  for (SourceObject& object : world.source.objects) {
    std::map<Key, Vec3> place;
    for (Vec3& v : object.vertices) {
      const auto [at, is_new] = place.try_emplace(key_of(v), Vec3{0});
      if (is_new) at->second = v + random_offset(amount_m, random);
      v = at->second;
    }
  }
  return world;
}

World torn(World world, double amount_m, std::uint64_t seed) {
  Random random(seed);
  for (SourceObject& object : world.source.objects) {
    std::vector<Vec3> vertices;
    for (auto& t : object.triangles)
      for (std::uint32_t& v : t) {
        vertices.push_back(object.vertices[v] + random_offset(amount_m, random));
        v = static_cast<std::uint32_t>(vertices.size() - 1);
      }
    object.vertices = std::move(vertices);
  }
  return world;
}

World twinned(World world) {
  const std::size_t count = world.source.objects.size();
  for (std::size_t i = 0; i < count; ++i) {
    world.source.objects.push_back(world.source.objects[i]);
    world.source.objects.back().name += " twin";
    world.origin.push_back(world.origin[i]);
  }
  return world;
}

World divided(World world) {
  const std::size_t count = world.source.objects.size();
  for (std::size_t i = 0; i < count; ++i) {
    SourceObject part = world.source.objects[i];
    if (part.triangles.size() < 2) continue;
    SourceObject& rest = world.source.objects[i];
    rest.triangles.clear();
    std::vector<std::array<std::uint32_t, 3>> even;
    for (std::size_t t = 0; t < part.triangles.size(); ++t)
      (t % 2 == 0 ? even : rest.triangles).push_back(part.triangles[t]);
    part.triangles = std::move(even);
    part.name += " part";
    world.source.objects.push_back(std::move(part));
    world.origin.push_back(world.origin[i]);
  }
  // Vertices that a part does not use would enlarge its box.
  for (SourceObject& object : world.source.objects) {
    std::map<std::uint32_t, std::uint32_t> number;
    std::vector<Vec3> used;
    for (auto& t : object.triangles)
      for (std::uint32_t& v : t) {
        const auto [at, is_new] = number.try_emplace(v, static_cast<std::uint32_t>(used.size()));
        if (is_new) used.push_back(object.vertices[v]);
        v = at->second;
      }
    object.vertices = std::move(used);
  }
  return world;
}

World flattened(World world, double share) {
  for (SourceObject& object : world.source.objects) {
    Box box = box_of(object);
    const Vec3 size = box.size();
    int thin = 0;
    for (int a = 1; a < 3; ++a)
      if (size[a] < size[thin]) thin = a;
    double second = size[(thin + 1) % 3];
    second = std::min(second, size[(thin + 2) % 3]);
    const bool is_box =
        std::all_of(object.vertices.begin(), object.vertices.end(), [&box](const Vec3& v) {
          for (int a = 0; a < 3; ++a)
            if (v[a] != box.lo[a] && v[a] != box.hi[a]) return false;
          return true;
        });
    if (!is_box || object.triangles.size() < 12 || !(size[thin] < share * second)) continue;
    box.lo[thin] = box.hi[thin] = box.center()[thin];
    const SourceObject flat = box_object(object.name, box);
    object.vertices = flat.vertices;
    object.triangles = flat.triangles;
    object.two_sided = true;
  }
  return world;
}

namespace {

double distance_to(const Box& box, const Vec3& p) {
  Vec3 toward{0};
  for (int a = 0; a < 3; ++a) toward[a] = std::max({0.0, box.lo[a] - p[a], p[a] - box.hi[a]});
  return length(toward);
}

Box nearest_occluder(const SceneSource& source, const Vec3& p) {
  Box nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const SourceObject& object : source.objects) {
    if (!object.occluder || object.dynamic) continue;
    const Box box = box_of(object);
    const double distance = distance_to(box, p);
    if (!(distance < least)) continue;
    least = distance;
    nearest = box;
  }
  return nearest;
}

// The cell's box moved so that along `axis` it ends exactly where `box` begins, or the reverse.
void bring_to_touch(Box& cell, const Box& box, int axis) {
  const double size = cell.hi[axis] - cell.lo[axis];
  if (cell.center()[axis] < box.center()[axis]) {
    cell.hi[axis] = box.lo[axis];
    cell.lo[axis] = cell.hi[axis] - size;
  } else {
    cell.lo[axis] = box.hi[axis];
    cell.hi[axis] = cell.lo[axis] + size;
  }
}

void center_on(Box& cell, const Box& box, int axis, double most) {
  const double size = std::min(cell.hi[axis] - cell.lo[axis], most);
  cell.lo[axis] = box.center()[axis] - size / 2;
  cell.hi[axis] = cell.lo[axis] + size;
}

Box brought_to(Box cell, const Box& box, Contact contact) {
  constexpr double kAnySize = std::numeric_limits<double>::infinity();
  // The axes, those in which cell and box are farthest apart first.
  std::array<int, 3> axes{0, 1, 2};
  const auto gap = [&](int a) {
    return std::max(box.lo[a] - cell.center()[a], cell.center()[a] - box.hi[a]);
  };
  std::sort(axes.begin(), axes.end(),
            [&](int a, int b) { return std::tuple(gap(b), a) < std::tuple(gap(a), b); });
  const int touching = contact == Contact::kInside   ? 0
                       : contact == Contact::kEdge   ? 2
                       : contact == Contact::kCorner ? 3
                                                     : 1;
  for (int k = 0; k < 3; ++k) {
    if (k < touching)
      bring_to_touch(cell, box, axes[k]);
    else
      center_on(cell, box, axes[k],
                contact == Contact::kInside ? box.size()[axes[k]] / 2 : kAnySize);
  }
  if (contact != Contact::kCut) return cell;
  const int a = axes[0];
  const double shift = (cell.hi[a] - cell.lo[a]) / 2;
  const double way = cell.center()[a] < box.center()[a] ? shift : -shift;
  cell.lo[a] += way;
  cell.hi[a] += way;
  return cell;
}

}  // namespace

World in_contact(World world, Contact contact) {
  for (Cell& cell : world.cells) {
    const Vec3 center = cell.center(), half = cell.half();
    const Box level = is_aligned(cell) ? Box{cell.lo, cell.hi} : Box{center - half, center + half};
    cell = Cell::aligned(brought_to(level, nearest_occluder(world.source, center), contact));
  }
  return world;
}

}  // namespace pvsfarm
