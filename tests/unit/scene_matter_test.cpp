// Whatever the mesh, an occluder never claims more than matter: points of solids have a winding
// number, and segments through polygons meet a triangle.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/unit/scene_shapes.hpp"

namespace pvsfarm {
namespace {

// Turns of the object's mesh around `p`: the sum of its triangles' solid angles (van Oosterom and
// Strackee 1983) over the sphere's.
double winding_number(const Scene& scene, ObjectId id, const Vec3& p) {
  double turns = 0;
  for (const Triangle& t : scene.triangles(id)) {
    const Vec3 a = scene.vertices()[t.vertex[0]] - p, b = scene.vertices()[t.vertex[1]] - p,
               c = scene.vertices()[t.vertex[2]] - p;
    const double la = length(a), lb = length(b), lc = length(c);
    turns += std::atan2(dot(a, cross(b, c)),
                        la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return turns / (2 * M_PI);
}

bool in_matter(const Scene& scene, const Occluder& solid, const Vec3& p) {
  const auto owners = scene.owners(solid);
  return std::any_of(owners.begin(), owners.end(), [&](ObjectId id) {
    return std::abs(winding_number(scene, id, p)) > 0.4;  // 1/2 on the surface, to rounding
  });
}

// A random point of the hull, now and then near a corner or an edge of it.
Vec3 random_mix(std::span<const Vec3> points, Random& random) {
  Vec3 sum(0.0);
  double total = 0;
  const double sharpness = random.between(1, 12);
  for (const Vec3& p : points) {
    const double weight = std::pow(random.unit(), sharpness);
    sum += p * weight;
    total += weight;
  }
  return total > 0 ? sum / total : points[0];
}

void expect_solid_in_matter(const Scene& scene, const Occluder& solid, Random& random) {
  std::vector<Vec3> points(scene.points(solid).begin(), scene.points(solid).end());
  const double depth = solid.box.size().z * random.between(0.1, 3);
  for (std::uint32_t i = 0; i < solid.base_points; ++i)
    points.push_back(points[i] - Vec3(0, 0, depth));  // phantom matter, below the ground only
  for (int k = 0; k < 60; ++k) {
    const Vec3 p = random_mix(points, random);
    if (p.z <= scene.ground()) continue;
    ASSERT_TRUE(in_matter(scene, solid, p)) << p.x << ' ' << p.y << ' ' << p.z;
  }
}

// Where the line from `from` through `through` meets a triangle of `id`, nearest to `through`,
// as a distance from it.
double miss_distance(const Scene& scene, ObjectId id, const Vec3& from, const Vec3& through) {
  const Vec3 d = through - from;
  double nearest = 1e300;
  for (const Triangle& t : scene.triangles(id)) {
    const Vec3 a = scene.vertices()[t.vertex[0]] - from, b = scene.vertices()[t.vertex[1]] - from,
               c = scene.vertices()[t.vertex[2]] - from;
    const double u = dot(d, cross(b, c)), v = dot(d, cross(c, a)), w = dot(d, cross(a, b));
    const double sum = u + v + w, slack = 1e-9 * std::abs(sum);
    if (sum == 0) continue;
    const bool hit =
        (u >= -slack && v >= -slack && w >= -slack) || (u <= slack && v <= slack && w <= slack);
    if (!hit) continue;
    const Vec3 x = (a * u + b * v + c * w) / sum;
    nearest = std::min(nearest, length(x - d));
  }
  return nearest;
}

void expect_polygon_in_matter(const Scene& scene, const Occluder& polygon, Random& random) {
  const auto loop = scene.points(polygon);
  Vec3 normal(0.0), middle(0.0);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    normal += cross(loop[i] - loop[0], loop[(i + 1) % loop.size()] - loop[0]);
    middle += loop[i] / static_cast<double>(loop.size());
  }
  normal = normal / length(normal);
  const double size = length(polygon.box.size());
  for (int k = 0; k < 30; ++k) {
    // Off the boundary by more than flatness and rounding, so that every view of it is inside.
    const Vec3 p = middle + (random_mix(loop, random) - middle) * 0.999;
    const Vec3 from = p + normal * (size * random.between(0.5, 2) * (k % 2 ? 1 : -1)) +
                      Vec3(random.unit(), random.unit(), random.unit()) * (size * 0.3);
    ASSERT_LE(miss_distance(scene, scene.owners(polygon)[0], from, p),
              10 * polygon.flatness + 1e-9 * (size + length(p)));
  }
}

Vec3 to_float(const Vec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

// One of many kinds of object, rounded to float, somewhere; some broken on purpose.
SourceObject random_object(Random& random) {
  const Vec3 place(random.between(-900, 900), random.between(-900, 900), 0);
  const Vec3 size(random.between(0.05, 20), random.between(0.05, 20), random.between(0.05, 30));
  SourceObject object;
  switch (random.below(5)) {
    case 0:
      object = box_object("box", {{0, 0, 0}, size});
      break;
    case 1:
      object = prism_object(
          "tower",
          regular_ring(3 + static_cast<int>(random.below(20)), random.between(0.3, 9), {0, 0}), 0,
          size.z, random.below(2) ? 1 : random.between(0.3, 1.4));
      break;
    case 2:  // a house with a gable: a box whose roof edge is pulled up
      object = box_object("gable", {{0, 0, 0}, size});
      for (const int k : {4, 5}) object.vertices[k].y = size.y / 2;
      for (const int k : {6, 7}) object.vertices[k].y = size.y / 2;
      break;
    case 3: {  // a building with wings, and now and then a courtyard
      std::vector<std::array<int, 2>> squares{{0, 0}};
      for (int k = 0; k < 8; ++k) {
        std::array<int, 2> next = squares[random.below(squares.size())];
        next[random.below(2)] += random.below(2) ? 1 : -1;
        if (std::find(squares.begin(), squares.end(), next) == squares.end())
          squares.push_back(next);
      }
      object = block_object("wings", squares, 0, size.z);
      for (Vec3& p : object.vertices) p = Vec3(p.x * size.x, p.y * size.x, p.z);
      break;
    }
    default:
      object = joined(box_object("pair", {{0, 0, 0}, size}),
                      box_object("", {{size.x, 0, 0}, size + Vec3(size.x, 0, 3)}));
  }
  object = turned(object, random.below(3) ? random.between(0, 6.3) : 0, place);
  if (random.below(3) == 0) {  // leaning, so that nothing is level
    for (Vec3& p : object.vertices) p = to_float({p.x + 0.1 * p.z, p.y, p.z + 0.01 * (p.x + 1000)});
  }
  if (random.below(4) == 0) {  // dented
    Vec3& p = object.vertices[random.below(object.vertices.size())];
    p = to_float(p + Vec3(random.between(-1, 1), random.between(-1, 1), random.between(0, 1)));
  }
  if (random.below(6) == 0) object.triangles.pop_back();
  object.two_sided = random.below(2) != 0;
  return object;
}

}  // namespace

TEST(OccludersOfRandomMeshes, lie_in_matter) {
  std::size_t solids = 0, extended = 0, merged = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<SourceObject> objects;
    for (int i = 0; i < 20; ++i) objects.push_back(random_object(random));
    const auto scene = scene_of(std::move(objects));
    for (const Occluder& occluder : scene->occluders()) {
      if (occluder.shape == OccluderShape::kSolid) {
        expect_solid_in_matter(*scene, occluder, random);
        ++solids;
        extended += occluder.base_points > 0;
      } else {
        expect_polygon_in_matter(*scene, occluder, random);
        merged += occluder.point_count > 3;
      }
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  EXPECT_GT(solids, 200u) << "the test must not be empty";
  EXPECT_GT(extended, 20u);
  EXPECT_GT(merged, 500u);
}

// A city of touching houses: joined rows lie in the union of their houses.
TEST(OccludersOfRandomMeshes, joined_rows_lie_in_their_houses) {
  Random random(7);
  std::vector<SourceObject> objects;
  for (int row = 0; row < 4; ++row) {
    double x = 0;
    for (int i = 0; i < 8; ++i) {
      const double end = x + random.between(5, 12), y = 30 * row;
      objects.push_back(box_object(
          "house", {{x, y, 0}, {end, y + random.between(10, 14), random.between(9, 35)}}));
      x = random.below(5) ? end : end + 1;
    }
  }
  const auto scene = scene_of(std::move(objects));
  int rows = 0;
  for (const Occluder& solid : solids_of(*scene)) {
    rows += solid.owner_count > 1;
    expect_solid_in_matter(*scene, solid, random);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(rows, 10);
}

}  // namespace pvsfarm
