#include "coordinator/cli/ask_coordinator.hpp"

#include "common/wire/socket.hpp"
#include "coordinator/service/bake.hpp"

namespace pvsfarm {
namespace {
constexpr std::chrono::milliseconds kPatience{3'000};
}

Result<Message> ask_coordinator(const std::string& where, const Message& question) {
  std::string endpoint = where;
  if (where.find("://") == std::string::npos) {
    const Result<std::string> found = endpoint_of(where);
    if (!found) return found.error();
    endpoint = *found;
  }
  auto dealer = Dealer::connect(endpoint);
  if (!dealer) return dealer.error();
  (*dealer)->send({}, question);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    if (std::optional<Received> received = (*dealer)->receive()) {
      if (!received->decoded) return received->decoded.error();
      return std::move(received->decoded->message);
    }
    (*dealer)->wait(std::chrono::milliseconds(100));
  }
  return runtime_error(endpoint + ": no coordinator answers");
}

}  // namespace pvsfarm
