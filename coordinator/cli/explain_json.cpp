#include <nlohmann/json.hpp>

#include "coordinator/cli/explain_text.hpp"
#include "coordinator/cli/file_cell.hpp"
#include "coordinator/merger/round_figures.hpp"

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kVerdicts[] = {"seen", "hidden", "open"};

// Turned to the file's coordinates.
class Turned {
 public:
  Turned(UpAxis up, const std::vector<StoreObject>& objects) : up_(up), objects_(objects) {}

  Json of(const Vec3& v) const {
    const Vec3 turned = file_from_internal(up_, v) + 0.0;  // no -0
    return {turned.x, turned.y, turned.z};
  }
  Json of(const Box& box) const {
    const Box turned = file_box(up_, box);
    return {{turned.lo.x, turned.lo.y, turned.lo.z}, {turned.hi.x, turned.hi.y, turned.hi.z}};
  }
  Json of(const SightLine& line) const {
    return {{"eye", of(line.eye)}, {"point", of(line.point)}};
  }
  Json of(const Cell& cell) const {
    const FileCell turned = file_cell(up_, cell);
    const auto plain = [](const Vec3& v) { return Json{v.x, v.y, v.z}; };
    return {{"center", plain(turned.center)},
            {"axes", {plain(turned.axes[0]), plain(turned.axes[1]), plain(turned.axes[2])}},
            {"half", plain(turned.half)}};
  }
  Json of(ObjectId id) const {
    return {{"id", index_of(id)}, {"name", objects_[index_of(id)].name}};
  }
  Json of(const PlanePlace& plane) const {
    return {{"origin", of(plane.origin)},
            {"u", of(plane.u)},
            {"v", of(plane.v)},
            {"away", of(plane.away)},
            {"x", {plane.x0, plane.x1}},
            {"y", {plane.y0, plane.y1}},
            {"distance", plane.distance_m},
            {"resolution", plane.resolution_px}};
  }
  Json of(const ExplainFinding::Part& part) const {
    Json blockers = Json::array();
    for (const Blocker& blocker : part.blockers) {
      Json owners = Json::array();
      for (const ObjectId owner : blocker.owners) owners.push_back(of(owner));
      blockers.push_back({{"share", blocker.share}, {"owners", owners}});
    }
    return {{"box", of(part.box)},       {"objects", part.objects}, {"plane", of(part.plane)},
            {"depth", part.depth_m},     {"pixels", part.pixels},   {"covered", part.covered},
            {"by_lines", part.by_lines}, {"blockers", blockers}};
  }
  Json of(const Explanation::Piece& piece) const {
    const ExplainFinding& f = piece.finding;
    Json out = of(piece.cell);
    out["verdict"] = kVerdicts[static_cast<int>(f.verdict)];
    out["method"] = to_string(f.method);
    if (f.verdict == Verdict::kSeen) {
      out["found_afterwards"] = f.found_afterwards;
      out["line"] = of(f.line);
      out["passed"] = Json::array();
      for (const PassedBy& passed : f.passed) {
        Json by = of(passed.object);
        by["clearance"] = passed.clearance_m;
        by["at"] = of(passed.at);
        out["passed"].push_back(by);
      }
    }
    out["parts"] = Json::array();
    for (const auto& part : f.parts) out["parts"].push_back(of(part));
    if (f.verdict == Verdict::kHidden) {
      out["lines_checked"] = f.lines_checked;
      out["unblocked"] = Json::array();
      for (const SightLine& line : f.unblocked) out["unblocked"].push_back(of(line));
    }
    RoundSums rounds;
    rounds.add(f.rounds);
    out["rounds"] = Json::array();
    for (const RoundFigures& round : rounds.all())
      out["rounds"].push_back(Json::parse(json_of(round)));
    return out;
  }

 private:
  UpAxis up_;
  const std::vector<StoreObject>& objects_;
};

}  // namespace

std::string json_of(const Explanation& explanation, UpAxis up,
                    const std::vector<StoreObject>& objects) {
  const Turned turned(up, objects);
  Json pieces = Json::array();
  for (const Explanation::Piece& piece : explanation.pieces) pieces.push_back(turned.of(piece));
  const Json out{{"object", turned.of(explanation.object)},
                 {"cell", explanation.asked.index},
                 {"visible", explanation.visible},
                 {"settled_by_cell", explanation.node.index},
                 {"agrees", explanation.agrees},
                 {"pieces", pieces}};
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace pvsfarm
