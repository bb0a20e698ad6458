#include "tests/farm/two_hosts.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cmath>
#include <sstream>

#include "common/base/check.hpp"
#include "tests/farm/process.hpp"

namespace pvsfarm {
namespace {

int own_namespace() { return open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC); }

bool works(const std::string& command) {
  return system((command + " > /dev/null 2>&1").c_str()) == 0;
}

}  // namespace

std::string TwoHosts::missing() {
  if (geteuid() != 0) return "root";
  if (!works("ip -V")) return "ip (iproute2)";
  if (!works("nft --version")) return "nft (nftables)";
  if (!works("unshare --net true")) return "network namespaces";
  return "";
}

TwoHosts::TwoHosts(std::string log) : log_(std::move(log)) {
  const int home = own_namespace();
  for (int& ns : ns_) {
    PVS_CHECK_EQ(unshare(CLONE_NEWNET), 0);
    ns = own_namespace();
    PVS_CHECK(ns >= 0);
  }
  PVS_CHECK_EQ(setns(home, CLONE_NEWNET), 0);
  close(home);
  run(0, "ip link add cable type veth peer name cable netns /proc/" + std::to_string(getpid()) +
             "/fd/" + std::to_string(ns_[1]));
  for (int host = 0; host < 2; ++host) {
    run(host, "ip link set lo up");
    run(host, std::string("ip address add ") + address(host) + "/24 dev cable");
    run(host, "ip link set cable up");
  }
  heal();
}

TwoHosts::~TwoHosts() {
  for (const int ns : ns_) close(ns);
}

TwoHosts::Visit::Visit(const TwoHosts& hosts, int host) : home_(own_namespace()) {
  PVS_CHECK_EQ(setns(hosts.ns_[host], CLONE_NEWNET), 0);
}

TwoHosts::Visit::~Visit() {
  PVS_CHECK_EQ(setns(home_, CLONE_NEWNET), 0);
  close(home_);
}

void TwoHosts::run(int host, const std::string& command) const {
  const Visit visit(*this, host);
  Process process({"/bin/sh", "-c", command}, log_ + "-network");
  const int code = process.wait(20);
  if (code != 0) ADD_FAILURE() << command << ": " << process.err();
  PVS_CHECK_EQ(code, 0);
}

void TwoHosts::receives(int host, bool anything, double lost_percent) {
  std::ostringstream rules;
  rules << "nft 'flush ruleset; add table inet faults; "
           "add chain inet faults in { type filter hook input priority 0; }";
  if (!anything)
    rules << "; add rule inet faults in iifname cable drop";
  else if (lost_percent > 0)
    rules << "; add rule inet faults in iifname cable numgen random mod 1000 < "
          << std::lround(10 * lost_percent) << " drop";
  rules << "'";
  run(host, rules.str());
}

void TwoHosts::rate(double mbit_per_s) {
  for (int host = 0; host < 2; ++host) {
    std::ostringstream command;
    command << "tc qdisc replace dev cable root tbf rate " << mbit_per_s
            << "mbit burst 64kb latency 100ms";
    run(host, command.str());
  }
}

void TwoHosts::heal() {
  for (int host = 0; host < 2; ++host) receives(host, true);
}

}  // namespace pvsfarm
