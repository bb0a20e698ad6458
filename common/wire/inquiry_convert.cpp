// INQUIRY and FINDING_BEGIN, both directions.
#include <cmath>

#include "common/base/check.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/finding_bytes.hpp"

namespace pvsfarm {
namespace {

Error refused(const char* what) { return invalid_input(std::string("message refused: ") + what); }

bool unpack_audit(const proto::AuditAsked& in, std::size_t sets, AuditAsked& out) {
  out.visible = in.visible();
  out.suspects = in.suspects();
  out.seed = in.seed();
  out.rays = in.rays();
  return out.visible < sets && out.suspects < sets && unpack_key(in.key(), out.key) &&
         unpack_cell(in.cell(), out.cell);
}

bool unpack_explain(const proto::ExplainAsked& in, std::size_t sets, ExplainAsked& out) {
  out.parent = in.parent();
  out.object = ObjectId{in.object()};
  return out.parent < sets && unpack_key(in.key(), out.key) && unpack_cell(in.cell(), out.cell);
}

}  // namespace

void pack(const Inquiry& plain, proto::Inquiry& message) {
  PVS_CHECK_LE(plain.audits.size(), kMaxTaskCells);
  PVS_CHECK_LE(plain.sets.size(), kMaxInquirySets);
  message.set_lease(static_cast<std::uint64_t>(plain.lease));
  message.set_attempt(plain.attempt);
  for (const ParentSet& set : plain.sets) pack_set(set, *message.add_sets());
  for (const AuditAsked& asked : plain.audits) {
    proto::AuditAsked& out = *message.add_audits();
    pack_key(asked.key, *out.mutable_key());
    pack_cell(asked.cell, *out.mutable_cell());
    out.set_visible(asked.visible);
    out.set_suspects(asked.suspects);
    out.set_seed(asked.seed);
    out.set_rays(asked.rays);
  }
  if (!plain.explain) return;
  proto::ExplainAsked& out = *message.mutable_explain();
  pack_key(plain.explain->key, *out.mutable_key());
  pack_cell(plain.explain->cell, *out.mutable_cell());
  out.set_parent(plain.explain->parent);
  out.set_object(index_of(plain.explain->object));
}

Status unpack(const proto::Inquiry& in, Inquiry& out) {
  out.lease = LeaseId{in.lease()};
  out.attempt = in.attempt();
  const auto audits = static_cast<std::size_t>(in.audits_size());
  if (audits > kMaxTaskCells || (audits > 0) == in.has_explain())
    return refused("INQUIRY with too many questions, or none");
  if (static_cast<std::size_t>(in.sets_size()) > kMaxInquirySets)
    return refused("INQUIRY with idle sets");
  for (const proto::ParentSet& set : in.sets())
    if (!unpack_set(set, out.sets.emplace_back())) return refused("INQUIRY with a damaged set");
  for (const proto::AuditAsked& asked : in.audits())
    if (!unpack_audit(asked, out.sets.size(), out.audits.emplace_back()))
      return refused("INQUIRY with a damaged audit");
  if (in.has_explain() && !unpack_explain(in.explain(), out.sets.size(), out.explain.emplace()))
    return refused("INQUIRY with a damaged question");
  return {};
}

void pack(const FindingBegin& plain, proto::FindingBegin& message) {
  PVS_CHECK_LE(plain.findings.size(), kMaxTaskCells);
  message.set_lease(static_cast<std::uint64_t>(plain.lease));
  message.set_bytes(plain.bytes);
  for (const FindingHead& head : plain.findings) {
    proto::FindingHead& out = *message.add_findings();
    out.set_bytes(head.bytes);
    out.set_cpu_ms(head.cpu_ms);
  }
}

Status unpack(const proto::FindingBegin& in, FindingBegin& out) {
  out.lease = LeaseId{in.lease()};
  out.bytes = in.bytes();
  const auto count = static_cast<std::size_t>(in.findings_size());
  if (count < 1 || count > kMaxTaskCells) return refused("FINDING with too many answers, or none");
  if (out.bytes > kMaxResultBytes) return refused("FINDING over its size limit");
  std::uint64_t sum = 0;
  for (const proto::FindingHead& head : in.findings()) {
    if (head.bytes() > kMaxFindingBytes || !std::isfinite(head.cpu_ms()) || head.cpu_ms() < 0)
      return refused("FINDING with a damaged answer");
    out.findings.push_back({head.bytes(), head.cpu_ms()});
    sum += head.bytes();
  }
  if (sum != out.bytes) return refused("FINDING whose sizes do not add up");
  return {};
}

}  // namespace pvsfarm
