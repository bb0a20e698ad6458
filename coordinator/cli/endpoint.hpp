// Where a command may listen for workers.
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

// "" is a private endpoint. Errors: kUnsupported, for what reaches beyond this machine.
inline Status check_endpoint(const std::string& endpoint) {
  for (const char* start : {"ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
    if (endpoint.empty() || endpoint.rfind(start, 0) == 0) return {};
  return Error{ErrorKind::kUnsupported,
               endpoint +
                   ": workers are not authenticated yet, so only ipc:// and loopback addresses "
                   "are listened on; reach them from elsewhere through a tunnel (ssh -R)"};
}

}  // namespace pvsfarm
