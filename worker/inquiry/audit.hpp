// The audit of one cell: tries to falsify the PVS that a store claims, by finding lines of sight to
// objects outside it.
//
// It shares nothing with the provers: no plane, no Projection, no occluder model, only rays against
// the scene's very triangles. It proves nothing if it finds nothing.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/pvs/inquiry.hpp"
#include "common/scene/scene.hpp"
#include "worker/visibility/sampler.hpp"
#include "worker/visibility/sight_check.hpp"

namespace pvsfarm {

// Threads: one object, one thread.
class Auditor {
 public:
  // Objects nearer to an eye than `near_m` need not be in a PVS.
  Auditor(std::shared_ptr<const Scene> scene, double near_m);

  // Looks first for the suspects, then for what is outside the PVS and looks largest from the
  // cell's centre, then all around. Every violation was checked anew in double precision: the eye
  // is in the cell, the point on the object, and the line clear of everything opaque by a margin.
  // Equal questions get equal answers on every x86-64 machine.
  AuditFinding audit(const AuditQuestion& question);

 private:
  VisibleSet largest_outside(const AuditQuestion& question, std::size_t count) const;
  bool holds(const Cell& cell, const Witness& witness);

  std::shared_ptr<const Scene> scene_;
  double near_m_;
  Sampler sampler_;
  VisibleSet occludees_;
  std::vector<Vec3> centers_;          // of the objects' boxes
  std::vector<double> half_lengths2_;  // of their half diagonals, squared
  std::optional<SightCheck> sight_;    // made when there is something to check: seldom
};

}  // namespace pvsfarm
