#include "coordinator/cli/settings_sources.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdlib>
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

// What names one run's files, or ends the program, is no setting.
bool is_setting(const CLI::Option& option) {
  if (option.get_lnames().empty() || option.get_positional()) return false;
  const std::string& name = option.get_lnames().front();
  return name != "help" && name != "version" && name != "config" && name != "output";
}

void add_environment(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (is_setting(*option)) option->envname(environment_name(option->get_lnames().front()));
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
      return value != nullptr && *value != '\0' && item.name != "output";
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
