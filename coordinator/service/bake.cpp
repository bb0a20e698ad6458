#include "coordinator/service/bake.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <sstream>
#include <thread>

#include "common/base/atomic_file.hpp"
#include "common/base/file.hpp"
#include "common/pvs/hints_file.hpp"
#include "common/pvs/kernel.hpp"
#include "common/pvs/store_reader.hpp"
#include "coordinator/journal/journal.hpp"
#include "coordinator/merger/store_build.hpp"
#include "coordinator/service/bake_identity.hpp"
#include "coordinator/service/bake_work.hpp"
#include "coordinator/service/private_folder.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kRoomRetry{4};

double process_cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) / 1e6;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A file that goes with the bake, however it ends.
struct Temporary {
  std::string path;
  explicit Temporary(std::string p = "") : path(std::move(p)) {}
  Temporary(Temporary&& other) noexcept : path(std::exchange(other.path, "")) {}
  ~Temporary() {
    std::error_code none;
    if (!path.empty()) fs::remove(path, none);
  }
};

std::string journal_path(const std::string& output) { return output + ".journal"; }
// Of a bake that does not resume: another's journal stays where it is.
std::string passing_journal_path(const std::string& output) { return output + ".passing"; }
std::string endpoint_path(const std::string& output) { return output + ".endpoint"; }

// What a killed coordinator of this output could not remove.
void remove_left_behind(const std::string& output) {
  const auto text = read_file(endpoint_path(output));
  if (!text) return;
  std::istringstream lines(*text);
  std::string endpoint, folder;
  if (std::getline(lines, endpoint) && std::getline(lines, folder))
    PrivateFolder::remove_abandoned(folder);
}

bool already_baked(const BakeJob& job, const Digest& bake_digest) {
  std::error_code none;
  if (job.fresh || !job.resume || fs::exists(journal_path(job.output), none) ||
      !fs::exists(job.output, none))
    return false;
  const auto store = StoreReader::open(job.output);
  if (!store || (*store)->header().bake_digest != bake_digest) return false;
  const std::uint32_t viewpoints = job.settings.evaluator.hint_viewpoints;
  if (viewpoints == 0) return true;
  const auto hints = HintsReader::open(hints_path(job.output));
  return hints && hints->store() == (*store)->digest() && hints->viewpoints() == viewpoints;
}

// The same cells are in the journal with hints and without, but not the same rows.
Digest journal_digest(const Digest& bake_digest, const BakeSettings& settings) {
  if (settings.evaluator.hint_viewpoints == 0) return bake_digest;
  DigestBuilder digest;
  digest.add(std::as_bytes(std::span(bake_digest.bytes)));
  return digest.add("hints").add_u64(settings.evaluator.hint_viewpoints).finish();
}

std::string journal_settings(const BakeSettings& settings) {
  const std::uint32_t viewpoints = settings.evaluator.hint_viewpoints;
  const std::string text = settings_json(settings, "");
  return viewpoints == 0 ? text : text + " hints " + std::to_string(viewpoints);
}

// The journal of a bake that leaves none. Made before the journal, so that it outlives it.
struct PassingJournal {
  std::string path;
  ~PassingJournal() {
    if (!path.empty()) static_cast<void>(Journal::discard(path));
  }
};

// Opens this bake's journal, and sees to it that nobody else bakes to the output.
Result<std::unique_ptr<Journal>> open_journal(const BakeJob& job, const Digest& bake_digest) {
  const std::string kept = journal_path(job.output), passing = passing_journal_path(job.output);
  if (job.fresh)
    if (Status status = Journal::discard(kept); !status) return status.error();
  if (Status status = Journal::check_free(kept); !status) return status.error();
  if (Status status = Journal::discard(passing); !status) return status.error();
  return Journal::open(job.resume ? kept : passing,
                       {journal_digest(bake_digest, job.settings), journal_settings(job.settings)});
}

// The bake while it runs: what outlives the loop and is needed by the final store.
struct Running {
  std::shared_ptr<const Scene> scene;
  std::vector<std::int64_t> root_ids;
  std::unique_ptr<Tree> tree;
  std::unique_ptr<Journal> journal;
  Estimate estimate;
  std::uint64_t resumed = 0;
  std::string kernel;
};

// Rebuilds the hierarchy from the journal: the same merges in canonical order.
Status resume(Running& running) {
  Merger merger(*running.tree, *running.journal);
  for (std::uint32_t i = 0; i < running.tree->root_count(); ++i) running.estimate.opened(0);
  Status status = running.journal->for_each([&](const ResultRow& row) -> Status {
    const Result<MergeAnswer> answer = merger.replay(row);
    if (!answer) return answer.error();
    running.estimate.done({row.key.depth(), row.statistics.cpu_ms, answer->split, false});
    for (int half = 0; answer->split && half < 2; ++half)
      running.estimate.opened(row.key.depth() + 1);
    ++running.resumed;
    return {};
  });
  if (!status) return status;
  Result<std::string> kernel = running.journal->kernel();
  if (!kernel) return kernel.error();
  running.kernel = std::move(kernel).value();
  // Before any of them is acknowledged again.
  return running.journal->commit();
}

// To the store as it is on the disk. While they are not there, the journal is.
Status bind_hints(HintsWriter& hints, const std::string& output) {
  const auto store = StoreReader::open(output);
  if (!store) return store.error();
  return hints.finish((*store)->digest());
}

Status write_store(const Running& running, const BakeJob& job, const Digest& bake_digest,
                   const FarmObserver& observer, BakeSummary& summary) {
  const StoreHeader header{running.scene->file_up(), running.scene->digest(), bake_digest,
                           settings_json(job.settings, running.kernel)};
  auto writer = StoreWriter::create(job.output, header, *running.scene);
  if (!writer) return writer.error();
  std::unique_ptr<HintsWriter> hints;
  if (const std::uint32_t viewpoints = job.settings.evaluator.hint_viewpoints; viewpoints > 0) {
    auto created = HintsWriter::create(hints_path(job.output), viewpoints);
    if (!created) return created.error();
    hints = std::move(created).value();
  }
  auto statistics = AtomicFile::create(job.output + ".stats");
  if (!statistics) return statistics.error();
  StoreBuild build(*running.tree, running.root_ids, **writer, hints.get());
  Status added = running.journal->for_each([&](const ResultRow& row) {
    if (Status status = build.add(row); !status) return status;
    return (*statistics)->write(build.take_statistics_lines());
  });
  if (!added) return added;
  if (Status status = build.finish(); !status) return status;
  if (Status status = (*statistics)->write(build.take_statistics_lines()); !status) return status;
  // The statistics first: when the store is there, everything is.
  if (Status status = (*statistics)->commit(); !status) return status;
  if (Status status = (*writer)->finish(); !status) return status;
  if (hints)
    if (Status status = bind_hints(*hints, job.output); !status) return status;

  const StoreFigures& figures = summary.store = build.figures();
  if (figures.refuted > 0 && observer.warning)
    observer.warning("A WITNESS REFUTES A CERTIFICATE: " + std::to_string(figures.refuted) +
                     " times an object seen from a cell is in the set of neither half; this is a "
                     "bug of pvsfarm: please report it");
  const auto leaves = static_cast<double>(figures.leaves);
  const auto all = static_cast<double>(running.tree->triangles(running.tree->occludees()));
  summary.contradictions = figures.cost.contradictions + figures.refuted;
  summary.mean_objects = static_cast<double>(figures.leaf_objects) / leaves;
  summary.mean_triangles = static_cast<double>(figures.leaf_triangles) / leaves;
  summary.culled_percent = all > 0 ? 100 * (1 - summary.mean_triangles / all) : 0;
  if (figures.evaluated > 0)
    summary.worker_cpu_ms_per_cell = figures.cost.cpu_ms / static_cast<double>(figures.evaluated);
  std::error_code none;
  summary.file_bytes = fs::file_size(job.output, none);
  return {};
}

// On a full disk it waits for room, as the journal does: whoever looks in the morning finds the
// store, or frees some space and has it. Each attempt is a whole one, so the next one is not made
// before as much time has gone by as it took. A signal ends the wait, and the journal stays.
Status write_store_once_there_is_room(const Running& running, const BakeJob& job,
                                      const Digest& bake_digest, const FarmObserver& observer,
                                      BakeSummary& summary) {
  for (bool told = false;; told = true) {
    const Clock::time_point start = Clock::now();
    const Status status = write_store(running, job, bake_digest, observer, summary);
    if (status && told && observer.note) observer.note("there is room again: the store is written");
    if (status || !for_want_of_space(status.error())) return status;
    if (!told && observer.warning)
      observer.warning(status.error().text +
                       "; every cell is done: the store is written as soon as there is room");
    std::this_thread::sleep_for(std::max<Clock::duration>(kRoomRetry, Clock::now() - start));
  }
}

// From the first worker to the last cell.
Status evaluate_cells(const BakeJob& job, const FarmOptions& farm, const FarmObserver& observer,
                      Running& running, const PrivateFolder& folder, BakeSummary& summary) {
  std::optional<Temporary> endpoint_file;
  FarmJob farm_job{.scene = running.scene,
                   .settings = job.settings.evaluator,
                   .pinned_kernel = running.kernel,
                   .output = job.output,
                   .order = TaskOrder::spread(running.tree->root_count())};
  // Where we listen, and what goes with us: remove_left_behind() reads it if we are killed.
  farm_job.listening = [&](const std::string& endpoint) {
    endpoint_file.emplace(endpoint_path(job.output));
    return write_file(endpoint_file->path, endpoint + "\n" + folder.path() + "\n");
  };
  BakeWork work(*running.tree, *running.journal, running.estimate);
  if (!job.resume) work.keeps_nothing();
  FarmFigures figures;
  const Status status = run_farm(farm_job, work, folder, farm, observer, figures);
  running.kernel = figures.kernel;
  summary.disagreements = work.disagreements();
  summary.workers = figures.workers;
  summary.evaluated = running.journal->row_count() - running.resumed;
  return status;
}

}  // namespace

Status check_output(const std::string& output) {
  std::error_code none;
  if (fs::is_directory(output, none))
    return io_error(output + ": is a folder; give a file name for -o");
  if (fs::exists(output, none) && !fs::is_regular_file(output, none))
    return io_error(output + ": is no plain file; give another name for -o");
  const std::string folder = fs::path(output).parent_path().string();
  const std::string where = folder.empty() ? "." : folder;
  if (!fs::is_directory(where, none)) return io_error(where + ": no such folder; make it first");
  if (access(where.c_str(), W_OK | X_OK) != 0)
    return io_error(where + ": cannot write there: " + std::strerror(errno));
  return {};
}

Result<BakeSummary> bake(BakeJob job, const FarmOptions& farm, const FarmObserver& observer) {
  const Clock::time_point start = Clock::now();
  const Digest bake_digest = bake_digest_of(job.scene->digest(), job.roots, job.settings);
  if (Status status = check_output(job.output); !status) return status.error();
  if (already_baked(job, bake_digest)) return BakeSummary{.already_baked = true};

  // 1. The journal: this bake's, or none.
  const PassingJournal passing{job.resume ? "" : passing_journal_path(job.output)};
  Running running;
  auto journal = open_journal(job, bake_digest);
  if (!journal) return journal.error();
  running.journal = std::move(journal).value();

  // 2. The scene, as a file that the workers of this machine map too.
  remove_left_behind(job.output);
  const Result<PrivateFolder> folder = PrivateFolder::make();
  if (!folder) return folder.error();
  if (Status status = put_scene(*folder, job.scene->bundle()); !status) return status.error();
  job.scene.reset();
  auto scene = Scene::map(folder->scene_path());
  if (!scene) return scene.error();
  running.scene = std::move(scene).value();

  // 3. The hierarchy as far as it was, and the farm for the rest.
  const double cpu_before_ms = process_cpu_ms();
  std::vector<Cell> cells;
  for (const RootCell& root : job.roots) {
    cells.push_back(root.cell);
    running.root_ids.push_back(root.id);
  }
  running.tree = std::make_unique<Tree>(TreeScene::of(*running.scene), std::move(cells),
                                        job.settings.subdivision);
  if (Status status = resume(running); !status) return status.error();
  if (running.resumed > 0 && observer.note)
    observer.note("resuming: " + std::to_string(running.resumed) + " cells are in the journal");
  BakeSummary summary{.resumed = running.resumed};
  if (Status status = evaluate_cells(job, farm, observer, running, *folder, summary); !status)
    return status.error();

  if (observer.enter) observer.enter("writing");
  // 4. The store. Its journal stays if cells are missing: the same command tries them again.
  if (Status status = write_store_once_there_is_room(running, job, bake_digest, observer, summary);
      !status)
    return status.error();
  if (summary.store.quarantined == 0)
    if (Status status = running.journal->remove(); !status) return status.error();
  if (summary.evaluated > 0)
    summary.coordinator_cpu_ms_per_cell =
        (process_cpu_ms() - cpu_before_ms) / static_cast<double>(summary.evaluated);
  summary.seconds = seconds_since(start);
  return summary;
}

Result<std::string> endpoint_of(const std::string& output) {
  const auto text = read_file(endpoint_path(output));
  if (!text) return runtime_error(output + ": no coordinator is at work on it");
  return text->substr(0, text->find('\n'));
}

}  // namespace pvsfarm
