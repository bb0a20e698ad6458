#include "common/base/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace pvsfarm {
namespace {

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

bool as_json = false;  // set once, with the logger

void write(spdlog::level::level_enum level, std::string_view line) {
  spdlog::default_logger_raw()->log(level, spdlog::string_view_t(line.data(), line.size()));
}

// The members of a line after its time and level. Texts need not be UTF-8; JSON must be.
std::string members(const LogEvent& event) {
  nlohmann::ordered_json json{{"program", spdlog::default_logger_raw()->name()},
                              {"event", event.event},
                              {"text", event.text}};
  if (!event.worker.empty()) json["worker"] = event.worker;
  if (!event.cell.empty()) json["cell"] = event.cell;
  if (event.lease != 0) json["lease"] = std::to_string(event.lease);  // too large for JavaScript
  const std::string object =
      json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  return object.substr(1, object.size() - 2);
}

void log(LogLevel level, std::string_view line) {
  if (!spdlog::default_logger_raw()->should_log(level_of(level))) return;
  if (as_json)
    write(level_of(level), members({.event = "line", .text = std::string(line)}));
  else
    write(level_of(level), line);
}

}  // namespace

void set_up_log(const LogSettings& settings) {
  const auto color = settings.color ? spdlog::color_mode::always : spdlog::color_mode::never;
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>(color);
  auto logger = std::make_shared<spdlog::logger>(std::string(settings.program), std::move(sink));
  as_json = settings.json;
  if (settings.json)
    logger->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})",
                        spdlog::pattern_time_type::utc);
  else
    logger->set_pattern("%H:%M:%S %n %^%l%$ %v");
  logger->set_level(level_of(settings.level));
  logger->flush_on(spdlog::level::debug);
  spdlog::set_default_logger(std::move(logger));
}

void log_event(const LogEvent& event) {
  if (!spdlog::default_logger_raw()->should_log(level_of(event.level))) return;
  write(level_of(event.level), as_json ? members(event) : event.text);
}

void log_debug(std::string_view line) { log(LogLevel::kDebug, line); }
void log_info(std::string_view line) { log(LogLevel::kInfo, line); }
void log_warning(std::string_view line) { log(LogLevel::kWarning, line); }
void log_error(std::string_view line) { log(LogLevel::kError, line); }

}  // namespace pvsfarm
