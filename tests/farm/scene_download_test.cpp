// A scene on its way to a worker that has never seen it: it is all that the worker needs, and what
// arrived before the worker was killed, or the connection was cut, is not fetched again.
#include <filesystem>
#include <fstream>

#include "tests/farm/farm_fixture.hpp"
#include "tests/farm/faulty_proxy.hpp"

namespace pvsfarm {
namespace {

class SceneDownloadTest : public FarmFixture {
 protected:
  // A coordinator whose scene takes two seconds to fetch through the proxy.
  void SetUp() override {
    FarmFixture::SetUp();
    coordinator_ = coordinate();
    scene_bytes_ = hide_scene();
    ASSERT_GT(scene_bytes_, 500'000u);
    proxy_ = std::make_unique<FaultyProxy>(ProxyOptions{
        .upstream_port = port(), .bytes_per_s = static_cast<double>(scene_bytes_) / 2});
  }
  bool fetched(double part) const {
    const auto bytes = static_cast<std::uint64_t>(part * static_cast<double>(scene_bytes_));
    return wait_until(60, [&] { return proxy_->figures().bytes_down > bytes; });
  }
  // Whole, and little of it twice: what was on its way is lost.
  void expect_little_more_than_once() {
    EXPECT_TRUE(outcome(*coordinator_).well()) << coordinator_->err();
    const auto bytes = static_cast<double>(proxy_->figures().bytes_down);
    EXPECT_GT(bytes, static_cast<double>(scene_bytes_));
    EXPECT_LT(bytes, 1.5 * static_cast<double>(scene_bytes_) + 300'000);
  }

  std::unique_ptr<Process> coordinator_;
  std::unique_ptr<FaultyProxy> proxy_;
  std::uint64_t scene_bytes_ = 0;
};

}  // namespace

TEST_F(SceneDownloadTest, goes_on_where_a_killed_worker_was) {
  Crew workers = crew("worker");
  workers.start(proxy_->endpoint());
  ASSERT_TRUE(fetched(0.8));
  workers.kill(0);
  ASSERT_TRUE(wait_until(5, [&] { return !workers.running(0); }));
  workers.start_fallen();
  expect_little_more_than_once();
  EXPECT_NE(workers.process(0).err().find("are here"), std::string::npos)
      << workers.process(0).err();
}

TEST_F(SceneDownloadTest, goes_on_where_a_connection_was_cut) {
  Crew workers = crew("worker");
  workers.start(proxy_->endpoint());
  ASSERT_TRUE(fetched(0.8));
  proxy_->reset_all();
  expect_little_more_than_once();
}

// Its files are those of the system and the worker's own program: where the scene, its cells and
// tags are, it finds an empty disk.
TEST_F(SceneDownloadTest, is_all_that_a_machine_needs_which_never_saw_the_scene) {
  if (geteuid() != 0 || system("unshare --mount true > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "needs root and mount namespaces";
  const std::string cache = folder_ + "/cache";
  Process worker({"/usr/bin/env", "unshare", "--mount", "sh", "-c",
                  "mount -t tmpfs none " + suite_ + " && mkdir -p " + folder_ + " && exec " +
                      kWorker + " --connect " + proxy_->endpoint() + " --cache " + cache},
                 log("worker"));
  ASSERT_TRUE(reaches(1)) << worker.err();
  const double to_begin = static_cast<double>(proxy_->figures().bytes_down);
  std::vector<std::string> files;
  const std::string its_disk = "/proc/" + std::to_string(worker.pid()) + "/root" + suite_;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(its_disk))
    if (entry.is_regular_file()) files.push_back(entry.path());
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(read_file(files[0]).value(), read_file(hidden_scene()).value());
  EXPECT_NE(worker.err().find("fetching the scene, " + std::to_string(scene_bytes_) + " bytes\n"),
            std::string::npos)
      << worker.err();
  // Beside the bundle only the frames around it, and the first tasks.
  const auto bundle = static_cast<double>(scene_bytes_);
  EXPECT_GT(to_begin, bundle);
  EXPECT_LT(to_begin, 1.02 * bundle + 16'384);
  EXPECT_TRUE(outcome(*coordinator_).well()) << coordinator_->err();
}

TEST_F(SceneDownloadTest, that_was_damaged_on_the_disk_begins_anew) {
  Crew workers = crew("worker");
  workers.start(proxy_->endpoint());
  ASSERT_TRUE(fetched(0.8));
  workers.kill(0);
  ASSERT_TRUE(wait_until(5, [&] { return !workers.running(0); }));
  int damaged = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ + "/cache")) {
    if (entry.path().extension() != ".part") continue;
    std::string bytes = read_file(entry.path()).value();
    ASSERT_FALSE(bytes.empty());
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    std::ofstream(entry.path(), std::ios::binary) << bytes;
    ++damaged;
  }
  ASSERT_EQ(damaged, 1);
  workers.start_fallen();
  // It finds out at the end, leaves to be started again, and fetches all of it.
  ASSERT_TRUE(wait_until(60, [&] { return !workers.running(0); }));
  EXPECT_EQ(workers.process(0).wait(0), 75);
  EXPECT_NE(workers.process(0).err().find("damaged"), std::string::npos);
  workers.start_fallen();
  EXPECT_TRUE(outcome(*coordinator_).well()) << coordinator_->err();
}

}  // namespace pvsfarm
