// Questions to a worker beside the evaluation of cells: audits, which try to falsify a finished
// store, and explanations, which give the reason for one answer of it. Both are pure functions of
// scene, settings and question.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/ids.hpp"
#include "common/cells/cell.hpp"
#include "common/pvs/method.hpp"
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
  ObjectId object{};
};

// An opaque triangle that a sight line passes by.
struct PassedBy {
  ObjectId object{};
  double clearance_m = 0;
  Vec3 at{0};  // the point of the line that is nearest to it
};
// An occluder that covers part of the object's view on a plane.
struct Blocker {
  std::vector<ObjectId> owners;  // whose matter it is
  double share = 0;              // of the tested rectangle's pixels, where it is what covers them
};
// A projection plane in world coordinates: points origin + x * u + y * v.
struct PlanePlace {
  Vec3 origin{0}, u{0}, v{0};
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // the rectangle that the object's views touch
  double distance_m = 0;                  // before the cell's face
  int resolution_px = 0;
};

enum class Verdict : std::uint8_t { kSeen = 0, kHidden = 1, kOpen = 2 };

struct ExplainFinding {
  Verdict verdict = Verdict::kOpen;
  Method method = Method::kProjection;  // that settled it, or came nearest to it
  // kSeen: the witness, and the opaque triangles of other objects it passes nearest by.
  SightLine line;
  std::vector<PassedBy> passed;
  // kHidden: one plane for each part of the object's box (one part unless it had to be split).
  // kOpen: the plane that covers most of it.
  struct Part {
    Box box;  // world, around the part; a group's box if objects were hidden as a group
    PlanePlace plane;
    double depth_m = 0;             // beyond the plane: the farthest matter that covers a pixel
    double covered = 0;             // share of the pixels that cover it: 1 if hidden
    std::vector<Blocker> blockers;  // largest share first, at most kMaxBlockers
  };
  std::vector<Part> parts;
};
inline constexpr std::size_t kMaxBlockers = 16;

}  // namespace pvsfarm
