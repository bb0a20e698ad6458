// Small objects for tests: boxes, convex polygons, and where they stand.
#pragma once

#include <span>
#include <string>

#include "common/geometry/box.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// What an object is for in a test scene.
enum class Role { kBoth, kOnlyOccludes, kOnlyOccluded };

void set_role(SourceObject& object, Role role);

// A closed box, 12 triangles, outward oriented; a box that is flat along one axis becomes one
// rectangle of 2 triangles. Requires: not flat along two axes.
SourceObject box_object(std::string name, const Box& box, Role role = Role::kBoth);

// A convex polygon as a fan of triangles, counter-clockwise seen from its front.
SourceObject polygon_object(std::string name, std::span<const Vec3> points,
                            Role role = Role::kBoth);

// Appends the triangles of `part` to `object`.
void append(SourceObject& object, const SourceObject& part);

// The box of an object's vertices.
Box box_of(const SourceObject& object);

}  // namespace pvsfarm
