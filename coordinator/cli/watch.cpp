#include "coordinator/cli/watch.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>

#include "common/base/log.hpp"

namespace pvsfarm {

void add_watch_options(CLI::App& command, WatchOptions& options) {
  command.add_option("--trace", options.trace,
                     "FILE.json: who computed what and when, for Perfetto or chrome://tracing");
  command.add_option("--metrics", options.metrics,
                     "PORT or ADDRESS:PORT: /metrics for Prometheus, /healthz and /readyz; a port "
                     "alone is of this machine only");
}

Watch::Watch(const CommandContext& context)
    : line_({.terminal = isatty(STDERR_FILENO) == 1 && !context.json_log,
             .quiet = context.verbosity < 0 || context.json_log}) {
  observer_.progress = [this](const StatusReport& report) {
    line_.show(report);
    if (server_) server_->publish(report);
  };
  observer_.note = [this](const std::string& text) {
    line_.clear();
    log_info(text);
  };
  observer_.warning = [this](const std::string& text) {
    line_.clear();
    log_warning(text);
  };
  observer_.event = [this](const LogEvent& event) {
    line_.clear();
    log_event(event);
  };
  observer_.enter = [this](const std::string& state) {
    line_.clear();
    if (server_) server_->enter(state);
  };
}

Result<std::unique_ptr<Watch>> Watch::begin(const WatchOptions& options,
                                            const CommandContext& context) {
  std::unique_ptr<Watch> watch(new Watch(context));
  if (!options.metrics.empty()) {
    auto server = HttpServer::start(options.metrics);
    if (!server) return server.error();
    watch->server_ = std::move(server).value();
    watch->observer_.note("figures at " + watch->server_->url() + "/metrics");
    if (!watch->server_->loopback())
      watch->observer_.warning("anyone who reaches " + watch->server_->url() +
                               " can read how far the bake is: it asks for no password");
  }
  if (!options.trace.empty()) {
    auto trace = Trace::create(options.trace);
    if (!trace) return trace.error();
    watch->trace_ = std::move(trace).value();
    watch->observer_.events = watch->trace_.get();
  }
  return watch;
}

void Watch::start(const std::string& output, std::size_t root_cells) {
  if (trace_) trace_->start({.root_cells = root_cells, .output = output});
}

void Watch::finish() {
  line_.clear();
  const Status traced = trace_ ? trace_->finish() : Status{};
  if (!traced) observer_.warning(traced.error().text);
}

}  // namespace pvsfarm
