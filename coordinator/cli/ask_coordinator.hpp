// A question to a running coordinator, for status, drain and cancel.
#pragma once

#include <string>

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"

namespace pvsfarm {

// `where`: an endpoint (tcp://, ipc://), or the OUT.pvs of a bake on this machine.
// Errors: kRuntime (none at work there, no answer within three seconds), kCommandLine.
Result<Message> ask_coordinator(const std::string& where, const Message& question);

}  // namespace pvsfarm
