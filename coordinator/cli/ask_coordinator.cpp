#include "coordinator/cli/ask_coordinator.hpp"

#include <CLI/CLI.hpp>

#include "common/wire/socket.hpp"
#include "coordinator/service/bake.hpp"

namespace pvsfarm {
namespace {

constexpr std::chrono::milliseconds kPatience{3'000};

Result<std::string> endpoint_at(const CoordinatorAddress& address) {
  if (address.name().empty())
    return Error{ErrorKind::kCommandLine,
                 "say which bake: its OUT.pvs on this machine, or --connect tcp://HOST:PORT"};
  if (address.name().find("://") != std::string::npos) return address.name();
  return endpoint_of(address.name());
}

Result<std::optional<ClientSecurity>> security_of(const CoordinatorAddress& address) {
  if (address.key.empty() && address.server_key.empty()) return std::optional<ClientSecurity>();
  if (address.key.empty() || address.server_key.empty())
    return Error{ErrorKind::kCommandLine, "--key and --server-key go together"};
  const Result<KeyPair> keys = read_key_file(address.key);
  if (!keys) return keys.error();
  const Result<KeyBytes> server = read_public_key(address.server_key);
  if (!server) return server.error();
  return std::optional(ClientSecurity{*keys, *server});
}

Error no_answer(const std::string& endpoint, Dealer::Handshake handshake) {
  switch (handshake) {
    case Dealer::Handshake::kRefused:
      return runtime_error(endpoint + ": the coordinator does not let this key in");
    case Dealer::Handshake::kOther:
      return runtime_error(endpoint +
                           ": the coordinator uses keys and this command none, or the other way "
                           "round; see --key and --server-key");
    case Dealer::Handshake::kBroken:
      return runtime_error(
          endpoint +
          ": the coordinator hangs up; does it ask for --key and --server-key, or has it another "
          "key than --server-key?");
    case Dealer::Handshake::kFine:
      break;
  }
  return runtime_error(endpoint + ": no coordinator answers");
}

}  // namespace

void add_coordinator_address(CLI::App& command, CoordinatorAddress& address) {
  command.add_option("where", address.where, "the bake's OUT.pvs, or its endpoint");
  command.add_option("--connect", address.connect, "its endpoint: tcp://HOST:PORT");
  command.add_option("--key", address.key, "FILE of pvsfarm keygen: this command's private key");
  command.add_option("--server-key", address.server_key,
                     "the coordinator's public key, or a FILE that holds it");
}

Result<Message> ask_coordinator(const CoordinatorAddress& address, const Message& question) {
  const Result<std::string> endpoint = endpoint_at(address);
  if (!endpoint) return endpoint.error();
  const auto security = security_of(address);
  if (!security) return security.error();
  auto dealer = Dealer::connect(*endpoint, *security);
  if (!dealer) return dealer.error();
  (*dealer)->send({}, question);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    if (std::optional<Received> received = (*dealer)->receive()) {
      if (!received->decoded) return received->decoded.error();
      if (const auto* reject = std::get_if<Reject>(&received->decoded->message))
        return runtime_error(*endpoint + ": refused: " + reject->text);
      return std::move(received->decoded->message);
    }
    if ((*dealer)->handshake() == Dealer::Handshake::kRefused) break;
    (*dealer)->wait(std::chrono::milliseconds(100));
  }
  return no_answer(*endpoint, (*dealer)->handshake());
}

}  // namespace pvsfarm
