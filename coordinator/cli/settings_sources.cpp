#include "coordinator/cli/settings_sources.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace pvsfarm {
namespace {

std::string environment_name(const std::string& long_option) {
  std::string name = "PVSFARM_";
  for (const char c : long_option)
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

// What names one run's files or places, or ends the program, is no setting.
bool is_setting(const std::string& name) {
  static const char* const kOthers[] = {"help", "version", "config", "output", "picture",
                                        "cell", "at",      "data",   "svg",    "name"};
  return std::find(std::begin(kOthers), std::end(kOthers), name) == std::end(kOthers);
}

std::string long_name(const CLI::Option& option) {
  const bool named = !option.get_lnames().empty() && !option.get_positional();
  return named ? option.get_lnames().front() : "";
}

void add_environment(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::string name = long_name(*option);
    if (!name.empty() && is_setting(name)) option->envname(environment_name(name));
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    add_environment(*command);
}

// CLI11 lets a file win over the environment: leave out of the file what the environment sets.
class TomlBelowEnvironment : public CLI::ConfigTOML {
 public:
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    std::vector<CLI::ConfigItem> kept = CLI::ConfigTOML::from_config(input);
    std::erase_if(kept, [](const CLI::ConfigItem& item) {
      const char* value = std::getenv(environment_name(item.name).c_str());
      return value != nullptr && *value != '\0' && is_setting(item.name);
    });
    return kept;
  }
};

}  // namespace

void add_settings_sources(CLI::App& app) {
  add_environment(app);
  app.set_config("--config", "", "read settings from this TOML file, a table a command");
  app.config_formatter(std::make_shared<TomlBelowEnvironment>());
  app.allow_config_extras(CLI::config_extras_mode::error);
}

}  // namespace pvsfarm
