// Row 23 of the fault table: the coordinator is gone, and hundreds of workers want to be back. What
// counts is how often they knock meanwhile, and how soon all are back with its successor.
#include <algorithm>
#include <fstream>
#include <sstream>

#include "common/wire/socket.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"
#include "tests/farm/two_hosts.hpp"
#include "tests/support/fault_figures.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {
namespace {

using ReconnectStormTest = FarmFixture;
constexpr int kPort = 5571;

// Attempts to connect from this thread's host so far.
std::uint64_t connects() {
  std::ifstream file("/proc/thread-self/net/snmp");
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("Tcp:", 0) != 0) continue;
    std::istringstream words(line);
    std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
    if (names.empty()) {
      names = fields;
      continue;
    }
    const auto at = std::find(names.begin(), names.end(), "ActiveOpens") - names.begin();
    return std::stoull(fields[static_cast<std::size_t>(at)]);
  }
  return 0;
}

// Workers that greet, tell that they live, and never ask for anything.
class Idlers {
 public:
  Idlers(int count, const std::string& endpoint) {
    for (int i = 0; i < count; ++i) {
      Hello hello;
      hello.host = "idler";
      hello.pid = static_cast<std::uint32_t>(1'000'000 + i);
      for (std::size_t b = 0; b < 4; ++b)
        hello.worker[b] = static_cast<std::uint8_t>(hello.pid >> (8 * b));
      idlers_.push_back({Dealer::connect(endpoint).value(), Messenger(hello, now())});
    }
  }
  void turn() {
    for (Idler& idler : idlers_) {
      while (const auto received = idler.dealer->receive())
        idler.messenger.receive(received->decoded, now());
      idler.messenger.tick(now());
      while (idler.dealer->queued() < 8) {
        const auto out = idler.messenger.next_outgoing();
        if (!out) break;
        idler.dealer->send(out->envelope, out->message);
      }
    }
  }
  void turn_for(std::chrono::milliseconds time) {
    for (const auto end = TestClock::now() + time; TestClock::now() < end;) {
      turn();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

 private:
  struct Idler {
    std::unique_ptr<Dealer> dealer;
    Messenger messenger;
  };
  Millis now() const { return std::chrono::duration_cast<Millis>(TestClock::now() - start_); }
  TestClock::time_point start_ = TestClock::now();
  std::vector<Idler> idlers_;
};

}  // namespace

TEST_F(ReconnectStormTest, hundreds_of_workers_knock_softly_and_are_back_soon) {
  if (const std::string lacks = TwoHosts::missing(); !lacks.empty())
    GTEST_SKIP() << "needs " << lacks;
  const int count = full_counts() ? 500 : 100;
  const double most_a_second = count / 5.0;  // 100 of 500
  const int outage_s = full_counts() ? 30 : 8;
  TwoHosts hosts(log("hosts"));
  std::unique_ptr<Process> coordinator;
  std::unique_ptr<FaultyProxy> door;
  const auto open = [&] {
    const TwoHosts::Visit visit(hosts, 0);
    coordinator = coordinate();
    door = std::make_unique<FaultyProxy>(
        ProxyOptions{.listen = TwoHosts::address(0), .port = kPort, .upstream_port = port()});
  };
  const auto known = [&] {
    const TwoHosts::Visit visit(hosts, 0);
    const auto report = status();
    return report ? static_cast<int>(report->workers.size()) : 0;
  };
  open();
  const TwoHosts::Visit visit(hosts, 1);
  Idlers idlers(count, door->endpoint());
  const auto until_all_known = [&] {
    const auto start = TestClock::now();
    while (TestClock::now() - start < std::chrono::seconds(60)) {
      idlers.turn_for(std::chrono::milliseconds(200));
      if (known() == count) break;
    }
    return std::chrono::duration<double>(TestClock::now() - start).count();
  };
  until_all_known();
  ASSERT_EQ(known(), count);

  coordinator->send(SIGKILL);
  coordinator->wait();
  door.reset();
  std::uint64_t before = connects(), most = 0;
  for (int second = 0; second < outage_s; ++second) {
    idlers.turn_for(std::chrono::seconds(1));
    const std::uint64_t now = connects();
    most = std::max(most, now - before);
    before = now;
  }
  open();
  const double back_s = until_all_known();
  EXPECT_EQ(known(), count);
  EXPECT_LE(static_cast<double>(most), most_a_second);
  EXPECT_LE(back_s, 20);
  const std::string of = std::to_string(count) + " workers";
  record({23, "most tries in a second, " + of,
          std::to_string(static_cast<int>(most_a_second)) + " or less", std::to_string(most),
          static_cast<double>(most) <= most_a_second});
  std::ostringstream seconds;
  seconds.precision(1);
  seconds << std::fixed << back_s << " s";
  record({23, "all back, " + of, "20 s or less", seconds.str(), back_s <= 20});
}

}  // namespace pvsfarm
