// `pvsfarm keygen FILE`: a new private key in FILE, its public line on stdout.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/wire/keys.hpp"
#include "coordinator/cli/command.hpp"

namespace pvsfarm {
namespace {

struct KeygenOptions {
  std::string file, role, name;
};

Status keygen(const KeygenOptions& options) {
  if (options.name.find_first_of("\n\r") != std::string::npos)
    return Error{ErrorKind::kCommandLine, "--name: a name has one line"};
  const KeyPair keys = make_key_pair();
  if (Status status = write_key_file(options.file, keys); !status) return status;
  if (!options.role.empty()) std::cout << options.role << ' ';
  std::cout << hex_of(keys.public_key);
  if (!options.role.empty() && !options.name.empty()) std::cout << ' ' << options.name;
  std::cout << '\n';
  return {};
}

}  // namespace

void add_keygen_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<KeygenOptions>();
  CLI::App* command = app.add_subcommand("keygen", "make a key for a farm of several machines");
  command->add_option("file", options->file, "the private key is written there; it must not exist")
      ->required();
  command->add_option("--role", options->role, "print a line for --allow: worker, admin or viewer")
      ->check(CLI::IsMember({"worker", "admin", "viewer"}));
  command->add_option("--name", options->name, "whose key it is, for that line");
  command->footer(
      "The private key stays where it is used; what is printed is public.\n"
      "Examples:\n"
      "  pvsfarm keygen farm.key > farm.pub                         # the coordinator's\n"
      "  pvsfarm keygen worker.key --role worker --name rack3 >> farm.allow\n"
      "  pvsfarm coordinate city.glb -o city.pvs --bind tcp://0.0.0.0:5555 "
      "--key farm.key --allow farm.allow\n"
      "  pvsfarm-worker --connect tcp://HOST:5555 --key worker.key --server-key farm.pub");
  command->callback([&context, options] { context.run = [options] { return keygen(*options); }; });
}

}  // namespace pvsfarm
