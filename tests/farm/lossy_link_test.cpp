// Row 11 of the fault table: a long, narrow, lossy link. What matters is that large results and
// scenes get through at the pace that the link allows, and that nobody is taken for dead meanwhile.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <sstream>

#include "common/wire/socket.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"
#include "tests/farm/two_hosts.hpp"
#include "tests/support/fault_figures.hpp"
#include "worker/service/messenger.hpp"

namespace pvsfarm {
namespace {

using LossyLinkTest = FarmFixture;

double seconds_since(TestClock::time_point start) {
  return std::chrono::duration<double>(TestClock::now() - start).count();
}

sockaddr_in local(const char* host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

// Seconds that so many bytes take through the link without any protocol of ours.
double bare_seconds(const TwoHosts& hosts, const ProxyOptions& link, std::size_t bytes) {
  int listener = -1, port = 0;
  std::unique_ptr<FaultyProxy> door;
  {
    const TwoHosts::Visit here(hosts, 0);
    listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = local("127.0.0.1", 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener, 1), 0);
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
    ProxyOptions options = link;
    options.upstream_port = port;
    door = std::make_unique<FaultyProxy>(options);
  }
  const auto start = TestClock::now();
  std::thread sender([&] {
    const TwoHosts::Visit there(hosts, 1);
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in to = local(TwoHosts::address(0), door->port());
    EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    const std::vector<char> piece(64 * 1024);
    for (std::size_t sent = 0; sent < bytes;) {
      const ssize_t n = send(fd, piece.data(), std::min(piece.size(), bytes - sent), MSG_NOSIGNAL);
      if (n <= 0) break;
      sent += static_cast<std::size_t>(n);
    }
    char answer = 0;
    EXPECT_EQ(recv(fd, &answer, 1, 0), 1);  // all has arrived
    close(fd);
  });
  const int fd = accept(listener, nullptr, nullptr);
  std::vector<char> piece(64 * 1024);
  std::size_t got = 0;
  for (ssize_t n = 1; got < bytes && n > 0; got += n > 0 ? static_cast<std::size_t>(n) : 0)
    n = recv(fd, piece.data(), piece.size(), 0);
  EXPECT_EQ(got, bytes);
  EXPECT_EQ(send(fd, "!", 1, MSG_NOSIGNAL), 1);
  sender.join();
  close(fd);
  close(listener);
  return seconds_since(start);
}

// A worker of the real protocol whose first result is `bytes` long and nonsense: the coordinator
// says so as soon as it has it whole, with the right digest.
struct Upload {
  double seconds = 0;
  int welcomes = 0;
  bool refused_as_nonsense = false;
};
Upload upload(const std::string& endpoint, std::size_t bytes) {
  const auto begun = TestClock::now();
  const auto now = [&] { return std::chrono::duration_cast<Millis>(TestClock::now() - begun); };
  const auto dealer = Dealer::connect(endpoint).value();
  Hello hello;
  hello.host = "far";
  hello.pid = 1;
  Messenger messenger(hello, now());
  Upload result;
  std::optional<TestClock::time_point> start;
  while (!messenger.leaving() && seconds_since(begun) < 300) {
    while (const auto received = dealer->receive()) {
      messenger.receive(received->decoded, now());
      if (messenger.take_scene_request()) {
        ++result.welcomes;
        messenger.scene_ready();
      }
      messenger.take_scene_chunk();
    }
    if (!start) {
      if (const auto job = messenger.take_job()) {
        JobResult nonsense{.lease = job->lease()};
        for (const TaskCell& cell : std::get<Task>(job->work).cells)
          nonsense.deltas.push_back({.key = cell.key});
        nonsense.deltas[0].hidden_bytes = bytes;
        nonsense.data.resize(bytes);
        messenger.finished(std::move(nonsense));
        start = TestClock::now();
      }
    }
    messenger.tick(now());
    while (dealer->queued() < 8) {
      const auto out = messenger.next_outgoing();
      if (!out) break;
      dealer->send(out->envelope, out->message);
    }
    dealer->wait(std::chrono::milliseconds(20));
  }
  if (start) result.seconds = seconds_since(*start);
  result.refused_as_nonsense =
      messenger.leaving() && messenger.leaving()->exit_code == kExitDoNotRetry;
  return result;
}

}  // namespace

TEST_F(LossyLinkTest, large_results_arrive_at_the_pace_of_the_link) {
  if (const std::string lacks = TwoHosts::missing(); !lacks.empty())
    GTEST_SKIP() << "needs " << lacks;
  const std::size_t mib = full_counts() ? 40 : 4;
  TwoHosts hosts(log("hosts"));
  hosts.rate(20);
  for (int host = 0; host < 2; ++host) hosts.receives(host, true, 5);
  const ProxyOptions link{.listen = TwoHosts::address(0), .delay_ms = 50};
  const double bare_s = bare_seconds(hosts, link, mib << 20);

  std::unique_ptr<Process> coordinator;
  std::unique_ptr<FaultyProxy> door;
  {
    const TwoHosts::Visit here(hosts, 0);
    coordinator = coordinate();
    ProxyOptions options = link;
    options.upstream_port = port();
    door = std::make_unique<FaultyProxy>(options);
  }
  const TwoHosts::Visit there(hosts, 1);
  const Upload far = upload(door->endpoint(), mib << 20);
  EXPECT_TRUE(far.refused_as_nonsense) << coordinator->err();
  EXPECT_EQ(far.welcomes, 1) << "its session was cut";
  EXPECT_EQ(door->figures().connections, 1u);
  EXPECT_EQ(coordinator->err().find("no progress"), std::string::npos) << coordinator->err();
  const double part = bare_s / far.seconds;
  EXPECT_GE(part, 0.7) << "bare " << bare_s << " s, as a result " << far.seconds << " s";
  const auto cuts = static_cast<int>(door->figures().connections) - 1 + far.welcomes - 1;
  std::ostringstream reached;
  reached << static_cast<int>(100 * part) << " % (" << mib << " MiB in " << far.seconds << " s)";
  record({11, "of the pace of bare TCP over the same link", "70 % or more", reached.str(),
          part >= 0.7 && far.refused_as_nonsense});
  record({11, "connections cut", "0", std::to_string(cuts), cuts == 0});
}

}  // namespace pvsfarm
