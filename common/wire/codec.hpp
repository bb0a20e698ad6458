// Messages to frames and back. Everything from outside is checked here: sizes before parsing,
// counts, ranges and lengths after it; what decode() returns can be used as it is.
#pragma once

#include <span>
#include <string>

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"

namespace pvsfarm {

struct Frames {
  std::string header;  // at most kMaxHeaderBytes
  std::string body;    // at most kMaxBodyBytes
};

// Requires: the message keeps its limits (texts are cut to theirs).
Frames encode(const Envelope& envelope, const Message& message);

struct Decoded {
  Envelope envelope;
  std::uint32_t major = 0;
  Message message;
};

// Errors: kInvalidInput (too long, not of this protocol, damaged, a value out of its range).
// A HELLO of another major version is decoded, so that it can be answered.
Result<Decoded> decode(std::span<const std::byte> header, std::span<const std::byte> body);

// The name of a message's type, for logs: "HELLO".
std::string type_name(const Message& message);

}  // namespace pvsfarm
