// The codec: every message survives the trip, and nothing else gets through.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "common/base/random.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/crc32c.hpp"
#include "common/wire/finding_bytes.hpp"

namespace pvsfarm {
namespace {

Bytes some_bytes(std::size_t count) {
  Bytes bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>(i * 7 + 1);
  return bytes;
}

Task some_task() {
  Task task{.lease = LeaseId{77}, .attempt = 2};
  task.parents.push_back({.all = true});
  task.parents.push_back({.set = some_bytes(100)});
  task.parents.push_back({.digest = digest_of(some_bytes(9)), .set_bytes = 900'000});
  task.cells.push_back({CellKey{3, 9}, Cell::aligned({{0.1, 2, 3}, {4, 5, 6.7}}), 1});
  Cell turned{.origin = {1, 2, 3}, .axes = {Vec3{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}}};
  task.cells.push_back({CellKey{4, 1}, turned, 0});
  task.cells.push_back({CellKey{4, 2}, turned, 2});
  return task;
}

Inquiry some_inquiry() {
  Inquiry inquiry{.lease = LeaseId{78}, .attempt = 1};
  inquiry.sets = some_task().parents;
  const Cell cell = Cell::aligned({{0.1, 2, 3}, {4, 5, 6.7}});
  inquiry.audits.push_back({CellKey{3, 9}, cell, 1, 2, 1ull << 63, 300});
  inquiry.audits.push_back({CellKey{3, 8}, cell, 0, 0, 7, 1});
  return inquiry;
}

ExplainFinding some_explanation() {
  ExplainFinding finding{.verdict = Verdict::kHidden, .passed = {}, .parts = {}, .unblocked = {}};
  finding.passed.push_back({ObjectId{3}, 0.5, {1, 2, 3}});
  finding.parts.push_back({.box = {{0, 0, 0}, {1, 1, 1}},
                           .objects = 4,
                           .plane = {.origin = {1, 2, 3}, .away = {0, 0, 1}, .resolution_px = 256},
                           .by_lines = true,
                           .blockers = {{{ObjectId{1}, ObjectId{2}}, 0.75}}});
  finding.unblocked.push_back({{1, 1, 1}, {2, 2, 2}});
  finding.visible = VisibleSet::all(5);
  return finding;
}

Hello some_hello() {
  Hello hello;
  hello.build = std::string("b");
  hello.kernel = {3, std::string("22.3.6")};
  hello.host = std::string("h");
  return hello;
}

std::vector<Message> one_of_each() {
  const Digest digest = digest_of(some_bytes(3));
  ResultBegin begin{.lease = LeaseId{5}, .bytes = 37};
  begin.deltas.push_back({CellKey{1, 1}, 10, 7, 1234, {.cpu_ms = 1.5, .planes = 3}});
  begin.deltas.push_back({CellKey{1, 2}, 20, 0, 0, {.box_tests = 9, .contradictions = 2}});
  begin.deltas[1].statistics.methods[3] = {.hidden_objects = 4, .work = 1ull << 33, .cpu_ms = 2};
  StatusReport status{.output = "a.pvs", .state = "running", .cells_done = 5};
  status.workers.push_back({"host", 12, 5, 1, 20, 1 << 20, "b", "idle", "cell 3/1", 2, 3, 4, 5, 6});
  status.cells_leased = 3, status.cells_resumed = 4, status.cells_quarantined = 2;
  status.quarantined = {"cell 3/1", "cell 4/1"};
  status.journal_bytes = 1ull << 33, status.eta_low_s = 3, status.eta_high_s = 5;
  status.counters = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  status.cell_seconds[12] = 7, status.cpu_s = 2.5, status.resident_bytes = 9;
  return {some_hello(),
          Welcome{.settings = {.raster = RasterKind::kOsmesa},
                  .scene = digest,
                  .scene_bytes = 9,
                  .scene_path = "/x",
                  .kernel_id = digest},
          Reject{RejectCode::kKernel, "no"},
          some_task(),
          Heartbeat{{{LeaseId{1}, 2, {CellKey{3, 9}}}}, 3},
          HeartbeatAck{{LeaseId{1}}, {LeaseId{2}}},
          begin,
          ResultChunk{LeaseId{5}, 10, some_bytes(20)},
          ResultEnd{LeaseId{5}, digest},
          ResultAck{LeaseId{5}, ResultOutcome::kResend},
          TaskFailed{LeaseId{5}, FailureKind::kResource, "out of memory"},
          BlobGet{digest, 512},
          BlobChunk{digest, 512, 1024, some_bytes(512)},
          Cancel{{LeaseId{8}}},
          Drain{},
          Draining{},
          Bye{},
          Shutdown{},
          StatusGet{},
          status,
          Control{ControlKind::kCancel},
          ControlAck{},
          some_inquiry(),
          FindingBegin{LeaseId{6}, 30, {{10, 1.5}, {20, 2}}},
          ChunkCredit{LeaseId{6}, 9}};
}

std::span<const std::byte> view(const std::string& s) { return std::as_bytes(std::span(s)); }

}  // namespace

TEST(Wire, crc32c_gives_the_published_check_value) {
  const std::string digits = "123456789";
  EXPECT_EQ(crc32c(view(digits)), 0xe3069283u);
  EXPECT_EQ(crc32c(view(std::string(32, '\0'))), 0x8a9136aau);
}

TEST(Wire, every_message_survives_the_trip) {
  const std::vector<Message> messages = one_of_each();
  ASSERT_EQ(messages.size(), std::variant_size_v<Message>);
  for (const Message& message : messages) {
    const Frames frames = encode({.session = 8, .epoch = 9, .sequence = 10}, message);
    const Result<Decoded> decoded = decode(view(frames.header), view(frames.body));
    ASSERT_TRUE(decoded.ok()) << type_name(message) << ": " << decoded.error().text;
    EXPECT_EQ(decoded->message.index(), message.index());
    EXPECT_EQ(decoded->envelope.session, 8u);
    EXPECT_EQ(decoded->envelope.epoch, 9u);
    // Nothing lost: encoding it again gives the same bytes.
    EXPECT_EQ(encode({}, decoded->message).body, frames.body) << type_name(message);
  }
}

TEST(Wire, a_status_of_many_workers_with_long_names_fits_a_message) {
  StatusReport status{.output = std::string(9999, 'o'), .last_error = std::string(9999, 'e')};
  StatusReport::Worker worker{.host = std::string(300, 'h'),
                              .pid = ~0u,
                              .cells_done = ~0ull,
                              .leases = ~0u,
                              .silent_ms = ~0ull,
                              .resident_bytes = ~0ull,
                              .build = std::string(300, 'b'),
                              .state = std::string(300, 's'),
                              .running = std::string(300, 'r'),
                              .running_cells = ~0u,
                              .running_ms = ~0ull};
  worker.connected_ms = worker.failures = worker.number = ~0ull;
  status.workers.assign(2 * kMaxReportedWorkers, worker);
  status.quarantined.assign(2 * kMaxNamedCells, std::string(300, 'q'));
  const Frames frames = encode({}, status);
  const auto back =
      std::get<StatusReport>(decode(view(frames.header), view(frames.body)).value().message);
  EXPECT_EQ(back.workers.size(), kMaxReportedWorkers);
  EXPECT_EQ(back.quarantined.size(), kMaxNamedCells);
}

TEST(Wire, a_task_keeps_its_cells_bit_for_bit) {
  const Task task = some_task();
  const Frames frames = encode({}, task);
  const Task back = std::get<Task>(decode(view(frames.header), view(frames.body)).value().message);
  ASSERT_EQ(back.cells.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back.cells[i].cell, task.cells[i].cell);
    EXPECT_EQ(back.cells[i].key, task.cells[i].key);
  }
  EXPECT_EQ(back.parents[1].set, task.parents[1].set);
}

TEST(Wire, every_setting_reaches_the_worker) {
  const EvaluatorSettings settings{.raster = RasterKind::kOsmesa,
                                   .resolution_px = 128,
                                   .planes_per_face = 3,
                                   .extent = 0.75,
                                   .near_m = 0.1,
                                   .methods = {Method::kLookAround, Method::kFineProjection},
                                   .gap = 0.25,
                                   .max_rays = 1ull << 40,
                                   .time_ms = 12.5,
                                   .item_buffer_px = 64,
                                   .budget_triangles = 1ull << 50,
                                   .hint_viewpoints = 24};
  const Frames frames = encode({}, Welcome{.settings = settings});
  const auto decoded = decode(view(frames.header), view(frames.body)).value();
  EXPECT_EQ(std::get<Welcome>(decoded.message).settings, settings);
}

TEST(Wire, a_delta_keeps_what_was_seen_and_by_which_method) {
  ResultBegin begin{.lease = LeaseId{5}, .bytes = 20};
  begin.deltas.push_back({CellKey{1, 1}, 5, 7, 1ull << 40, {.contradictions = 3}, 8});
  StatisticsByMethod& methods = begin.deltas[0].statistics.methods;
  for (std::uint32_t i = 0; i < kMethodCount; ++i)
    methods[i] = {i, i + 10, 1ull << (33 + i), i + 20, i + 30, i + 0.5};
  begin.deltas[0].statistics.rounds = {
      {.method = Method::kSweep, .maps = {9, 1024, 0, 5, 80, 1.1f}, .hidden_objects = 4}};
  const Frames frames = encode({}, begin);
  const auto decoded = decode(view(frames.header), view(frames.body)).value();
  const DeltaHead back = std::get<ResultBegin>(decoded.message).deltas.at(0);
  EXPECT_EQ(back.statistics.rounds, begin.deltas[0].statistics.rounds);
  EXPECT_EQ(back.seen_bytes, 7u);
  EXPECT_EQ(back.hint_bytes, 8u);
  EXPECT_EQ(back.point_triangles, 1ull << 40);
  EXPECT_EQ(back.statistics.contradictions, 3u);
  EXPECT_TRUE(back.statistics.methods == methods);
}

TEST(Wire, the_most_that_a_task_may_tell_of_its_rounds_fits_into_a_message) {
  CascadeRound round{.method = Method::kShafts};
  round.maps.planes = round.maps.resolution_px = round.maps.occluders = ~0u;
  round.open_objects = round.hidden_objects = round.seen_objects = ~0u;
  round.open_triangles = round.hidden_triangles = round.seen_triangles = round.work = ~0ull;
  DeltaHead head{CellKey{~0u, ~0ull >> 2}, 1, 1, ~0ull, {.cpu_ms = 1, .planes = ~0u}, 1};
  head.statistics.rounds.assign(kMaxRounds, round);
  head.statistics.methods.fill({~0u, ~0u, ~0ull, ~0ull, ~0ull, 1});
  ResultBegin begin{.lease = LeaseId{5}, .bytes = 3 * kMaxTaskCells};
  begin.deltas.assign(kMaxTaskCells, head);
  const Frames frames = encode({}, begin);
  EXPECT_LE(frames.body.size(), kMaxBodyBytes);
  EXPECT_TRUE(decode(view(frames.header), view(frames.body)).ok());
}

TEST(Wire, an_explanation_is_asked_for_alone) {
  Inquiry inquiry = some_inquiry();
  const auto arrives = [&] {
    const Frames frames = encode({}, inquiry);
    return decode(view(frames.header), view(frames.body)).ok();
  };
  EXPECT_TRUE(arrives());
  inquiry.explain = {CellKey{1, 1}, Cell{}, 0, ObjectId{5}};
  EXPECT_FALSE(arrives());
  inquiry.audits.clear();
  EXPECT_TRUE(arrives());
  inquiry.explain->parent = 3;  // no such set
  EXPECT_FALSE(arrives());
  inquiry.explain.reset();
  EXPECT_FALSE(arrives());
}

TEST(Wire, a_finding_survives_the_trip_and_nothing_damaged_is_used) {
  AuditFinding audit{.key = {1, 5}, .rays = 9, .seen = VisibleSet::all(5), .violations = {}};
  audit.violations.push_back({ObjectId{4}, {{1, 2, 3}, {4, 5, 6}}});
  for (const Bytes& bytes : {encode_finding(audit), encode_finding(some_explanation())}) {
    const Result<WireFinding> back = decode_finding(bytes, 5);
    ASSERT_TRUE(back.ok()) << back.error().text;
    EXPECT_EQ(std::visit([](const auto& finding) { return encode_finding(finding); }, *back),
              bytes);
    EXPECT_FALSE(decode_finding(bytes, 4).ok());  // of a smaller scene
    EXPECT_FALSE(decode_finding(bytes, 6).ok());
    Random random(7);
    for (int round = 0; round < 5'000; ++round) {
      Bytes damaged = bytes;
      damaged[random.below(damaged.size())] = static_cast<std::byte>(random.below(256));
      for (std::uint64_t n = random.below(3); n > 0; --n) damaged.pop_back();
      (void)decode_finding(damaged, 5);  // must neither crash nor hang
    }
  }
  audit.violations[0].line.eye.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(decode_finding(encode_finding(audit), 5).ok());
}

TEST(Wire, every_truncation_and_every_flipped_bit_of_the_body_is_refused) {
  for (const Message& message : one_of_each()) {
    const Frames frames = encode({}, message);
    for (std::size_t size = 0; size < frames.body.size(); ++size)
      EXPECT_FALSE(decode(view(frames.header), view(frames.body.substr(0, size))).ok());
    for (std::size_t bit = 0; bit < frames.body.size() * 8; bit += 5) {
      std::string body = frames.body;
      body[bit / 8] = static_cast<char>(body[bit / 8] ^ 1 << bit % 8);
      EXPECT_FALSE(decode(view(frames.header), view(body)).ok());
    }
  }
}

TEST(Wire, random_headers_and_bodies_are_survived) {
  Random random(20261122);
  const std::vector<Message> messages = one_of_each();
  for (int round = 0; round < 20'000; ++round) {
    Frames frames = encode({}, messages[random.below(messages.size())]);
    std::string& victim = random.below(2) ? frames.header : frames.body;
    if (victim.empty()) continue;
    for (std::uint64_t n = 1 + random.below(4); n > 0; --n)
      victim[random.below(victim.size())] = static_cast<char>(random.below(256));
    (void)decode(view(frames.header), view(frames.body));  // must neither crash nor hang
  }
}

TEST(Wire, frames_over_their_limit_are_refused_before_parsing) {
  const Frames frames = encode({}, Bye{});
  EXPECT_FALSE(decode(view(std::string(kMaxHeaderBytes + 1, 'x')), {}).ok());
  EXPECT_FALSE(decode(view(frames.header), view(std::string(kMaxBodyBytes + 1, 'x'))).ok());
}

TEST(Wire, values_out_of_range_are_refused) {
  const auto refused = [](const Message& message) {
    const Frames frames = encode({}, message);
    return !decode(view(frames.header), view(frames.body)).ok();
  };
  Task bad_parent = some_task();
  bad_parent.cells[0].parent = 7;
  EXPECT_TRUE(refused(bad_parent));
  Task nan = some_task();
  nan.cells[0].cell.hi.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused(nan));
  Task rootless = some_task();
  rootless.cells[0].key.path = 0;
  EXPECT_TRUE(refused(rootless));
  EXPECT_TRUE(refused(Task{.lease = LeaseId{1}}));
  Task override = some_task();
  override.settings = EvaluatorSettings{};
  EXPECT_FALSE(refused(override));
  override.settings->resolution_px = 4096;
  EXPECT_TRUE(refused(override));
  EXPECT_TRUE(refused(FindingBegin{LeaseId{1}, 5, {{4, 0}}}));
  EXPECT_TRUE(refused(FindingBegin{LeaseId{1}, 0, {}}));
  Hello idle = some_hello();
  idle.slots = 0;
  EXPECT_TRUE(refused(idle));
  EXPECT_TRUE(refused(Welcome{.settings = {.resolution_px = 4096}}));
  EXPECT_TRUE(refused(Welcome{.settings = {.item_buffer_px = 16}}));
  EXPECT_TRUE(refused(Welcome{.settings = {.gap = 1.01}}));
  EXPECT_TRUE(refused(Welcome{.settings = {.time_ms = -1}}));
  EXPECT_TRUE(refused(ResultBegin{.bytes = 5, .deltas = {{CellKey{1, 1}, 4, 0, 0, {}}}}));
  EXPECT_TRUE(refused(ResultBegin{.bytes = 5, .deltas = {{CellKey{1, 1}, 5, 1, 0, {}}}}));
  ResultBegin negative{.bytes = 1, .deltas = {{CellKey{1, 1}, 1, 0, 0, {}}}};
  negative.deltas[0].statistics.methods[0].cpu_ms = -1;
  EXPECT_TRUE(refused(negative));
  EXPECT_TRUE(refused(BlobChunk{.offset = 9, .total_bytes = 10, .data = some_bytes(2)}));
}

}  // namespace pvsfarm
