// A question to a running coordinator, for status, drain and cancel.
#pragma once

#include <string>

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"

namespace CLI {
class App;
}

namespace pvsfarm {

// Where a coordinator is, and what it lets in.
struct CoordinatorAddress {
  std::string where;            // the OUT.pvs of a bake on this machine, or an endpoint
  std::string connect;          // an endpoint; counts if `where` is ""
  std::string key, server_key;  // "": none

  std::string name() const { return where.empty() ? connect : where; }
};

// The options of a command that asks a coordinator. `address` outlives the parser.
void add_coordinator_address(CLI::App& command, CoordinatorAddress& address);

// Errors: kRuntime (none at work there, no answer within three seconds, it refuses the key),
// kCommandLine, those of the key files.
Result<Message> ask_coordinator(const CoordinatorAddress& address, const Message& question);

}  // namespace pvsfarm
