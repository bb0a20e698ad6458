#include <cmath>
#include <cstring>
#include <limits>

#include "common/wire/convert.hpp"

namespace pvsfarm {
namespace {

Error refused(const char* what) { return invalid_input(std::string("message refused: ") + what); }

bool copy_text(const std::string& from, std::string& to) {
  if (from.size() > kMaxTextBytes) return false;
  to = from;
  return true;
}

Bytes bytes_from(const std::string& from) {
  const auto* first = reinterpret_cast<const std::byte*>(from.data());
  return {first, first + from.size()};
}

template <std::size_t N>
bool copy_exact(const std::string& from, std::array<std::uint8_t, N>& to) {
  if (from.size() != N) return false;
  std::memcpy(to.data(), from.data(), N);
  return true;
}

template <class Repeated>
bool unpack_vec(const Repeated& in, int first, Vec3& out) {
  for (int a = 0; a < 3; ++a) {
    out[a] = in.Get(first + a);
    if (!std::isfinite(out[a])) return false;
  }
  return true;
}

}  // namespace

bool unpack_key(const proto::CellKey& in, CellKey& out) {
  out = {in.root(), in.path()};
  return out.path != 0 && out.depth() <= 62;
}

bool unpack_cell(const proto::Cell& in, Cell& out) {
  out = Cell{};
  if (in.lo_size() != 3 || in.hi_size() != 3 || !unpack_vec(in.lo(), 0, out.lo) ||
      !unpack_vec(in.hi(), 0, out.hi))
    return false;
  if (in.origin_size() != 0 && (in.origin_size() != 3 || !unpack_vec(in.origin(), 0, out.origin)))
    return false;
  if (in.axes_size() != 0) {
    if (in.axes_size() != 9) return false;
    for (int a = 0; a < 3; ++a)
      if (!unpack_vec(in.axes(), 3 * a, out.axes[static_cast<std::size_t>(a)])) return false;
  }
  return out.lo.x <= out.hi.x && out.lo.y <= out.hi.y && out.lo.z <= out.hi.z;
}

namespace {

bool unpack_settings(const proto::EvaluatorSettings& in, EvaluatorSettings& out) {
  if (!proto::Raster_IsValid(in.raster()) || in.resolution_px() > 1024 ||
      in.planes_per_face() > 16 || in.item_buffer_px() > 1024 ||
      in.hint_viewpoints() > kMaxHintViewpoints || !std::isfinite(in.extent()) ||
      !std::isfinite(in.near_m()) || !std::isfinite(in.gap()) || !std::isfinite(in.time_ms()))
    return false;
  out.raster = in.raster() == proto::RASTER_OSMESA ? RasterKind::kOsmesa : RasterKind::kDirect;
  out.resolution_px = static_cast<int>(in.resolution_px());
  out.planes_per_face = static_cast<int>(in.planes_per_face());
  out.extent = in.extent();
  out.near_m = in.near_m();
  out.methods = Methods::from_bits(in.methods());
  out.gap = in.gap();
  out.max_rays = in.max_rays();
  out.time_ms = in.time_ms();
  out.item_buffer_px = static_cast<int>(in.item_buffer_px());
  out.budget_triangles = in.budget_triangles();
  out.hint_viewpoints = in.hint_viewpoints();
  // A method that this program does not know cannot be left out quietly.
  return out.methods.bits() == in.methods() && out.resolution_px >= 64 &&
         out.planes_per_face >= 1 && out.extent >= 0.25 && out.extent <= 4 && out.near_m >= 0 &&
         out.gap >= 0 && out.gap <= 1 && out.time_ms >= 0 && out.item_buffer_px >= 32;
}

bool unpack_method(const proto::MethodStatistics& in, MethodStatistics& out) {
  out = {in.hidden_objects(), in.seen_objects(), in.hidden_triangles(),
         in.seen_triangles(), in.work(),         in.cpu_ms()};
  return std::isfinite(out.cpu_ms) && out.cpu_ms >= 0;
}

bool unpack_statistics(const proto::Statistics& in, CellStatistics& out) {
  out.cpu_ms = in.cpu_ms();
  out.planes = in.planes();
  out.occluder_candidates = in.occluder_candidates();
  out.projections = in.projections();
  out.occluders_skipped = in.occluders_skipped();
  out.box_tests = in.box_tests();
  out.contradictions = in.contradictions();
  if (in.methods_size() != 0 && in.methods_size() != kMethodCount) return false;
  if (!in.rounds().empty() && !decode_rounds(std::as_bytes(std::span(in.rounds())), out.rounds))
    return false;
  for (int i = 0; i < in.methods_size(); ++i)
    if (!unpack_method(in.methods(i), out.methods[static_cast<std::size_t>(i)])) return false;
  return std::isfinite(out.cpu_ms) && out.cpu_ms >= 0;
}

}  // namespace

bool unpack_set(const proto::ParentSet& in, ParentSet& out) {
  switch (in.source_case()) {
    case proto::ParentSet::kAll:
      out.all = true;
      return in.all();
    case proto::ParentSet::kSet:
      out.set = bytes_from(in.set());
      return !out.set.empty();
    case proto::ParentSet::kDigest:
      out.set_bytes = in.set_bytes();
      return out.set_bytes > 0 && out.set_bytes <= kMaxResultBytes &&
             copy_exact(in.digest(), out.digest.bytes);
    default:
      return false;
  }
}

namespace {

template <class Repeated>
bool unpack_leases(const Repeated& in, std::vector<LeaseId>& out) {
  if (static_cast<std::size_t>(in.size()) > kMaxRunning) return false;
  for (const std::uint64_t id : in) out.push_back(LeaseId{id});
  return true;
}

}  // namespace

Status unpack(const proto::Hello& in, Hello& out) {
  out.major = in.major();
  out.minor_lowest = in.minor_lowest();
  out.minor_highest = in.minor_highest();
  out.slots = in.slots();
  out.pid = in.pid();
  const std::uint32_t algorithm = in.kernel().algorithm_version();
  if (algorithm > static_cast<std::uint32_t>(std::numeric_limits<int>::max()))
    return refused("HELLO with an impossible algorithm version");
  out.kernel.algorithm_version = static_cast<int>(algorithm);
  if (out.slots < 1 || out.slots > kMaxSlots) return refused("HELLO with an impossible slot count");
  if (!copy_text(in.build(), out.build) || !copy_text(in.host(), out.host) ||
      !copy_text(in.kernel().mesa_version(), out.kernel.mesa_version))
    return refused("HELLO with a text too long");
  if (!copy_exact(in.worker(), out.worker)) return refused("HELLO without a worker's identity");
  return {};
}

Status unpack(const proto::Welcome& in, Welcome& out) {
  out.minor = in.minor();
  out.scene_bytes = in.scene_bytes();
  out.heartbeat_ms = in.heartbeat_ms();
  if (!unpack_settings(in.settings(), out.settings)) return refused("WELCOME with bad settings");
  if (!copy_exact(in.scene_digest(), out.scene.bytes) ||
      !copy_exact(in.kernel_id(), out.kernel_id.bytes))
    return refused("WELCOME without digests");
  if (!copy_text(in.scene_path(), out.scene_path)) return refused("WELCOME with a path too long");
  if (out.heartbeat_ms < 10 || out.heartbeat_ms > 60'000)
    return refused("WELCOME with an impossible heartbeat");
  return {};
}

Status unpack(const proto::Reject& in, Reject& out) {
  if (!proto::RejectCode_IsValid(in.code()) || in.code() == proto::REJECT_NONE)
    return refused("REJECT with an unknown code");
  out.code = static_cast<RejectCode>(in.code());
  if (!copy_text(in.text(), out.text)) return refused("REJECT with a text too long");
  return {};
}

Status unpack(const proto::Task& in, Task& out) {
  out.lease = LeaseId{in.lease()};
  out.attempt = in.attempt();
  const auto cells = static_cast<std::size_t>(in.cells_size());
  if (cells < 1 || cells > kMaxTaskCells) return refused("TASK with too many cells, or none");
  if (static_cast<std::size_t>(in.parents_size()) > cells) return refused("TASK with idle parents");
  out.parents.resize(static_cast<std::size_t>(in.parents_size()));
  for (int i = 0; i < in.parents_size(); ++i)
    if (!unpack_set(in.parents(i), out.parents[static_cast<std::size_t>(i)]))
      return refused("TASK with a damaged parent set");
  for (const proto::TaskCell& cell : in.cells()) {
    TaskCell& to = out.cells.emplace_back();
    to.parent = cell.parent();
    if (to.parent >= out.parents.size() || !unpack_key(cell.key(), to.key) ||
        !unpack_cell(cell.cell(), to.cell))
      return refused("TASK with a damaged cell");
  }
  if (in.has_settings() && !unpack_settings(in.settings(), out.settings.emplace()))
    return refused("TASK with bad settings");
  return {};
}

Status unpack(const proto::Heartbeat& in, Heartbeat& out) {
  if (static_cast<std::size_t>(in.running_size()) > kMaxRunning)
    return refused("HEARTBEAT with too many leases");
  for (const proto::Heartbeat::Running& running : in.running()) {
    Heartbeat::Running& to = out.running.emplace_back();
    to.lease = LeaseId{running.lease()};
    to.progress = running.progress();
    if (static_cast<std::size_t>(running.cells_size()) > kMaxTaskCells)
      return refused("HEARTBEAT with too many cells");
    for (const proto::CellKey& key : running.cells())
      if (!unpack_key(key, to.cells.emplace_back())) return refused("HEARTBEAT with a damaged key");
  }
  out.resident_bytes = in.resident_bytes();
  out.ready = in.ready();
  return {};
}

Status unpack(const proto::HeartbeatAck& in, HeartbeatAck& out) {
  if (!unpack_leases(in.renewed(), out.renewed) || !unpack_leases(in.cancelled(), out.cancelled))
    return refused("HEARTBEAT_ACK with too many leases");
  return {};
}

Status unpack(const proto::ResultBegin& in, ResultBegin& out) {
  out.lease = LeaseId{in.lease()};
  out.bytes = in.bytes();
  const auto deltas = static_cast<std::size_t>(in.deltas_size());
  if (deltas < 1 || deltas > kMaxTaskCells) return refused("RESULT with too many cells, or none");
  if (out.bytes > kMaxResultBytes) return refused("RESULT over its size limit");
  std::uint64_t sum = 0;
  for (const proto::Delta& delta : in.deltas()) {
    DeltaHead& to = out.deltas.emplace_back();
    to.hidden_bytes = delta.hidden_bytes();
    to.seen_bytes = delta.seen_bytes();
    to.hint_bytes = delta.hint_bytes();
    to.point_triangles = delta.point_triangles();
    if (to.hidden_bytes > kMaxResultBytes || to.seen_bytes > kMaxResultBytes ||
        to.hint_bytes > kMaxResultBytes || !unpack_key(delta.key(), to.key) ||
        !unpack_statistics(delta.statistics(), to.statistics))
      return refused("RESULT with a damaged delta");
    sum += to.set_bytes();
  }
  if (sum != out.bytes) return refused("RESULT whose sizes do not add up");
  return {};
}

Status unpack(const proto::ResultChunk& in, ResultChunk& out) {
  out.lease = LeaseId{in.lease()};
  out.offset = in.offset();
  if (in.data().empty() || in.data().size() > kChunkBytes)
    return refused("RESULT_CHUNK over its size limit, or empty");
  out.data = bytes_from(in.data());
  return {};
}

Status unpack(const proto::ResultEnd& in, ResultEnd& out) {
  out.lease = LeaseId{in.lease()};
  if (!copy_exact(in.digest(), out.digest.bytes)) return refused("RESULT_END without a digest");
  return {};
}

Status unpack(const proto::ChunkCredit& in, ChunkCredit& out) {
  out.lease = LeaseId{in.lease()};
  out.chunks = in.chunks();
  return {};
}

Status unpack(const proto::ResultAck& in, ResultAck& out) {
  out.lease = LeaseId{in.lease()};
  if (!proto::ResultOutcome_IsValid(in.outcome()) || in.outcome() == proto::OUTCOME_NONE)
    return refused("RESULT_ACK with an unknown outcome");
  out.outcome = static_cast<ResultOutcome>(in.outcome());
  return {};
}

Status unpack(const proto::TaskFailed& in, TaskFailed& out) {
  out.lease = LeaseId{in.lease()};
  if (!proto::FailureKind_IsValid(in.kind()) || in.kind() == proto::FAILURE_NONE)
    return refused("TASK_FAILED with an unknown kind");
  out.kind = static_cast<FailureKind>(in.kind());
  if (!copy_text(in.text(), out.text)) return refused("TASK_FAILED with a text too long");
  return {};
}

Status unpack(const proto::BlobGet& in, BlobGet& out) {
  out.offset = in.offset();
  if (!copy_exact(in.digest(), out.digest.bytes)) return refused("BLOB_GET without a digest");
  return {};
}

Status unpack(const proto::BlobChunk& in, BlobChunk& out) {
  out.offset = in.offset();
  out.total_bytes = in.total_bytes();
  if (in.data().size() > kChunkBytes || !copy_exact(in.digest(), out.digest.bytes) ||
      out.offset > out.total_bytes || in.data().size() > out.total_bytes - out.offset)
    return refused("BLOB_CHUNK outside its blob");
  out.data = bytes_from(in.data());
  return {};
}

Status unpack(const proto::Cancel& in, Cancel& out) {
  if (!unpack_leases(in.leases(), out.leases)) return refused("CANCEL with too many leases");
  return {};
}

Status unpack(const proto::Empty&, Drain&) { return {}; }
Status unpack(const proto::Empty&, Draining&) { return {}; }
Status unpack(const proto::Empty&, Bye&) { return {}; }
Status unpack(const proto::Empty&, Shutdown&) { return {}; }
Status unpack(const proto::Empty&, StatusGet&) { return {}; }
Status unpack(const proto::Empty&, ControlAck&) { return {}; }

Status unpack(const proto::Control& in, Control& out) {
  if (!proto::ControlKind_IsValid(in.kind()) || in.kind() == proto::CONTROL_NONE)
    return refused("CONTROL of an unknown kind");
  out.kind = static_cast<ControlKind>(in.kind());
  return {};
}

}  // namespace pvsfarm
