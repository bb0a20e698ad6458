// What `pvsfarm status` prints of a running bake, for people and for programs.
#pragma once

#include <string>

#include "common/wire/messages.hpp"

namespace pvsfarm {

std::string status_text(const StatusReport& report);  // lines
std::string status_json(const StatusReport& report);  // one object, no newline

}  // namespace pvsfarm
