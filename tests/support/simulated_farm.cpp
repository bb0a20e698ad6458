#include "tests/support/simulated_farm.hpp"

#include <algorithm>
#include <cstdlib>
#include <span>

#include "common/base/check.hpp"

namespace pvsfarm {

using namespace std::chrono_literals;

namespace {

void add_faults(std::vector<MessageFault>& faults, const Message& message, bool large = false) {
  using Kind = MessageFault::Kind;
  for (const auto& [kind, name] :
       {std::pair(Kind::kLost, " lost"), std::pair(Kind::kRepeated, " repeated"),
        std::pair(Kind::kDelayed, " delayed")})
    faults.push_back({type_name(message) + name, message.index(), kind, large});
}

}  // namespace

std::vector<MessageFault> message_faults() {
  std::vector<MessageFault> faults;
  for (const Message& message : std::vector<Message>{
           Hello{},       Welcome{},      Reject{},    Task{},      Heartbeat{},  HeartbeatAck{},
           ResultBegin{}, ResultChunk{},  ResultEnd{}, ResultAck{}, TaskFailed{}, BlobGet{},
           BlobChunk{},   Cancel{},       Draining{},  Bye{},       Drain{},      Shutdown{},
           StatusGet{},   StatusReport{}, Control{},   ControlAck{}})
    add_faults(faults, message);
  add_faults(faults, ChunkCredit{}, true);
  return faults;
}

std::vector<MessageFault> inquiry_faults() {
  std::vector<MessageFault> faults;
  for (const Message& message :
       std::vector<Message>{Inquiry{}, Task{}, FindingBegin{}, ResultBegin{}, ResultChunk{},
                            ResultEnd{}, ResultAck{}, Heartbeat{}, HeartbeatAck{}, BlobGet{},
                            BlobChunk{}, Cancel{}, ChunkCredit{}})
    add_faults(faults, message);
  return faults;
}

void SimulatedNetwork::post(Packet packet, Millis now) {
  using Kind = MessageFault::Kind;
  const bool chosen =
      !faults_.only.what.empty() && packet.type == faults_.only.type && random_.unit() < 0.5;
  const auto happens = [&](Kind kind, double probability) {
    return (chosen && faults_.only.kind == kind) || random_.unit() < probability;
  };
  if (happens(Kind::kLost, faults_.lost)) return;
  const int copies = happens(Kind::kRepeated, faults_.repeated) ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    packet.time = now + 1ms + Millis(random_.below(20));
    if (faults_.in_order) {
      Millis& last = last_arrival_[packet.peer + (packet.to_worker ? "<" : ">")];
      packet.time = last = std::max(last, packet.time);
    }
    if (happens(Kind::kDelayed, faults_.delayed)) packet.time += Millis(random_.below(45'000));
    packet.order = ++order_;
    packets_.push(packet);
  }
}

std::optional<Packet> SimulatedNetwork::next(Millis now) {
  if (packets_.empty() || packets_.top().time > now) return {};
  Packet packet = packets_.top();
  packets_.pop();
  return packet;
}

SimulatedWorker new_worker(std::uint64_t connection, Random& random, Millis now,
                           std::uint32_t minor_highest) {
  Hello hello;
  hello.minor_highest = minor_highest;
  hello.pid = static_cast<std::uint32_t>(connection);
  for (std::uint8_t& b : hello.worker) b = static_cast<std::uint8_t>(random.next());
  SimulatedWorker worker{.peer = std::to_string(connection)};
  worker.messenger = std::make_unique<Messenger>(hello, now);
  return worker;
}

void tell_progress(SimulatedWorker& worker, Millis now) {
  const auto left = static_cast<std::uint64_t>((worker.job_ends - now).count());
  const std::uint64_t progress = worker.hangs ? 1 : 1'000'000'000 - left;
  worker.messenger->set_progress(Running{worker.job->lease(), progress}, 0);
}

Decoded decoded(const Packet& packet) {
  const auto view = [](const std::string& s) { return std::as_bytes(std::span(s)); };
  auto message = decode(view(packet.frames.header), view(packet.frames.body));
  if (!message.ok()) PVS_CHECK_EQ(message.error().text, "");
  return std::move(message).value();
}

void run_seeds(std::uint64_t count, const std::function<void(std::uint64_t seed)>& simulate) {
  std::uint64_t first = 1;
  if (const char* seed = std::getenv("PVSFARM_SEED")) {
    first = std::strtoull(seed, nullptr, 10);
    count = 1;
  }
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE(testing::Message() << "PVSFARM_SEED=" << seed);
    simulate(seed);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace pvsfarm
