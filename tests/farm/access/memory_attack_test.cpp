// Peers that want a coordinator to run out of memory: frames of 8 GiB, messages without an end,
// bodies that grow when parsed, handshakes that are begun and left. Row 20 of the fault table.
#include <sys/resource.h>

#include <atomic>
#include <cstdio>

#include "common/wire/crc32c.hpp"
#include "common/wire/socket.hpp"
#include "tests/farm/access/raw_peer.hpp"
#include "tests/farm/process.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using std::chrono::milliseconds;

constexpr double kMiB = 1 << 20;
constexpr double kAllowedMiB = 64;
constexpr std::size_t kBlock = 64 << 10;

double resident_mib() {
  unsigned long pages = 0, resident = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu %lu", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return static_cast<double>(resident * static_cast<unsigned long>(sysconf(_SC_PAGESIZE))) / kMiB;
}

// The most that this process has held since, beyond what it held then.
class Growth {
 public:
  Growth() : thread_([this] { watch(); }) {}
  ~Growth() {
    stop_ = true;
    thread_.join();
  }
  double mib() const { return most_ - before_; }

 private:
  void watch() {
    while (!stop_) {
      most_ = std::max(most_.load(), resident_mib());
      std::this_thread::sleep_for(milliseconds(2));
    }
  }
  double before_ = resident_mib();
  std::atomic<double> most_{before_};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// Reads as a coordinator does, and answers what it understands.
class Reader {
 public:
  explicit Reader(std::optional<ServerSecurity> security = {}) {
    router_ = Router::bind("tcp://127.0.0.1:*", std::move(security)).value();
    endpoint_ = router_->endpoint();
    thread_ = std::thread([this] {
      while (!stop_) {
        router_->wait(milliseconds(5));
        while (const auto received = router_->receive()) {
          received->decoded ? ++understood_ : ++refused_;
          router_->send(received->peer, {}, ControlAck{});
        }
      }
    });
  }
  ~Reader() {
    stop_ = true;
    thread_.join();
  }
  const std::string& endpoint() const { return endpoint_; }
  unsigned understood() const { return understood_; }
  unsigned refused() const { return refused_; }

  // That an honest peer is still served.
  bool serves(const std::optional<ClientSecurity>& security = {}) const {
    const auto dealer = Dealer::connect(endpoint_, security).value();
    dealer->send({}, StatusGet{});
    return wait_until(15, [&] {
      dealer->wait(milliseconds(5));
      return dealer->receive().has_value();
    });
  }

 private:
  std::unique_ptr<Router> router_;
  std::string endpoint_;
  std::atomic<bool> stop_{false};
  std::atomic<unsigned> understood_{0}, refused_{0};
  std::thread thread_;
};

RawPeer greeted(const Reader& reader) {
  RawPeer peer(reader.endpoint());
  EXPECT_TRUE(peer.connected());
  EXPECT_TRUE(peer.shake_hands());
  return peer;
}

void expect_small(const char* what, const Growth& growth) {
  EXPECT_LE(growth.mib(), kAllowedMiB) << what;
  char reached[32];
  std::snprintf(reached, sizeof reached, "%.0f MiB", growth.mib());
  record({.row = 20,
          .what = what,
          .asked = "at most 64 MiB more",
          .reached = reached,
          .held = growth.mib() <= kAllowedMiB});
}

TEST(MemoryAttack, a_frame_of_eight_gibibytes_ends_its_connection) {
  const Reader reader;
  const Growth growth;
  const std::string block(kBlock, 'x');
  for (int i = 0; i < 8; ++i) {
    const RawPeer peer = greeted(reader);
    peer.send(std::string("\3", 1) + RawPeer::long_length(8ull << 30));
    int sent = 0;
    while (sent < 2048 && peer.send(block)) ++sent;
    EXPECT_TRUE(peer.hangs_up(5));
  }
  EXPECT_TRUE(reader.serves());
  expect_small("frames of 8 GiB from 8 peers", growth);
}

// Frames until the other end hangs up; how many bytes it took.
std::size_t send_endlessly(const RawPeer& peer, const std::string& frames, std::size_t limit) {
  std::size_t sent = 0;
  while (sent < limit && peer.send(frames)) sent += frames.size();
  return sent;
}

TEST(MemoryAttack, a_message_without_an_end_ends_its_connection) {
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{200}, kBlock}) {
    const Reader reader;
    const Growth growth;
    const std::string one = RawPeer::frame(std::string(bytes, 'x'), 1);
    std::string frames;
    while (frames.size() < kBlock) frames += one;
    const std::size_t limit = 256u << 20;
    const RawPeer peer = greeted(reader);
    EXPECT_LT(send_endlessly(peer, frames, limit), limit) << "frames of " << bytes;
    EXPECT_TRUE(reader.serves());
    const std::string what =
        "a message without an end, in frames of " + std::to_string(bytes) + " bytes";
    expect_small(what.c_str(), growth);
  }
}

// The guard must not take haste for malice.
TEST(MemoryAttack, large_honest_messages_one_after_another_are_all_read) {
  const Reader reader;
  const auto dealer = Dealer::connect(reader.endpoint()).value();
  const ResultChunk chunk{LeaseId{1}, 0, Bytes(kChunkBytes)};
  constexpr unsigned kCount = 400;
  for (unsigned sent = 0; sent < kCount; ++sent)
    while (dealer->send({}, chunk) == SendOutcome::kFull) dealer->wait(milliseconds(5));
  EXPECT_TRUE(wait_until(30, [&] {
    dealer->wait(milliseconds(5));
    return reader.understood() == kCount;
  }));
  EXPECT_EQ(reader.understood(), kCount);
  EXPECT_EQ(dealer->handshake(), Dealer::Handshake::kFine);
}

// libzmq 4.3 aborts if its own heartbeat falls due between a peer's reset and the reading of what
// the peer had sent before; so none is used.
TEST(MemoryAttack, a_reset_while_messages_wait_does_not_end_the_process) {
  std::vector<std::unique_ptr<Router>> routers;
  const std::string messages = RawPeer::message({"header", std::string(kBlock, 'x')});
  for (int i = 0; i < 4; ++i) {
    Router& router = *routers.emplace_back(Router::bind("tcp://127.0.0.1:*").value());
    RawPeer peer(router.endpoint());
    ASSERT_TRUE(peer.shake_hands());
    for (int sent = 0; sent < 40 && peer.send(messages); ++sent) {
    }
    // A reset drops what the kernel still holds: libzmq must have begun to read.
    ASSERT_TRUE(wait_until(15, [&] {
      router.wait(milliseconds(50));
      return router.receive().has_value();
    }));
    std::this_thread::sleep_for(milliseconds(100));
    peer.reset();
  }
  std::this_thread::sleep_for(std::chrono::seconds(6));
  for (const auto& router : routers)
    while (router->receive()) {
    }
}

std::string fixed32(std::uint32_t value) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift);
  return bytes;
}

// Of proto/farm.proto: magic, major, type, checksum.
std::string header(int type, const std::string& body) {
  return '\x0d' + fixed32(0x46535650) + '\x10' + static_cast<char>(kProtocolMajor) + '\x20' +
         static_cast<char>(type) + '\x45' + fixed32(crc32c(std::as_bytes(std::span(body))));
}

TEST(MemoryAttack, bodies_of_empty_parts_are_refused_unparsed) {
  const Reader reader;
  const RawPeer peer = greeted(reader);
  const Growth growth;
  unsigned sent = 0;
  // Of each type the tags of fields 1 to 6, as sub-messages, without contents.
  for (int type = 1; type <= 24; ++type)
    for (int field = 1; field <= 6; ++field) {
      std::string body;
      while (body.size() + 2 <= kMaxBodyBytes)
        body += static_cast<char>(field << 3 | 2), body += '\0';
      peer.send(RawPeer::message({header(type, body), body}));
      ++sent;
    }
  // And all of them inside one: statistics of a delta of a result.
  std::string methods;
  while (methods.size() + 16 <= kMaxBodyBytes) methods += "\x7a", methods += '\0';
  peer.send(RawPeer::message({header(7, methods), methods}));
  EXPECT_TRUE(wait_until(60, [&] { return reader.refused() + reader.understood() > sent; }));
  EXPECT_TRUE(reader.serves());
  expect_small("145 bodies of 524,288 empty parts", growth);
}

TEST(MemoryAttack, a_thousand_handshakes_that_are_begun_and_left) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  const KeyPair server = make_key_pair(), viewer = make_key_pair();
  for (const bool with_keys : {false, true}) {
    std::optional<ServerSecurity> security;
    if (with_keys)
      security = ServerSecurity{
          server, AllowList::parse("viewer " + hex_of(viewer.public_key), "list").value()};
    const Reader reader(std::move(security));
    const Growth growth;
    std::vector<RawPeer> peers;
    for (int i = 0; i < 1000; ++i) {
      const RawPeer& peer = peers.emplace_back(reader.endpoint());
      ASSERT_TRUE(peer.connected()) << i;
      const std::string hello = RawPeer::greeting(with_keys ? "CURVE" : "NULL");
      peer.send(hello.substr(0, i % 3 == 0 ? 5 : hello.size()));
    }
    std::optional<ClientSecurity> own;
    if (with_keys) own = ClientSecurity{viewer, server.public_key};
    EXPECT_TRUE(reader.serves(own)) << "behind the others";
    EXPECT_TRUE(peers.front().hangs_up(5)) << "the oldest";
    expect_small(with_keys ? "1,000 half-open handshakes, with keys" : "1,000 half-open handshakes",
                 growth);
  }
}

}  // namespace
}  // namespace pvsfarm
