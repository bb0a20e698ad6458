// Who may say what to a coordinator. What no line of roles.cpp allows is refused, to everybody: a
// new message works only after somebody has thought of who may send it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/wire/messages.hpp"

namespace pvsfarm {

enum class Role : std::uint8_t {
  kNone,    // nothing at all
  kViewer,  // asks how far the work is
  kWorker,  // takes tasks and delivers results
  kAdmin,   // asks, drains, cancels; delivers nothing
  kLocal,   // whoever reaches an endpoint without keys, which is one of this machine: all of these
};

bool permits(Role role, const Message& message);

// "worker", "admin", "viewer", as in an allow-list. The others have no name there.
std::string_view role_name(Role role);
std::optional<Role> role_named(std::string_view name);

}  // namespace pvsfarm
