// Questions to a worker beside the evaluation of cells: audits, which try to falsify a finished
// store, and explanations, which give the reason for one answer of it. Both are pure functions of
// scene, settings and question.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/ids.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/delta.hpp"
#include "common/pvs/method.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/visible_set.hpp"

namespace pvsfarm {

// A segment from a viewpoint to a point of an object that nothing opaque meets in between.
struct SightLine {
  Vec3 eye{0}, point{0};  // world
};

// One cell of a store under audit.
struct AuditQuestion {
  CellKey key;
  Cell cell;
  VisibleSet visible;   // the PVS that the store claims
  VisibleSet suspects;  // occludees outside it that are looked for first
  std::uint64_t seed = 0;
  std::uint64_t rays = 0;
};
struct AuditViolation {
  ObjectId object{};  // seen, but not in the PVS
  SightLine line;
};
inline constexpr std::size_t kMaxAuditViolations = 16;  // reported a cell
struct AuditFinding {
  CellKey key;
  std::uint64_t rays = 0;
  VisibleSet seen;  // what the audit saw
  std::vector<AuditViolation> violations;
};

struct ExplainQuestion {
  CellKey key;
  Cell cell;
  VisibleSet parent;  // the set the cell was evaluated against
  ObjectId object{};  // one of them
};

// An opaque triangle that a sight line passes by.
struct PassedBy {
  ObjectId object{};
  double clearance_m = 0;
  Vec3 at{0};  // the point of the line that is nearest to it
};
// What hides part of an object.
struct Blocker {
  std::vector<ObjectId> owners;  // whose matter it is
  // Of the tested pixels, where it is what covers them; or of the lines that it meets first.
  double share = 0;
};
// A projection plane in world coordinates: points origin + x * u + y * v.
struct PlanePlace {
  Vec3 origin{0}, u{0}, v{0};
  Vec3 away{0};                           // out of the cell's face, across the plane
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // the rectangle that the object's views touch
  double distance_m = 0;                  // before the cell's face
  int resolution_px = 0;                  // of the whole map, a side
};

enum class Verdict : std::uint8_t { kSeen = 0, kHidden = 1, kOpen = 2 };

struct ExplainFinding {
  Verdict verdict = Verdict::kOpen;
  Method method = Method::kProjection;  // that settled it, or came nearest to it
  // The bake left the object open; a ray cast for this answer alone found the line.
  bool found_afterwards = false;
  // kSeen: the witness, and the opaque triangles of other objects it passes nearest by.
  SightLine line;
  std::vector<PassedBy> passed;
  // kHidden: one plane for each part of the object's box (one part unless it had to be split); if
  // shafts hid it, one part without a plane (of resolution 0).
  // kOpen: the plane that covers most of it; none if no plane lies wholly between cell and object.
  struct Part {
    Box box;  // world, around the part; a group's box if objects were hidden as a group
    std::uint32_t objects = 1;  // in the group
    PlanePlace plane;
    double depth_m = 0;  // beyond the plane: the nearest that the part can be
    double pixels = 0;   // that the part's views touch, those outside the map included
    double covered = 0;  // share of them that matter before the part covers: 1 if hidden
    // What covers the pixels has no Projection of its own (sheets, sections, re-projected maps):
    // shares, and `covered`, are of lines from all over the cell to all over the part.
    bool by_lines = false;
    std::vector<Blocker> blockers;  // largest share first, at most kMaxBlockers
  };
  std::vector<Part> parts;
  // kHidden: the certificate, checked against the scene's very triangles: lines from all over the
  // cell to all over the object, and those of them that nothing opaque meets. Not empty: a bug.
  std::uint32_t lines_checked = 0;
  std::vector<SightLine> unblocked;  // at most kMaxUnblocked
  // The PVS that this evaluation comes to: what the cell's halves start from.
  VisibleSet visible;
  std::vector<CascadeRound> rounds;  // of this evaluation, without times
};
inline constexpr std::size_t kMaxBlockers = 16;
inline constexpr std::size_t kMaxUnblocked = 16;
inline constexpr std::size_t kMaxPassedBy = 4;
inline constexpr std::size_t kMaxExplainedParts = 64;

// A cell evaluated with settings of its own, to measure them.
struct EvaluateQuestion {
  CellKey key;
  Cell cell;
  VisibleSet parent;
  EvaluatorSettings settings;
};

// What is asked of a farm, and its answer: of the kind with the same place in the list.
using Question = std::variant<AuditQuestion, ExplainQuestion, EvaluateQuestion>;
using Finding = std::variant<AuditFinding, ExplainFinding, CellDelta>;

}  // namespace pvsfarm
