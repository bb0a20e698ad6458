// What the tests of a coordinator's durability share: a scene of many cells, workers that answer at
// once, the store of an undisturbed coordinator, and coordinators on a disk that fails.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/farm/instant_workers.hpp"
#include "tests/farm/process.hpp"

namespace pvsfarm {

class DurableFarm : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite() { std::filesystem::remove_all(suite_); }
  void SetUp() override;
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::vector<std::string> command(const std::string& out, const std::string& endpoint,
                                          const std::vector<std::string>& more = {});
  // `fault`: OP:PATH:N:ACTION of faulty_disk.cpp, "" for none.
  std::unique_ptr<Process> coordinate(const std::string& fault = "", std::uint64_t seed = 0) const;
  static InstantWork work(double cell_ms) { return {.objects = objects_, .cell_ms = cell_ms}; }
  std::string endpoint() const { return "ipc://" + folder_ + "/farm"; }
  bool golden() const;
  // When the fault came, by the system's monotonic clock; 0 if it did not.
  static double fault_s(const Process& process);

  static std::string suite_, golden_;
  static std::uint32_t objects_, cells_;
  std::string folder_, out_;
};

}  // namespace pvsfarm
