// What comes from the network: header and body, as they come, and bodies behind a fitting header.
#include "common/wire/codec.hpp"
#include "common/wire/crc32c.hpp"
#include "common/wire/finding_bytes.hpp"
#include "common/wire/keys.hpp"
#include "tests/fuzz/driver.hpp"

namespace pvsfarm::fuzz {

const char* const kTarget = "envelope";
const std::size_t kMaxInput = 8192;

namespace {

constexpr std::uint8_t kRaw = 0xff;      // [1] header length, header, body
constexpr std::uint8_t kFinding = 0xfe;  // the bytes of an answer
constexpr std::uint8_t kList = 0xfd;     // an allow-list; else the body of that type

std::string fixed32(std::uint32_t value) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift);
  return bytes;
}

std::string header(std::uint8_t type, std::span<const std::byte> body) {
  return '\x0d' + fixed32(0x46535650) + '\x10' + static_cast<char>(kProtocolMajor) + '\x20' +
         static_cast<char>(type) + '\x45' + fixed32(crc32c(body));
}

// Messages with something in each part.
std::vector<Message> samples() {
  const Digest digest = digest_of({});
  const Bytes bytes(40, std::byte{7});
  Task task{.lease = LeaseId{77}, .attempt = 2};
  task.parents = {{.all = true}, {.set = bytes}, {.digest = digest, .set_bytes = 900}};
  const Cell cell = Cell::aligned({{0.1, 2, 3}, {4, 5, 6.7}});
  task.cells = {{CellKey{3, 9}, cell, 1}, {CellKey{4, 1}, cell, 2}};
  task.settings.emplace();
  Inquiry audit{.lease = LeaseId{78}, .sets = task.parents};
  audit.audits.push_back({CellKey{3, 9}, cell, 1, 2, 5, 300});
  Inquiry explain{.lease = LeaseId{79}, .sets = task.parents};
  explain.explain = ExplainAsked{CellKey{3, 9}, cell, 0, ObjectId{2}};
  ResultBegin begin{.lease = LeaseId{5}, .bytes = 17};
  begin.deltas.push_back({CellKey{1, 1}, 10, 7, 1234, {.cpu_ms = 1.5, .planes = 3}});
  StatusReport status{.output = "a.pvs", .state = "running", .cells_done = 5};
  status.workers.push_back({"host", 12, 5, 1, 20, 1 << 20});
  Hello hello;
  hello.host = "h";
  return {hello,
          Welcome{.scene = digest, .scene_bytes = 9, .scene_path = "/x", .kernel_id = digest},
          Reject{RejectCode::kKernel, "no"},
          task,
          audit,
          explain,
          begin,
          status,
          Heartbeat{{{LeaseId{1}, 2}}, 3, true},
          HeartbeatAck{{LeaseId{1}}, {LeaseId{2}}},
          ResultChunk{LeaseId{5}, 10, bytes},
          ResultEnd{LeaseId{5}, digest},
          TaskFailed{LeaseId{5}, FailureKind::kResource, "out of memory"},
          BlobGet{digest, 512},
          BlobChunk{digest, 512, 1024, bytes},
          Cancel{{LeaseId{8}}},
          Control{},
          FindingBegin{LeaseId{6}, 30, {{10, 1.5}, {20, 2}}}};
}

}  // namespace

std::vector<Input> seeds() {
  std::vector<Input> all;
  for (const Message& message : samples()) {
    const Frames frames = encode({.session = 8, .epoch = 9}, message);
    // The type's number is the header's fourth field; a raw one stands beside.
    const std::size_t type = frames.header.find('\x20', 5);
    all.push_back(input_of(frames.header.substr(type + 1, 1) + frames.body));
    all.push_back(input_of(static_cast<char>(kRaw) + std::string(1, char(frames.header.size())) +
                           frames.header + frames.body));
  }
  for (const Bytes& bytes : {encode_finding(AuditFinding{}), encode_finding(ExplainFinding{})}) {
    Input input{kFinding};
    for (const std::byte b : bytes) input.push_back(static_cast<std::uint8_t>(b));
    all.push_back(std::move(input));
  }
  all.push_back(input_of(std::string(1, static_cast<char>(kList)) + "# a\nworker " +
                         std::string(64, 'a') + " n\n"));
  return all;
}

void run(std::span<const std::uint8_t> input) {
  if (input.empty()) return;
  const std::span<const std::byte> rest = std::as_bytes(input.subspan(1));
  if (input[0] == kList) {
    (void)AllowList::parse({reinterpret_cast<const char*>(rest.data()), rest.size()}, "list");
    return;
  }
  if (input[0] == kFinding) {
    (void)decode_finding(rest, 500);
    return;
  }
  Result<Decoded> decoded = runtime_error("");
  if (input[0] == kRaw) {
    if (rest.empty()) return;
    const std::size_t length = std::min<std::size_t>(input[1], rest.size() - 1);
    decoded = decode(rest.subspan(1, length), rest.subspan(1 + length));
  } else {
    const std::string head = header(input[0], rest);
    decoded = decode(std::as_bytes(std::span(head)), rest);
  }
  if (!decoded) return;
  // What was let through can be sent on, and says the same then.
  const Frames again = encode(decoded->envelope, decoded->message);
  const auto back =
      decode(std::as_bytes(std::span(again.header)), std::as_bytes(std::span(again.body)));
  PVS_CHECK(back.ok());
  PVS_CHECK_EQ(back->message.index(), decoded->message.index());
}

}  // namespace pvsfarm::fuzz
