// Exact visibility for scenes whose coordinates are decimals of few digits: segments against convex
// polygons in integers, no rounding anywhere.
//
// [units] 1e-6 scene units. [limit] differences of coordinates below 2^40 units, so that every
// determinant fits 128 bits.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/box.hpp"

namespace pvsfarm {

struct ExactPoint {
  std::int64_t v[3];
  friend bool operator==(const ExactPoint&, const ExactPoint&) = default;
};

// Requires: every coordinate is the double nearest to a decimal of at most 6 places.
ExactPoint exact(const Vec3& p);

// What a half-open segment [from, to) does to matter.
enum class Sight {
  kClear,    // does not meet it
  kBlocked,  // meets it; touching is meeting, matter is closed
  kGrazing,  // lies in the plane of a polygon: this test does not decide
};

// A convex polygon with its border, seen from both sides.
class ExactPolygon {
 public:
  explicit ExactPolygon(const std::vector<Vec3>& points);
  Sight sight(const ExactPoint& from, const ExactPoint& to) const;

 private:
  std::vector<ExactPoint> points_;
};

// The six faces of a box, or the one rectangle of a flat box.
std::vector<std::vector<Vec3>> face_loops(const Box& box);
std::vector<ExactPolygon> exact_faces(const Box& box);

// kClear if all are clear, else kBlocked if one blocks, else kGrazing.
Sight sight(const std::vector<ExactPolygon>& matter, const ExactPoint& from, const ExactPoint& to);

// Proof of hiddenness (strong occlusion): one convex polygon blocks every segment from a corner of
// `cell` to a corner of `occludee`, so it blocks every segment between them.
bool hides(const ExactPolygon& polygon, const Box& cell, const Box& occludee);

}  // namespace pvsfarm
