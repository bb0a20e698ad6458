// Sockets of a process that gets signals: a call that one of them cuts short is no failure.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>

#include "common/wire/socket.hpp"

namespace {

constexpr int kCutEvery = 3;
std::atomic<bool> cutting{false};
std::atomic<int> cuts{0};

// Whether a thread's look at file descriptors is cut short now. ZeroMQ's own threads get no
// signals.
bool cut_short() {
  thread_local int looks = 0;
  if (!cutting || ++looks % kCutEvery != 0) return false;
  std::array<char, 16> name{};
  prctl(PR_GET_NAME, name.data());
  if (std::string(name.data()).rfind("ZMQbg", 0) == 0) return false;
  ++cuts;
  errno = EINTR;
  return true;
}

}  // namespace

// Before the C library's.
extern "C" int poll(pollfd* fds, nfds_t count, int timeout_ms) {
  if (cut_short()) return -1;
  return static_cast<int>(syscall(SYS_poll, fds, count, timeout_ms));
}

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

class SocketSignals : public testing::Test {
 protected:
  void SetUp() override {
    const KeyPair coordinator = make_key_pair(), worker = make_key_pair();
    auto list = AllowList::parse("worker " + hex_of(worker.public_key) + " w\n", "list");
    ASSERT_TRUE(list.ok()) << list.error().text;
    auto bound =
        Router::bind("tcp://127.0.0.1:*", ServerSecurity{coordinator, std::move(list).value()});
    ASSERT_TRUE(bound.ok()) << bound.error().text;
    router_ = std::move(bound).value();
    security_ = ClientSecurity{worker, coordinator.public_key};
    connect();
  }
  void connect() {
    auto connected = Dealer::connect(router_->endpoint(), security_);
    ASSERT_TRUE(connected.ok()) << connected.error().text;
    dealer_ = std::move(connected).value();
  }
  void TearDown() override { cutting = false; }

  // There and back again; false: a message is lost.
  bool exchange() {
    dealer_->send({}, StatusGet{});
    std::optional<Received> got;
    const auto end = Clock::now() + 20s;
    while (!(got = router_->receive()) && Clock::now() < end) {
      dealer_->wait(1ms);
      router_->wait(10ms);
    }
    if (!got || !got->decoded || !std::holds_alternative<StatusGet>(got->decoded->message))
      return false;
    router_->send(got->peer, {}, ControlAck{});
    while (!(got = dealer_->receive()) && Clock::now() < end) dealer_->wait(10ms);
    return got && got->decoded && std::holds_alternative<ControlAck>(got->decoded->message);
  }

  ClientSecurity security_;
  std::unique_ptr<Router> router_;
  std::unique_ptr<Dealer> dealer_;
};

}  // namespace

TEST_F(SocketSignals, every_third_look_is_cut_short_and_no_message_is_lost) {
  cutting = true;
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(exchange()) << i;
  EXPECT_EQ(dealer_->handshake(), Dealer::Handshake::kFine);
  for (int i = 0; i < 5; ++i) {  // who lets them in is interrupted as well
    connect();
    ASSERT_TRUE(exchange()) << "connection " << i;
  }
  EXPECT_GT(cuts, 100);
}

// A handler without SA_RESTART, as the worker's own: poll() is never taken up again after it.
TEST_F(SocketSignals, a_signal_ends_a_wait_and_nothing_else) {
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) {};
  sigaction(SIGALRM, &action, &before);
  const itimerval soon{{0, 0}, {0, 100'000}}, never{};
  for (const bool at_router : {true, false}) {
    ASSERT_TRUE(exchange());
    const auto start = Clock::now();
    setitimer(ITIMER_REAL, &soon, nullptr);
    at_router ? router_->wait(30s) : dealer_->wait(30s);
    EXPECT_LT(Clock::now() - start, 20s);
    EXPECT_TRUE(exchange());
  }
  setitimer(ITIMER_REAL, &never, nullptr);
  sigaction(SIGALRM, &before, nullptr);
}

}  // namespace pvsfarm
