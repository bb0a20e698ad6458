// Who watches a farm at work: the log and the progress line, a trace, figures over HTTP.
#pragma once

#include <memory>
#include <string>

#include "coordinator/cli/command.hpp"
#include "coordinator/cli/progress_line.hpp"
#include "coordinator/metrics/http_server.hpp"
#include "coordinator/service/farm.hpp"
#include "coordinator/trace/trace.hpp"

namespace pvsfarm {

struct WatchOptions {
  std::string trace, metrics;  // a file, an address; "" for none
};
void add_watch_options(CLI::App& command, WatchOptions& options);

class Watch {
 public:
  // Errors: kIo, kCommandLine: before any work.
  static Result<std::unique_ptr<Watch>> begin(const WatchOptions& options,
                                              const CommandContext& context);
  const FarmObserver& observer() const { return observer_; }
  void start(const std::string& output, std::size_t root_cells);
  void finish();  // however it ended

 private:
  explicit Watch(const CommandContext& context);

  ProgressLine line_;
  std::unique_ptr<Trace> trace_;
  std::unique_ptr<HttpServer> server_;
  FarmObserver observer_;
};

}  // namespace pvsfarm
