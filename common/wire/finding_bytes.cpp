#include "common/wire/finding_bytes.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/check.hpp"
#include "inquiry.pb.h"

namespace pvsfarm {
namespace {

// ---- plain to bytes

template <class Out>
void add_vec(const Vec3& v, Out* out) {
  for (int a = 0; a < 3; ++a) out->Add(v[a]);
}

void pack_line(const SightLine& line, proto::Segment& out) {
  add_vec(line.eye, out.mutable_eye());
  add_vec(line.point, out.mutable_point());
}

void pack_part(const ExplainFinding::Part& part, proto::ExplainFinding::Part& out) {
  add_vec(part.box.lo, out.mutable_box());
  add_vec(part.box.hi, out.mutable_box());
  for (const Vec3& v : {part.plane.origin, part.plane.u, part.plane.v, part.plane.away})
    add_vec(v, out.mutable_plane());
  for (const double x : {part.plane.x0, part.plane.y0, part.plane.x1, part.plane.y1})
    out.add_plane(x);
  out.set_distance_m(part.plane.distance_m);
  out.set_resolution_px(static_cast<std::uint32_t>(part.plane.resolution_px));
  out.set_depth_m(part.depth_m);
  out.set_objects(part.objects);
  out.set_pixels(part.pixels);
  out.set_covered(part.covered);
  out.set_by_lines(part.by_lines);
  for (std::size_t i = 0; i < std::min(part.blockers.size(), kMaxBlockers); ++i) {
    proto::ExplainFinding::Blocker& to = *out.add_blockers();
    to.set_share(part.blockers[i].share);
    const std::vector<ObjectId>& owners = part.blockers[i].owners;
    for (std::size_t j = 0; j < std::min(owners.size(), kMaxOwners); ++j)
      to.add_owners(index_of(owners[j]));
  }
}

Bytes bytes_of(const proto::Finding& message) {
  const std::string text = message.SerializeAsString();
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return {first, first + text.size()};
}

// ---- bytes to plain

bool is_number(double x) { return std::isfinite(x); }

template <class Repeated>
bool get_vec(const Repeated& in, int first, Vec3& out) {
  if (in.size() < first + 3) return false;
  for (int a = 0; a < 3; ++a) {
    out[a] = in.Get(first + a);
    if (!is_number(out[a])) return false;
  }
  return true;
}

bool unpack_line(const proto::Segment& in, SightLine& out) {
  return get_vec(in.eye(), 0, out.eye) && get_vec(in.point(), 0, out.point);
}

bool unpack_audit(const proto::AuditFinding& in, std::uint32_t objects, AuditFinding& out) {
  out.key = {in.key().root(), in.key().path()};
  out.rays = in.rays();
  Result<VisibleSet> seen = decode_visible_set(std::as_bytes(std::span(in.seen())), objects);
  if (out.key.path == 0 || !seen || seen->universe() != objects ||
      static_cast<std::size_t>(in.violations_size()) > kMaxAuditViolations)
    return false;
  out.seen = std::move(seen).value();
  for (const proto::AuditFinding::Violation& violation : in.violations()) {
    AuditViolation& to = out.violations.emplace_back();
    to.object = ObjectId{violation.object()};
    if (violation.object() >= objects || !unpack_line(violation.line(), to.line)) return false;
  }
  return true;
}

bool unpack_blocker(const proto::ExplainFinding::Blocker& in, std::uint32_t objects, Blocker& out) {
  out.share = in.share();
  if (static_cast<std::size_t>(in.owners_size()) > kMaxOwners) return false;
  for (const std::uint32_t owner : in.owners()) {
    if (owner >= objects) return false;
    out.owners.push_back(ObjectId{owner});
  }
  return is_number(out.share);
}

bool unpack_part(const proto::ExplainFinding::Part& in, std::uint32_t objects,
                 ExplainFinding::Part& out) {
  PlanePlace& plane = out.plane;
  if (in.plane_size() != 16 || !get_vec(in.box(), 0, out.box.lo) ||
      !get_vec(in.box(), 3, out.box.hi) || !get_vec(in.plane(), 0, plane.origin) ||
      !get_vec(in.plane(), 3, plane.u) || !get_vec(in.plane(), 6, plane.v) ||
      !get_vec(in.plane(), 9, plane.away) ||
      static_cast<std::size_t>(in.blockers_size()) > kMaxBlockers || in.resolution_px() > 65'536)
    return false;
  plane.x0 = in.plane(12);
  plane.y0 = in.plane(13);
  plane.x1 = in.plane(14);
  plane.y1 = in.plane(15);
  plane.distance_m = in.distance_m();
  plane.resolution_px = static_cast<int>(in.resolution_px());
  out.depth_m = in.depth_m();
  out.objects = in.objects();
  out.pixels = in.pixels();
  out.covered = in.covered();
  out.by_lines = in.by_lines();
  for (const proto::ExplainFinding::Blocker& blocker : in.blockers())
    if (!unpack_blocker(blocker, objects, out.blockers.emplace_back())) return false;
  for (const double x :
       {plane.x0, plane.y0, plane.x1, plane.y1, plane.distance_m, out.covered, out.pixels})
    if (!is_number(x)) return false;
  return !std::isnan(out.depth_m);
}

bool unpack_explain(const proto::ExplainFinding& in, std::uint32_t objects, ExplainFinding& out) {
  if (!proto::Verdict_IsValid(in.verdict()) || in.method() >= kMethodCount ||
      static_cast<std::size_t>(in.passed_size()) > kMaxPassedBy ||
      static_cast<std::size_t>(in.parts_size()) > kMaxExplainedParts ||
      static_cast<std::size_t>(in.unblocked_size()) > kMaxUnblocked)
    return false;
  Result<VisibleSet> visible = decode_visible_set(std::as_bytes(std::span(in.visible())), objects);
  if (!visible || visible->universe() != objects) return false;
  out.visible = std::move(visible).value();
  if (!in.rounds().empty() && !decode_rounds(std::as_bytes(std::span(in.rounds())), out.rounds))
    return false;
  out.found_afterwards = in.found_afterwards();
  out.lines_checked = in.lines_checked();
  for (const proto::Segment& line : in.unblocked())
    if (!unpack_line(line, out.unblocked.emplace_back())) return false;
  out.verdict = static_cast<Verdict>(in.verdict());
  out.method = static_cast<Method>(in.method());
  if (!unpack_line(in.line(), out.line)) return false;
  for (const proto::ExplainFinding::PassedBy& passed : in.passed()) {
    PassedBy& to = out.passed.emplace_back();
    to.object = ObjectId{passed.object()};
    to.clearance_m = passed.clearance_m();
    if (passed.object() >= objects || !is_number(to.clearance_m) || !get_vec(passed.at(), 0, to.at))
      return false;
  }
  for (const proto::ExplainFinding::Part& part : in.parts())
    if (!unpack_part(part, objects, out.parts.emplace_back())) return false;
  return true;
}

}  // namespace

Bytes encode_finding(const AuditFinding& finding) {
  proto::Finding message;
  proto::AuditFinding& out = *message.mutable_audit();
  out.mutable_key()->set_root(finding.key.root);
  out.mutable_key()->set_path(finding.key.path);
  out.set_rays(finding.rays);
  const std::vector<std::byte> seen = encode(finding.seen);
  out.set_seen(seen.data(), seen.size());
  for (std::size_t i = 0; i < std::min(finding.violations.size(), kMaxAuditViolations); ++i) {
    proto::AuditFinding::Violation& to = *out.add_violations();
    to.set_object(index_of(finding.violations[i].object));
    pack_line(finding.violations[i].line, *to.mutable_line());
  }
  return bytes_of(message);
}

Bytes encode_finding(const ExplainFinding& finding) {
  proto::Finding message;
  proto::ExplainFinding& out = *message.mutable_explain();
  out.set_verdict(static_cast<proto::Verdict>(finding.verdict));
  out.set_method(static_cast<std::uint32_t>(finding.method));
  pack_line(finding.line, *out.mutable_line());
  for (std::size_t i = 0; i < std::min(finding.passed.size(), kMaxPassedBy); ++i) {
    proto::ExplainFinding::PassedBy& to = *out.add_passed();
    to.set_object(index_of(finding.passed[i].object));
    to.set_clearance_m(finding.passed[i].clearance_m);
    add_vec(finding.passed[i].at, to.mutable_at());
  }
  for (std::size_t i = 0; i < std::min(finding.parts.size(), kMaxExplainedParts); ++i)
    pack_part(finding.parts[i], *out.add_parts());
  out.set_found_afterwards(finding.found_afterwards);
  out.set_lines_checked(finding.lines_checked);
  for (std::size_t i = 0; i < std::min(finding.unblocked.size(), kMaxUnblocked); ++i)
    pack_line(finding.unblocked[i], *out.add_unblocked());
  const std::vector<std::byte> visible = encode(finding.visible);
  out.set_visible(visible.data(), visible.size());
  const std::vector<std::byte> rounds = encode_rounds(finding.rounds);
  out.set_rounds(rounds.data(), rounds.size());
  return bytes_of(message);
}

Result<WireFinding> decode_finding(std::span<const std::byte> bytes, std::uint32_t object_count) {
  const Error refused = invalid_input("message refused: a damaged finding");
  if (bytes.size() > kMaxFindingBytes) return refused;
  proto::Finding message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return refused;
  if (message.has_audit()) {
    AuditFinding audit;
    if (!unpack_audit(message.audit(), object_count, audit)) return refused;
    return WireFinding(std::move(audit));
  }
  ExplainFinding explain;
  if (!message.has_explain() || !unpack_explain(message.explain(), object_count, explain))
    return refused;
  return WireFinding(std::move(explain));
}

}  // namespace pvsfarm
