// Where a command listens for workers that come by themselves, and whom it lets in.
#pragma once

#include <optional>
#include <string>

#include "common/base/result.hpp"
#include "coordinator/service/farm.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace pvsfarm {

struct Door {
  std::string endpoint;    // "": a private one
  std::string key, allow;  // "": no keys, then only peers of this machine
};

// Adds --bind, which is returned, --key and --allow. `door` outlives the parser.
CLI::Option* add_door_options(CLI::App& command, Door& door);

// From then on SIGHUP does not end the process, if there are keys: it has them read again.
// Errors: kCommandLine; kUnsupported, what reaches beyond this machine without keys; those of
// the key files.
Result<std::optional<FarmKeys>> keys_of(const Door& door);

}  // namespace pvsfarm
