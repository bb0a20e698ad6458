// Vectors: the only include of GLM. Everything is double precision, in scene units ("metres"),
// in a right-handed frame with z up; a scene that is y up in its file is turned on import.
#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace pvsfarm {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using glm::cross;
using glm::dot;
using glm::length;

}  // namespace pvsfarm
