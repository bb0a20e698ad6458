// The walk along the intersection of surface and tube, and the invasion of what it encloses.
#include <set>

#include "tests/adversarial/reference/shield_reference.hpp"

namespace pvsfarm::reference {
namespace {

using Edge = std::pair<int, int>;  // as it runs counter-clockwise around some triangle

Edge key(const Edge& e) { return {std::min(e.first, e.second), std::max(e.first, e.second)}; }

// A vertex of the curve: an edge of one surface stabs a triangle of the other.
struct CurvePoint {
  bool edge_of_mesh = false;  // else an edge of the tube
  Edge edge;                  // undirected
  friend bool operator==(const CurvePoint&, const CurvePoint&) = default;
};

class Walk {
 public:
  Walk(const TriangleMesh& mesh, const Hull& hull)
      : mesh_(mesh),
        tube_(hull.surface),
        is_tube_(hull.is_tube),
        mesh_edges_(mesh),
        tube_edges_(tube_) {}

  // An edge of the tube from one cell to the other, counter-clockwise in the returned triangle.
  std::pair<Edge, int> tube_edge() const {
    for (int t = 0; t < static_cast<int>(tube_.triangles.size()); ++t)
      for (int k = 0; k < 3 && is_tube_[t]; ++k) {
        const Edge e{tube_.triangles[t][k], tube_.triangles[t][(k + 1) % 3]};
        if ((e.first < 8) != (e.second < 8)) return {e, t};
      }
    return {{0, 0}, -1};
  }

  // Triangles that the edge stabs; false: a degenerate sign.
  bool find_stabbed(const Edge& e) {
    for (int s = 0; s < static_cast<int>(mesh_.triangles.size()); ++s) {
      const Stab answer = stab(tube_.vertices[e.first], tube_.vertices[e.second], mesh_, s);
      if (answer == Stab::kDegenerate) return false;
      if (answer == Stab::kHit) stabbed_.insert(s);
    }
    return true;
  }
  const std::set<int>& stabbed() const { return stabbed_; }

  enum class End { kClosed, kHole, kFailed };
  // Follows the curve from where `e` stabs `start`, the inside of the tube on its left.
  End run(const Edge& e, int start) {
    crossed_.clear(), cold_.clear(), hot_.clear(), invaded_.clear();
    odd_ = false;
    int s = start, t = first_tube_triangle(e, start);
    CurvePoint at{false, key(e)};
    const CurvePoint first = at;
    enter(s);
    for (int steps = 0; steps < kMostSteps; ++steps) {
      CurvePoint next;
      if (!other_end(s, t, at, next)) return End::kFailed;
      at = next;
      if (at == first && s == start) return End::kClosed;
      if (at.edge_of_mesh) {
        const int from = s;
        s = mesh_edges_.across(from, at.edge.first, at.edge.second);
        if (s < 0) return End::kHole;
        update(from, s, at.edge);
      } else {
        t = tube_edges_.across(t, at.edge.first, at.edge.second);
        if (t < 0 || !is_tube_[t]) return End::kFailed;
      }
    }
    return End::kFailed;
  }

  // Whether what the curve encloses is found closed and crossed an odd number of times.
  bool encloses(Invasion invasion) {
    bool hole = false;
    for (const auto& [edge, inner] : hot_) {
      if (cold_.contains(key(edge))) continue;
      const int beyond = mesh_edges_.across(inner, edge.first, edge.second);
      if (beyond >= 0 && invaded_.contains(beyond)) continue;
      const bool has_hole = invade(edge, inner);
      if (invasion == Invasion::kUntilFirstClosedPart && !has_hole && odd_) return true;
      hole |= has_hole;
    }
    return invasion == Invasion::kAllParts && !hole && odd_;
  }

  bool crossed(int s) const { return crossed_.contains(s); }

 private:
  static constexpr int kMostSteps = 100'000;

  void enter(int s) {
    if (crossed_.insert(s).second && stabbed_.contains(s)) odd_ = !odd_;
  }

  // Of the two tube triangles at the start, the one the curve runs into with the tube's inside on
  // its left: there the edge, counter-clockwise, goes against the normal of the surface.
  int first_tube_triangle(const Edge& e, int s) const {
    for (const int t : tube_edges_.around(e.first, e.second))
      for (int k = 0; k < 3; ++k) {
        const Edge directed{tube_.triangles[t][k], tube_.triangles[t][(k + 1) % 3]};
        if (key(directed) == key(e) && mesh_.side(s, tube_.vertices[directed.first]) > 0) return t;
      }
    return -1;
  }

  // Two triangles meet in a segment; `at` is one end, `next` becomes the other.
  bool other_end(int s, int t, const CurvePoint& at, CurvePoint& next) const {
    int ends = 0;
    for (int k = 0; k < 3; ++k) {
      const Edge of_s = key({mesh_.triangles[s][k], mesh_.triangles[s][(k + 1) % 3]});
      const Edge of_t = key({tube_.triangles[t][k], tube_.triangles[t][(k + 1) % 3]});
      const Stab s_in_t = stab(mesh_.vertices[of_s.first], mesh_.vertices[of_s.second], tube_, t);
      const Stab t_in_s = stab(tube_.vertices[of_t.first], tube_.vertices[of_t.second], mesh_, s);
      if (s_in_t == Stab::kDegenerate || t_in_s == Stab::kDegenerate) return false;
      if (s_in_t == Stab::kHit) ++ends, next = pick({true, of_s}, at, next);
      if (t_in_s == Stab::kHit) ++ends, next = pick({false, of_t}, at, next);
    }
    return ends == 2;
  }
  static CurvePoint pick(const CurvePoint& found, const CurvePoint& at, const CurvePoint& next) {
    return found == at ? next : found;
  }

  // UpdateWalk: the curve has crossed `e` from one triangle into the next. To the right of the
  // curve is the outside of the tube; what is on its left may be the border of the interior.
  void update(int from, int into, const Edge& e) {
    enter(into);
    cold_.insert(key(e));
    cold_.insert(key(edge_beside(into, e, 1)));  // on the right, ahead
    cold_.insert(key(edge_beside(from, e, 2)));  // on the right, behind
    hot_.push_back({edge_beside(into, e, 2), into});
  }
  // The edge `after` steps counter-clockwise from e in a triangle.
  Edge edge_beside(int triangle, const Edge& e, int after) const {
    const auto& t = mesh_.triangles[triangle];
    for (int k = 0; k < 3; ++k)
      if (key({t[k], t[(k + 1) % 3]}) == key(e))
        return {t[(k + after) % 3], t[(k + after + 1) % 3]};
    return e;
  }

  // Invade: true if a border of the surface is reached.
  bool invade(const Edge& edge, int inner) {
    std::vector<std::pair<Edge, int>> open{{edge, inner}};
    bool hole = false;
    while (!open.empty()) {
      const auto [e, s] = open.back();
      open.pop_back();
      const int beyond = mesh_edges_.across(s, e.first, e.second);
      if (beyond < 0) hole = true;
      if (beyond < 0 || crossed_.contains(beyond) || !invaded_.insert(beyond).second) continue;
      if (stabbed_.contains(beyond)) odd_ = !odd_;
      for (const int after : {1, 2}) open.push_back({edge_beside(beyond, e, after), beyond});
    }
    return hole;
  }

  const TriangleMesh& mesh_;
  const TriangleMesh& tube_;
  const std::vector<bool>& is_tube_;
  EdgeMap mesh_edges_, tube_edges_;
  std::set<int> stabbed_, crossed_, invaded_;
  std::set<Edge> cold_;
  std::vector<std::pair<Edge, int>> hot_;  // with the triangle on the curve's side
  bool odd_ = false;
};

}  // namespace

ShieldAnswer walk_and_invade(const TriangleMesh& mesh, const Corners& a, const Corners& b,
                             Invasion invasion) {
  const std::optional<Hull> hull = hull_of(a, b);
  if (!hull) return ShieldAnswer::kUnknown;
  Walk walk(mesh, *hull);
  const auto [edge, triangle] = walk.tube_edge();
  if (triangle < 0 || !walk.find_stabbed(edge)) return ShieldAnswer::kUnknown;
  if (walk.stabbed().empty()) return ShieldAnswer::kFree;
  std::set<int> done;
  for (const int s : walk.stabbed()) {
    if (done.contains(s)) continue;
    const Walk::End end = walk.run(edge, s);
    for (const int other : walk.stabbed())
      if (walk.crossed(other)) done.insert(other);
    if (end == Walk::End::kClosed && walk.encloses(invasion)) return ShieldAnswer::kHidden;
  }
  return ShieldAnswer::kUnknown;
}

ShieldAnswer walk_perturbed(const TriangleMesh& mesh, const IntBox& a, const IntBox& b,
                            const CellMoves& moves, Perturbation perturbation) {
  Corners moved_a = a.corners(), moved_b = b.corners();
  for (int k = 0; k < 8; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      moved_a[k][axis] += moves.a[k][axis];
      moved_b[k][axis] += moves.b[k][axis];
    }
  if (perturbation == Perturbation::kChecked &&
      !(contains_all(moved_a, a.corners()) && contains_all(moved_b, b.corners())))
    return ShieldAnswer::kUnknown;
  return walk_and_invade(mesh, moved_a, moved_b, Invasion::kAllParts);
}

}  // namespace pvsfarm::reference
