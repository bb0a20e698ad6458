#include "coordinator/cli/explain_picture.hpp"

#include <algorithm>

#include "coordinator/cli/explain_text.hpp"
#include "coordinator/cli/text.hpp"
#include "coordinator/picture/sight_plan.hpp"

namespace pvsfarm {
namespace {

Vec2 from_above(const Vec3& p) { return {p.x, p.y}; }

std::array<Vec2, 4> rectangle_of(const PlanePlace& plane) {
  const auto at = [&](double x, double y) {
    return from_above(plane.origin + plane.u * x + plane.v * y);
  };
  return {at(plane.x0, plane.y0), at(plane.x1, plane.y0), at(plane.x1, plane.y1),
          at(plane.x0, plane.y1)};
}

class Planner {
 public:
  Planner(const Explanation& explanation, const std::vector<StoreObject>& objects)
      : e_(explanation), objects_(objects) {}

  SightPlan plan() {
    const StoreObject& object = objects_[index_of(e_.object)];
    plan_.object = object.box;
    plan_.object_name = ascii(std::string(object.name));
    plan_.hidden = !e_.visible;
    for (const StoreObject& other : objects_) plan_.surroundings.push_back(other.box);
    for (const Explanation::Piece& piece : e_.pieces) add(piece);
    std::stable_sort(shares_.begin(), shares_.end(),
                     [](const Shares& a, const Shares& b) { return a.share > b.share; });
    for (const Shares& shares : shares_) add(shares);
    title(plan_.object_name);
    return std::move(plan_);
  }

 private:
  struct Shares {
    std::vector<ObjectId> owners;
    double share = 0;  // the largest of any plane
  };

  void add(const Explanation::Piece& piece) {
    plan_.cells.push_back(footprint_of(piece.cell));
    const ExplainFinding& f = piece.finding;
    if (f.verdict == Verdict::kSeen) {
      plan_.lines.push_back({from_above(f.line.eye), from_above(f.line.point)});
      for (const PassedBy& passed : f.passed)
        plan_.passed.push_back({from_above(passed.at), name_of(passed.object)});
      return;
    }
    for (const auto& part : f.parts) {
      if (part.plane.resolution_px > 0) plan_.planes.push_back(rectangle_of(part.plane));
      for (const Blocker& blocker : part.blockers) note(blocker);
    }
  }
  void note(const Blocker& blocker) {
    for (Shares& shares : shares_)
      if (shares.owners == blocker.owners) {
        shares.share = std::max(shares.share, blocker.share);
        return;
      }
    shares_.push_back({blocker.owners, blocker.share});
  }
  void add(const Shares& shares) {
    SightPlan::Blocker blocker;
    for (const ObjectId owner : shares.owners)
      blocker.boxes.push_back(objects_[index_of(owner)].box);
    blocker.label = ascii(names_of(shares.owners, objects_));
    if (shares.share < 1) blocker.label += "  " + fixed(100 * shares.share, 0) + " %";
    plan_.blockers.push_back(std::move(blocker));
  }
  void title(const std::string& name) {
    const ExplainFinding& f = e_.pieces[0].finding;
    const std::string cell = "cell " + std::to_string(e_.asked.index);
    if (!e_.visible)
      plan_.title = name + " is hidden from " + cell;
    else if (f.verdict == Verdict::kSeen)
      plan_.title = name + " is seen from " + cell;
    else
      plan_.title = name + " is in the PVS of " + cell + ", neither seen nor hidden";
    if (e_.node.index != e_.asked.index)
      plan_.subtitle = "settled for cell " + std::to_string(e_.node.index) + ", which holds it; ";
    plan_.subtitle += f.verdict == Verdict::kSeen ? "found by " : "by ";
    plan_.subtitle += to_string(f.method);
    if (f.verdict == Verdict::kOpen && !f.parts.empty())
      plan_.subtitle += "; the nearest plane has " + fixed(100 * f.parts[0].covered, 1) +
                        " % of its view covered";
  }
  std::string name_of(ObjectId id) const { return ascii(std::string(objects_[index_of(id)].name)); }

  const Explanation& e_;
  const std::vector<StoreObject>& objects_;
  SightPlan plan_;
  std::vector<Shares> shares_;
};

}  // namespace

Status draw_explanation(const Explanation& explanation, const std::vector<StoreObject>& objects,
                        const std::string& path) {
  return render_sight_plan(Planner(explanation, objects).plan(), path);
}

}  // namespace pvsfarm
