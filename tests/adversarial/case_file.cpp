#include "tests/adversarial/case_file.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/check.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

using nlohmann::json;

Vec3 point_of(const json& j) { return {j.at(0), j.at(1), j.at(2)}; }
Box box_of_json(const json& j) {
  return {{j.at(0), j.at(1), j.at(2)}, {j.at(3), j.at(4), j.at(5)}};
}

Must must_of(const std::string& text) {
  if (text == "VISIBLE") return Must::kVisible;
  if (text == "HIDDEN") return Must::kHidden;
  PVS_CHECK_EQ(text, "EITHER");
  return Must::kEither;
}

std::vector<VisibilityCase> read_cases() {
  std::ifstream file(PVSFARM_CASES_JSON);
  PVS_CHECK(file.good());
  std::vector<VisibilityCase> cases;
  for (const json& j : json::parse(file)) {
    VisibilityCase c{.id = j.at("id"),
                     .note = j.at("note"),
                     .must = must_of(j.at("must")),
                     .cell = box_of_json(j.at("cell")),
                     .occludee = box_of_json(j.at("occludee")),
                     .occluders = {},
                     .plane_z = {},
                     .witness = {}};
    if (const json& z = j.at("plane_z"); !z.is_null()) c.plane_z = z;
    for (const json& o : j.at("occluders")) {
      CaseOccluder occluder;
      if (o.contains("box"))
        occluder.box = box_of_json(o.at("box"));
      else
        for (const json& p : o.at("poly")) occluder.polygon.push_back(point_of(p));
      c.occluders.push_back(std::move(occluder));
    }
    if (const json& w = j.at("witness"); !w.is_null())
      c.witness.emplace(point_of(w.at(0)), point_of(w.at(1)));
    cases.push_back(std::move(c));
  }
  return cases;
}

Vec3 renamed(const Vec3& p, int placement) {
  const int shift = placement % 3;
  const double sign = placement < 3 ? 1 : -1;
  Vec3 r;
  for (int a = 0; a < 3; ++a) r[(a + shift) % 3] = sign * p[a];
  return r;
}

Box renamed(const Box& box, int placement) {
  Box r;
  r.add(renamed(box.lo, placement));
  r.add(renamed(box.hi, placement));
  return r;
}

// `move` maps points, `move_box` makes the object of a box.
template <class Move, class MoveBox>
PlacedCase set_up(const VisibilityCase& c, Move&& move, MoveBox&& move_box) {
  PlacedCase p;
  bool is_occluder_too = false;
  for (const CaseOccluder& o : c.occluders) {
    SourceObject object;
    if (o.box) {
      object = move_box(*o.box);
      const bool same = o.box->lo == c.occludee.lo && o.box->hi == c.occludee.hi;
      if (same) is_occluder_too = true, p.occludee = p.source.objects.size();
      set_role(object, same ? Role::kBoth : Role::kOnlyOccludes);
    } else {
      std::vector<Vec3> points;
      for (const Vec3& v : o.polygon) points.push_back(move(v));
      object = polygon_object("", points, Role::kOnlyOccludes);
    }
    object.name = "occluder " + std::to_string(p.source.objects.size());
    p.source.objects.push_back(std::move(object));
  }
  if (is_occluder_too) return p;
  p.occludee = static_cast<std::uint32_t>(p.source.objects.size());
  p.source.objects.push_back(move_box(c.occludee));
  p.source.objects.back().name = "occludee";
  set_role(p.source.objects.back(), Role::kOnlyOccluded);
  return p;
}

}  // namespace

const std::vector<VisibilityCase>& all_cases() {
  static const std::vector<VisibilityCase> cases = read_cases();
  return cases;
}

std::vector<VisibilityCase> cases_that(Must must) {
  std::vector<VisibilityCase> some;
  for (const VisibilityCase& c : all_cases())
    if (c.must == must) some.push_back(c);
  return some;
}

std::vector<std::vector<Vec3>> occluder_polygons(const VisibilityCase& c) {
  std::vector<std::vector<Vec3>> polygons;
  for (const CaseOccluder& o : c.occluders) {
    if (o.box)
      for (std::vector<Vec3>& face : face_loops(*o.box)) polygons.push_back(std::move(face));
    else
      polygons.push_back(o.polygon);
  }
  return polygons;
}

std::vector<ExactPolygon> exact_matter(const VisibilityCase& c) {
  std::vector<ExactPolygon> matter;
  for (const auto& polygon : occluder_polygons(c)) matter.emplace_back(polygon);
  return matter;
}

PlacedCase placed(const VisibilityCase& c, int placement) {
  PlacedCase p = set_up(
      c, [&](const Vec3& v) { return renamed(v, placement); },
      [&](const Box& box) { return box_object("", renamed(box, placement)); });
  p.cell = Cell::aligned(renamed(c.cell, placement));
  return p;
}

PlacedCase turned(const VisibilityCase& c) {
  // Two turns by the angle of the 3-4-5 triangle: columns are images of the axes.
  const Vec3 x{0.8, 0.6, 0}, y{-0.48, 0.64, 0.6}, z{0.36, -0.48, 0.8};
  const auto turn = [&](const Vec3& p) { return x * p.x + y * p.y + z * p.z; };
  PlacedCase p = set_up(c, turn, [&](const Box& box) {
    SourceObject object = box_object("", box);
    for (Vec3& v : object.vertices) v = turn(v);
    return object;
  });
  p.cell = Cell{.axes = {x, y, z}, .lo = c.cell.lo, .hi = c.cell.hi};
  return p;
}

}  // namespace pvsfarm
