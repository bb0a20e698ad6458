// `pvsfarm validate`: is a store whole and right?
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/pvs/store_validate.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {

void add_validate_command(CLI::App& app, CommandContext& context) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("validate", "is a store whole and right?");
  command->add_option("store", *path, "the .pvs file")->required();
  command->footer(
      "Checks every byte against checksums and the digest, and the hierarchy, the sets and the\n"
      "location of points against each other. Exit code 3, and the damage and its offset, if not.\n"
      "Examples:\n"
      "  pvsfarm validate city.pvs");
  command->callback([&context, path] {
    context.run = [path] {
      Status status = validate_store(*path);
      if (status) std::cout << *path << ": valid\n";
      return status;
    };
  });
}

}  // namespace pvsfarm
