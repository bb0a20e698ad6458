// What the tests with real processes share: a small city that splits, its store as one undisturbed
// worker makes it (the golden bytes), coordinators, and workers that come and go.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/messages.hpp"
#include "tests/farm/process.hpp"

namespace pvsfarm {

inline const std::string kPvsfarm = PVSFARM_BIN_DIR "/pvsfarm";
inline const std::string kWorker = PVSFARM_BIN_DIR "/pvsfarm-worker";

// Of the coordinator that listens there; nothing within half a second: nothing.
std::optional<StatusReport> ask_status(const std::string& endpoint);

// Workers that a test starts, kills and starts again.
class Crew {
 public:
  // `log`: prefix of their logs.
  explicit Crew(std::string log, std::string cache) : log_(std::move(log)), cache_(cache) {}

  // `fault`: of tests/farm/fault_preload.cpp, "" for none. Its number.
  std::size_t start(const std::string& endpoint, const std::string& fault = "",
                    const std::vector<std::string>& more = {});
  // Starts those anew that were killed or asked for it (exit code 75). True: some were.
  bool start_fallen();
  void kill(std::size_t i) { send(i, SIGKILL); }
  void send(std::size_t i, int signal) { members_[i].process->send(signal); }
  bool running(std::size_t i) { return members_[i].process->running(); }
  Process& process(std::size_t i) { return *members_[i].process; }
  std::size_t size() const { return members_.size(); }
  std::size_t starts() const { return starts_; }

 private:
  struct Member {
    std::vector<std::string> command;
    std::unique_ptr<Process> process;
  };
  void run(Member& member);

  std::string log_, cache_;
  std::vector<Member> members_;
  std::size_t starts_ = 0;
};

class FarmFixture : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite();
  void SetUp() override;
  void TearDown() override;

  static std::vector<std::string> with_scene(std::vector<std::string> command,
                                             const std::string& out,
                                             const std::vector<std::string>& more = {});
  static std::vector<std::string> bake_command(const std::string& out,
                                               const std::vector<std::string>& more = {});
  std::string log(const std::string& name) const { return folder_ + "/" + name; }
  Crew crew(const std::string& name) const { return Crew(log(name), folder_ + "/cache"); }

  // A coordinator of a new bake, listening; endpoint() is then where.
  std::unique_ptr<Process> coordinate(const std::vector<std::string>& more = {},
                                      const std::string& bind = "tcp://127.0.0.1:*");
  // Takes the scene's file away from where workers of this machine would map it, to
  // hidden_scene(). Its size.
  std::uint64_t hide_scene() const;
  std::string hidden_scene() const { return folder_ + "/hidden.scene"; }
  // The coordinator that was just started listens: endpoint() is then where.
  void await_endpoint(Process& coordinator, double limit_s = 60);
  const std::string& endpoint() const { return endpoint_; }
  int port() const { return std::stoi(endpoint_.substr(endpoint_.rfind(':') + 1)); }
  std::optional<StatusReport> status() const { return ask_status(endpoint_); }
  std::uint64_t cells_done() const;  // 0 if nobody answers
  bool reaches(std::uint64_t cells, double limit_s = 60) const;

  // What came of a bake; every figure is that of the golden one if all is well.
  struct Outcome {
    bool finished = false;   // exit code 0
    bool identical = false;  // the same bytes
    std::int64_t lost = 0;   // cells that were not merged
    std::int64_t twice = 0;  // cells that were merged more often than once
    std::int64_t quarantined = 0, disagreements = 0;

    bool well() const {
      return finished && identical && lost == 0 && twice == 0 && quarantined == 0 &&
             disagreements == 0;
    }
  };
  // Waits for its end, then looks at the store.
  Outcome outcome(Process& coordinator, double limit_s = 100) const;

  static std::string suite_, golden_;
  static std::int64_t golden_cells_;  // evaluated
  std::string folder_, out_, endpoint_;
};

}  // namespace pvsfarm
