#include <algorithm>

#include "common/base/check.hpp"
#include "common/wire/convert.hpp"

namespace pvsfarm {
namespace {

std::uint64_t raw(LeaseId id) { return static_cast<std::uint64_t>(id); }

std::string text_of(const std::string& text) { return text.substr(0, kMaxTextBytes); }

template <class Container>
std::string bytes_of(const Container& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

template <class Out>
void pack_vec(const Vec3& v, Out* out) {
  for (int a = 0; a < 3; ++a) out->Add(v[a]);
}

}  // namespace

void pack_key(const CellKey& key, proto::CellKey& out) {
  out.set_root(key.root);
  out.set_path(key.path);
}

void pack_cell(const Cell& cell, proto::Cell& out) {
  const Cell aligned{};
  if (cell.origin != aligned.origin) pack_vec(cell.origin, out.mutable_origin());
  if (cell.axes != aligned.axes)
    for (const Vec3& axis : cell.axes) pack_vec(axis, out.mutable_axes());
  pack_vec(cell.lo, out.mutable_lo());
  pack_vec(cell.hi, out.mutable_hi());
}

void pack_set(const ParentSet& set, proto::ParentSet& out) {
  if (set.all) {
    out.set_all(true);
  } else if (set.set_bytes == 0) {
    out.set_set(bytes_of(set.set));
  } else {
    out.set_digest(bytes_of(set.digest.bytes));
    out.set_set_bytes(set.set_bytes);
  }
}

namespace {

void pack_settings(const EvaluatorSettings& settings, proto::EvaluatorSettings& out) {
  out.set_raster(settings.raster == RasterKind::kOsmesa ? proto::RASTER_OSMESA
                                                        : proto::RASTER_DIRECT);
  out.set_resolution_px(static_cast<std::uint32_t>(settings.resolution_px));
  out.set_planes_per_face(static_cast<std::uint32_t>(settings.planes_per_face));
  out.set_extent(settings.extent);
  out.set_near_m(settings.near_m);
  out.set_methods(settings.methods.bits());
  out.set_gap(settings.gap);
  out.set_max_rays(settings.max_rays);
  out.set_time_ms(settings.time_ms);
  out.set_item_buffer_px(static_cast<std::uint32_t>(settings.item_buffer_px));
  out.set_budget_triangles(settings.budget_triangles);
  out.set_hint_viewpoints(settings.hint_viewpoints);
}

void pack_statistics(const CellStatistics& statistics, proto::Statistics& out) {
  out.set_cpu_ms(statistics.cpu_ms);
  out.set_planes(statistics.planes);
  out.set_occluder_candidates(statistics.occluder_candidates);
  out.set_projections(statistics.projections);
  out.set_occluders_skipped(statistics.occluders_skipped);
  out.set_box_tests(statistics.box_tests);
  out.set_contradictions(statistics.contradictions);
  if (!statistics.rounds.empty()) out.set_rounds(bytes_of(encode_rounds(statistics.rounds)));
  if (statistics.methods == StatisticsByMethod{}) return;
  for (const MethodStatistics& method : statistics.methods) {
    proto::MethodStatistics& to = *out.add_methods();
    to.set_hidden_objects(method.hidden_objects);
    to.set_seen_objects(method.seen_objects);
    to.set_hidden_triangles(method.hidden_triangles);
    to.set_seen_triangles(method.seen_triangles);
    to.set_work(method.work);
    to.set_cpu_ms(method.cpu_ms);
  }
}

}  // namespace

void pack(const Hello& plain, proto::Hello& message) {
  message.set_major(plain.major);
  message.set_minor_lowest(plain.minor_lowest);
  message.set_minor_highest(plain.minor_highest);
  message.set_build(text_of(plain.build));
  message.mutable_kernel()->set_algorithm_version(
      static_cast<std::uint32_t>(plain.kernel.algorithm_version));
  message.mutable_kernel()->set_mesa_version(text_of(plain.kernel.mesa_version));
  message.set_slots(plain.slots);
  message.set_worker(bytes_of(plain.worker));
  message.set_host(text_of(plain.host));
  message.set_pid(plain.pid);
}

void pack(const Welcome& plain, proto::Welcome& message) {
  message.set_minor(plain.minor);
  pack_settings(plain.settings, *message.mutable_settings());
  message.set_scene_digest(bytes_of(plain.scene.bytes));
  message.set_scene_bytes(plain.scene_bytes);
  message.set_scene_path(text_of(plain.scene_path));
  message.set_kernel_id(bytes_of(plain.kernel_id.bytes));
  message.set_heartbeat_ms(plain.heartbeat_ms);
}

void pack(const Reject& plain, proto::Reject& message) {
  message.set_code(static_cast<proto::RejectCode>(plain.code));
  message.set_text(text_of(plain.text));
}

void pack(const Task& plain, proto::Task& message) {
  PVS_CHECK_LE(plain.cells.size(), kMaxTaskCells);
  message.set_lease(raw(plain.lease));
  message.set_attempt(plain.attempt);
  for (const ParentSet& parent : plain.parents) pack_set(parent, *message.add_parents());
  for (const TaskCell& cell : plain.cells) {
    proto::TaskCell& out = *message.add_cells();
    pack_key(cell.key, *out.mutable_key());
    pack_cell(cell.cell, *out.mutable_cell());
    out.set_parent(cell.parent);
  }
  if (plain.settings) pack_settings(*plain.settings, *message.mutable_settings());
}

void pack(const Heartbeat& plain, proto::Heartbeat& message) {
  for (const Heartbeat::Running& running : plain.running) {
    proto::Heartbeat::Running& out = *message.add_running();
    out.set_lease(raw(running.lease));
    out.set_progress(running.progress);
    for (const CellKey& key : running.cells) pack_key(key, *out.add_cells());
  }
  message.set_resident_bytes(plain.resident_bytes);
  message.set_ready(plain.ready);
}

void pack(const HeartbeatAck& plain, proto::HeartbeatAck& message) {
  for (const LeaseId id : plain.renewed) message.add_renewed(raw(id));
  for (const LeaseId id : plain.cancelled) message.add_cancelled(raw(id));
}

void pack(const ResultBegin& plain, proto::ResultBegin& message) {
  PVS_CHECK_LE(plain.deltas.size(), kMaxTaskCells);
  message.set_lease(raw(plain.lease));
  message.set_bytes(plain.bytes);
  for (const DeltaHead& delta : plain.deltas) {
    proto::Delta& out = *message.add_deltas();
    pack_key(delta.key, *out.mutable_key());
    out.set_hidden_bytes(delta.hidden_bytes);
    out.set_seen_bytes(delta.seen_bytes);
    out.set_hint_bytes(delta.hint_bytes);
    out.set_point_triangles(delta.point_triangles);
    pack_statistics(delta.statistics, *out.mutable_statistics());
  }
}

void pack(const ResultChunk& plain, proto::ResultChunk& message) {
  PVS_CHECK_LE(plain.data.size(), kChunkBytes);
  message.set_lease(raw(plain.lease));
  message.set_offset(plain.offset);
  message.set_data(bytes_of(plain.data));
}

void pack(const ResultEnd& plain, proto::ResultEnd& message) {
  message.set_lease(raw(plain.lease));
  message.set_digest(bytes_of(plain.digest.bytes));
}

void pack(const ChunkCredit& plain, proto::ChunkCredit& message) {
  message.set_lease(raw(plain.lease));
  message.set_chunks(plain.chunks);
}

void pack(const ResultAck& plain, proto::ResultAck& message) {
  message.set_lease(raw(plain.lease));
  message.set_outcome(static_cast<proto::ResultOutcome>(plain.outcome));
}

void pack(const TaskFailed& plain, proto::TaskFailed& message) {
  message.set_lease(raw(plain.lease));
  message.set_kind(static_cast<proto::FailureKind>(plain.kind));
  message.set_text(text_of(plain.text));
}

void pack(const BlobGet& plain, proto::BlobGet& message) {
  message.set_digest(bytes_of(plain.digest.bytes));
  message.set_offset(plain.offset);
}

void pack(const BlobChunk& plain, proto::BlobChunk& message) {
  PVS_CHECK_LE(plain.data.size(), kChunkBytes);
  message.set_digest(bytes_of(plain.digest.bytes));
  message.set_offset(plain.offset);
  message.set_total_bytes(plain.total_bytes);
  message.set_data(bytes_of(plain.data));
}

void pack(const Cancel& plain, proto::Cancel& message) {
  for (const LeaseId id : plain.leases) message.add_leases(raw(id));
}

void pack(const Drain&, proto::Empty&) {}
void pack(const Draining&, proto::Empty&) {}
void pack(const Bye&, proto::Empty&) {}
void pack(const Shutdown&, proto::Empty&) {}
void pack(const StatusGet&, proto::Empty&) {}
void pack(const ControlAck&, proto::Empty&) {}

void pack(const Control& plain, proto::Control& message) {
  message.set_kind(static_cast<proto::ControlKind>(plain.kind));
}

}  // namespace pvsfarm
