#include "coordinator/cli/door.hpp"

#include <signal.h>

#include <CLI/CLI.hpp>

#include "common/wire/socket.hpp"

namespace pvsfarm {

CLI::Option* add_door_options(CLI::App& command, Door& door) {
  command.add_option("--key", door.key, "FILE of pvsfarm keygen: the coordinator's private key");
  command.add_option("--allow", door.allow,
                     "FILE of public keys that may come in, a line `worker|admin|viewer KEY "
                     "[NAME]` each; read again at SIGHUP");
  return command.add_option("--bind", door.endpoint,
                            "where to listen for workers: tcp://ADDRESS:PORT or ipc:///PATH");
}

Result<std::optional<FarmKeys>> keys_of(const Door& door) {
  if (door.key.empty() != door.allow.empty())
    return Error{ErrorKind::kCommandLine, "--key and --allow go together"};
  if (door.key.empty()) {
    if (door.endpoint.empty() || is_local(door.endpoint)) return std::optional<FarmKeys>();
    return Error{ErrorKind::kUnsupported,
                 door.endpoint +
                     ": other machines reach this, so it needs keys: make them with pvsfarm "
                     "keygen and give --key FILE --allow FILE; or listen on tcp://127.0.0.1:PORT "
                     "and reach it through a tunnel (ssh -R)"};
  }
  const Result<KeyPair> own = read_key_file(door.key);
  if (!own) return own.error();
  // Before the scene is read: an error here should not take minutes to show.
  if (const auto allowed = AllowList::read(door.allow); !allowed) return allowed.error();
  signal(SIGHUP, SIG_IGN);
  return std::optional(FarmKeys{*own, door.allow});
}

}  // namespace pvsfarm
