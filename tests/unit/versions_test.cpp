// Who may work for a coordinator: versions of the protocol before, of and after its own, and
// kernels. Over real sockets, since the answer has to be there within a second.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>

#include "common/wire/socket.hpp"
#include "coordinator/service/desk.hpp"
#include "tests/support/fault_figures.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct NoWork : Work {
  std::vector<CellKey> take_open(std::size_t) override { return {{0, 1}}; }
  Result<Message> task(const BoardTask&, SetShelf&) override { return invalid_input("none"); }
  Status accept(const WorkResult&, WorkAnswer&) override { return {}; }
  std::string give_up(const CellKey&) override { return ""; }
  WorkProgress progress(Millis) override { return {}; }
  std::string name_of(const CellKey&) const override { return ""; }
  std::string when_stopped() const override { return ""; }
};

struct Answer {
  std::optional<Welcome> welcome;
  std::optional<Reject> reject;
  double seconds = 0;
  std::string warning;             // of the coordinator
  std::optional<Leaving> leaving;  // of the worker
};

// What a worker that says `hello` hears from a coordinator whose kernel is the default one.
Answer greet(const Hello& hello) {
  const std::string endpoint = "ipc:///tmp/pvsfarm_versions_" + std::to_string(getpid());
  auto router = Router::bind(endpoint);
  EXPECT_TRUE(router.ok());
  auto dealer = Dealer::connect(endpoint);
  EXPECT_TRUE(dealer.ok());
  NoWork work;
  const EvaluatorSettings settings;
  Desk desk(
      {.evaluator = settings, .pinned_kernel = describe(Hello{}.kernel, settings), .epoch = 1},
      work, 0ms);
  Messenger messenger(hello, 0ms);
  Answer answer;
  const Clock::time_point start = Clock::now();
  const auto now = [&] { return std::chrono::duration_cast<Millis>(Clock::now() - start); };
  while (!answer.welcome && !answer.reject && now() < 5s) {
    messenger.tick(now());
    while (const auto out = messenger.next_outgoing()) (*dealer)->send(out->envelope, out->message);
    (*router)->wait(1ms);
    while (const auto received = (*router)->receive())
      EXPECT_TRUE(desk.receive(received->peer, received->decoded, now()).ok());
    for (const Outgoing& out : desk.take_outgoing())
      (*router)->send(out.peer, out.envelope, out.message);
    (*dealer)->wait(1ms);
    while (const auto received = (*dealer)->receive()) {
      messenger.receive(received->decoded, now());
      if (const auto* welcome = std::get_if<Welcome>(&received->decoded->message))
        answer.welcome = *welcome;
      if (const auto* reject = std::get_if<Reject>(&received->decoded->message))
        answer.reject = *reject;
    }
  }
  answer.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  for (const std::string& warning : desk.take_warnings()) answer.warning += warning;
  answer.leaving = messenger.leaving();
  return answer;
}

Hello hello_of(std::uint32_t major, std::uint32_t lowest, std::uint32_t highest) {
  Hello hello;
  hello.major = major;
  hello.minor_lowest = lowest;
  hello.minor_highest = highest;
  return hello;
}

constexpr std::uint32_t kLow = kProtocolMinorLowest, kHigh = kProtocolMinorHighest;

}  // namespace

TEST(Versions, each_is_accepted_or_refused_with_both_values_within_a_second) {
  struct Case {
    Hello hello;
    std::optional<std::uint32_t> minor;  // agreed on; none: refused
    std::vector<std::string> told;
  };
  const std::string major = std::to_string(kProtocolMajor);
  const std::string ours = "the coordinator " + major + "." + std::to_string(kLow) + " to " +
                           major + "." + std::to_string(kHigh);
  Hello other_kernel;
  other_kernel.kernel.algorithm_version += 1;
  const EvaluatorSettings settings;
  const std::vector<Case> cases{
      {hello_of(kProtocolMajor, kLow, kHigh), kHigh, {}},
      {hello_of(kProtocolMajor, kLow, kHigh - 1), kHigh - 1, {}},
      {hello_of(kProtocolMajor, kLow, kHigh + 1), kHigh, {}},
      {hello_of(kProtocolMajor, kHigh + 1, kHigh + 2), {}, {"." + std::to_string(kHigh + 1), ours}},
      {hello_of(kProtocolMajor - 1, 0, 9), {}, {std::to_string(kProtocolMajor - 1) + ".0", ours}},
      {hello_of(kProtocolMajor + 1, 0, 0), {}, {std::to_string(kProtocolMajor + 1) + ".0", ours}},
      {other_kernel,
       {},
       {describe(other_kernel.kernel, settings), describe(Hello{}.kernel, settings)}}};
  double slowest_s = 0;
  for (const Case& of : cases) {
    SCOPED_TRACE(std::to_string(of.hello.major) + "." + std::to_string(of.hello.minor_lowest) +
                 " to " + std::to_string(of.hello.minor_highest));
    const Answer answer = greet(of.hello);
    slowest_s = std::max(slowest_s, answer.seconds);
    ASSERT_EQ(answer.welcome.has_value(), of.minor.has_value());
    if (of.minor) {
      EXPECT_EQ(answer.welcome->minor, *of.minor);
      EXPECT_FALSE(answer.leaving.has_value());
      continue;
    }
    ASSERT_TRUE(answer.reject.has_value());
    for (const std::string& value : of.told) {
      EXPECT_NE(answer.reject->text.find(value), std::string::npos) << answer.reject->text;
      EXPECT_NE(answer.warning.find(value), std::string::npos) << answer.warning;
    }
    ASSERT_TRUE(answer.leaving.has_value());
    EXPECT_EQ(answer.leaving->exit_code, kExitDoNotRetry);
    EXPECT_NE(answer.leaving->text.find(answer.reject->text), std::string::npos);
  }
  EXPECT_LT(slowest_s, 1);
  record({.row = 22,
          .what = std::to_string(cases.size()) + " versions and kernels answered wrongly; slowest",
          .asked = "0; 1 s",
          .reached = (HasFailure() ? "some; " : "0; ") + std::to_string(slowest_s) + " s",
          .held = !HasFailure()});
}

}  // namespace pvsfarm
