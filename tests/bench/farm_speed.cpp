#include "tests/bench/farm_speed.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "common/base/digest.hpp"
#include "common/base/file.hpp"
#include "tests/bench/process.hpp"

namespace pvsfarm::bench {
namespace fs = std::filesystem;
namespace {

// The coordinator's own count: its whole process's would drown in the reading of the scene.
Status read_summary(const std::string& log, FarmRun& run) {
  const auto text = read_file(log);
  if (!text) return text.error();
  const std::size_t first = text->find("{\"output\"");
  if (first == std::string::npos) return runtime_error(log + ": no summary");
  const auto summary = nlohmann::json::parse(text->substr(first, text->find('\n', first) - first));
  run.coordinator_cpu_ms =
      summary["coordinator_cpu_ms_per_cell"].get<double>() * summary["evaluated"].get<double>();
  return {};
}

}  // namespace

Result<FarmRun> run_farm(const FarmRequest& request) {
  const std::string folder = request.work_folder + "/w" + std::to_string(request.workers);
  fs::remove_all(folder);
  fs::create_directories(folder);
  const std::string store = folder + "/out.pvs", endpoint = "ipc://" + folder + "/farm.sock";
  const std::string log = folder + "/coordinator.log";

  FarmRun run;
  const double start_ms = wall_ms();
  Result<Child> coordinator =
      Child::start({request.bin_folder + "/pvsfarm", "coordinate", request.scene_path + ".obj",
                    "-o", store, "--cells", request.scene_path + ".cells.json", "--tags",
                    request.scene_path + ".tags.json", "--bind", endpoint, "--json"},
                   log);
  if (!coordinator.ok()) return coordinator.error();
  std::vector<Child> workers;
  for (int i = 0; i < request.workers; ++i) {
    Result<Child> worker =
        Child::start({request.bin_folder + "/pvsfarm-worker", "--connect", endpoint},
                     folder + "/worker" + std::to_string(i) + ".log");
    if (!worker.ok()) return worker.error();
    workers.push_back(std::move(*worker));
  }
  const Child::Exit end = coordinator->wait();
  run.wall_ms = wall_ms() - start_ms;
  if (end.code != 0)
    return runtime_error("the coordinator ended with " + std::to_string(end.code) + ": " + log);
  if (Status status = read_summary(log, run); !status) return status.error();
  for (Child& worker : workers) {
    const Child::Exit exit = worker.wait();
    if (exit.code != 0)
      return runtime_error("a worker ended with " + std::to_string(exit.code) + ": " + folder);
    run.worker_cpu_ms += exit.cpu_ms;
  }
  const auto bytes = read_file(store);
  if (!bytes.ok()) return bytes.error();
  run.store_hash = digest_of(std::as_bytes(std::span(*bytes))).hex();
  return run;
}

}  // namespace pvsfarm::bench
