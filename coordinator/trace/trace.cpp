#include "coordinator/trace/trace.hpp"

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kFlushEvery_us = 200'000;
constexpr std::int64_t kQueueEvery_us = 100'000;
constexpr int kProcess = 1;
constexpr int kJournalLine = 1'000'000;  // below the workers

int line_of(WorkerId worker) { return static_cast<int>(worker); }

std::string name_of(const CellKey& key) {
  return std::to_string(key.root) + "/" + std::to_string(key.path);
}

// File names need not be UTF-8; JSON must be.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json event(const char* phase, const std::string& name, int line, std::int64_t at_us) {
  return {{"ph", phase}, {"name", name}, {"pid", kProcess}, {"tid", line}, {"ts", at_us}};
}

Json line_name(int line, const std::string& name) {
  Json json = event("M", "thread_name", line, 0);
  json["args"] = {{"name", name}};
  return json;
}

}  // namespace

Result<std::unique_ptr<Trace>> Trace::create(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return io_error(path + ": cannot write the trace: " + std::strerror(errno));
  return std::unique_ptr<Trace>(new Trace(path, file));
}

Trace::~Trace() = default;

std::int64_t Trace::now_us() const {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start_).count();
}

void Trace::put(const std::string& line) {
  if (!file_) return;
  std::fputs(first_ ? "[\n" : ",\n", file_.get());
  std::fputs(line.c_str(), file_.get());
  first_ = false;
  if (now_us() - flushed_us_ < kFlushEvery_us) return;
  std::fflush(file_.get());
  flushed_us_ = now_us();
}

void Trace::start(const Start& start) {
  Json process = event("M", "process_name", 0, 0);
  process["args"] = {{"name", "pvsfarm " + start.output}};
  put(dump(process));
  put(dump(line_name(kJournalLine, "journal")));
  Json begin = event("i", "begin", kJournalLine, now_us());
  begin["s"] = "g";
  begin["args"] = {{"root_cells", start.root_cells}};
  put(dump(begin));
}

Status Trace::finish() {
  if (!file_) return {};
  put(dump(event("i", "end", kJournalLine, now_us())));
  std::fputs("\n]\n", file_.get());
  const bool written = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  file_.reset();
  if (!written) return io_error(path_ + ": the trace could not be written (disk full?)");
  return {};
}

void Trace::worker_joined(WorkerId worker, const Hello& hello) {
  put(dump(line_name(line_of(worker), "worker " + hello.host + ":" + std::to_string(hello.pid))));
  Json json = event("i", "joined", line_of(worker), now_us());
  json["s"] = "t";
  json["args"] = {{"build", hello.build}};
  put(dump(json));
}

void Trace::worker_left(WorkerId worker, bool lost) {
  Json json = event("i", lost ? "lost" : "left", line_of(worker), now_us());
  json["s"] = "t";
  put(dump(json));
  free_us_.erase(worker);
}

void Trace::task_given(WorkerId worker, const BoardTask& task) {
  given_[task.lease] = {worker, task.cells.front(), task.cells.size(), task.attempt, now_us()};
}

void Trace::task_ended(BoardLease lease, End end, std::span<const WorkAnswer::Done> done,
                       const std::string& text) {
  const auto found = given_.find(lease);
  if (found == given_.end()) return;  // of another life of the coordinator
  const Given& given = found->second;
  // A worker computes one task after the other; while it does, the next one waits there.
  std::int64_t& free_us = free_us_[given.worker];
  const std::int64_t begin_us = std::max(given.at_us, free_us), end_us = now_us();
  free_us = end_us;
  std::string name = "cell " + name_of(given.first);
  if (given.cells > 1) name += " and " + std::to_string(given.cells - 1) + " more";
  Json json = event("X", name, line_of(given.worker), begin_us);
  json["dur"] = end_us - begin_us;
  json["cat"] = to_string(end);
  Json cells = Json::array();
  for (const WorkAnswer::Done& cell : done)
    cells.push_back({{"cell", name_of(cell.key)},
                     {"depth", cell.key.depth()},
                     {"cpu_ms", cell.cost_ms},
                     {"split", cell.split}});
  json["args"] = {
      {"lease", std::to_string(static_cast<std::uint64_t>(lease))},  // too large for JavaScript
      {"attempt", given.attempt},
      {"waited_ms", static_cast<double>(begin_us - given.at_us) / 1e3},
      {"cells", cells}};
  if (!text.empty()) json["args"]["text"] = text;
  if (end == End::kFailed || end == End::kExpired) json["cname"] = "terrible";
  put(dump(json));
  given_.erase(found);
}

void Trace::commit_begins(std::size_t rows) {
  commit_rows_ = rows;
  commit_us_ = now_us();
}

void Trace::commit_ends() {
  Json json = event("X", "commit", kJournalLine, commit_us_);
  json["dur"] = now_us() - commit_us_;
  json["args"] = {{"rows", commit_rows_}};
  put(dump(json));
}

void Trace::queue(const Queue& queue) {
  const std::int64_t at_us = now_us();
  const bool same = queue.pending == queue_.pending && queue.leased == queue_.leased &&
                    queue.workers == queue_.workers;
  if (queue_us_ >= 0 && (same || at_us - queue_us_ < kQueueEvery_us)) return;
  queue_us_ = at_us;
  queue_ = queue;
  Json cells = event("C", "cells", 0, at_us);
  cells["args"] = {{"pending", queue.pending}, {"leased", queue.leased}};
  put(dump(cells));
  Json workers = event("C", "workers", 0, at_us);
  workers["args"] = {{"workers", queue.workers}};
  put(dump(workers));
}

}  // namespace pvsfarm
