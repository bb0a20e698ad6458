#include "common/wire/codec.hpp"

#include <google/protobuf/arena.h>

#include "common/wire/amplification.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/crc32c.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kMagic = 0x46535650;  // "PVSF", little endian

template <class Plain, class Proto>
std::string pack_to_string(const Plain& plain) {
  google::protobuf::Arena arena;
  auto* message = google::protobuf::Arena::CreateMessage<Proto>(&arena);
  pack(plain, *message);
  return message->SerializeAsString();
}

template <class Plain, class Proto>
Result<Message> unpack_from(std::span<const std::byte> body) {
  if (!grows_little(*Proto::descriptor(), body))
    return invalid_input("message refused: its body has too many fields, or does not parse");
  google::protobuf::Arena arena;
  auto* message = google::protobuf::Arena::CreateMessage<Proto>(&arena);
  if (!message->ParseFromArray(body.data(), static_cast<int>(body.size())))
    return invalid_input("message refused: its body does not parse");
  Plain plain;
  if (Status status = unpack(*message, plain); !status) return status.error();
  return Message(std::move(plain));
}

Result<Message> unpack_body(proto::MessageType type, std::span<const std::byte> body) {
  switch (type) {
#define PVSFARM_CASE(Plain, Proto, Type) \
  case proto::Type:                      \
    return unpack_from<Plain, proto::Proto>(body);
    PVSFARM_MESSAGES(PVSFARM_CASE)
#undef PVSFARM_CASE
    default:
      return invalid_input("message refused: unknown type " + std::to_string(type));
  }
}

struct Pack {
  proto::MessageType type;
  std::string body;
#define PVSFARM_PACK(Plain, Proto, Type)               \
  void operator()(const Plain& plain) {                \
    type = proto::Type;                                \
    body = pack_to_string<Plain, proto::Proto>(plain); \
  }
  PVSFARM_MESSAGES(PVSFARM_PACK)
#undef PVSFARM_PACK
};

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

}  // namespace

Frames encode(const Envelope& envelope, const Message& message) {
  Pack packed{};
  std::visit(packed, message);
  PVS_CHECK_LE(packed.body.size(), kMaxBodyBytes);
  proto::Header header;
  header.set_magic(kMagic);
  header.set_major(kProtocolMajor);
  header.set_minor(envelope.minor);
  header.set_type(packed.type);
  header.set_session(envelope.session);
  header.set_epoch(envelope.epoch);
  header.set_sequence(envelope.sequence);
  header.set_body_crc32c(crc32c(bytes_of(packed.body)));
  return {header.SerializeAsString(), std::move(packed.body)};
}

Result<Decoded> decode(std::span<const std::byte> header_bytes, std::span<const std::byte> body) {
  if (header_bytes.size() > kMaxHeaderBytes || body.size() > kMaxBodyBytes)
    return invalid_input("message refused: a frame over its size limit");
  proto::Header header;
  if (!header.ParseFromArray(header_bytes.data(), static_cast<int>(header_bytes.size())) ||
      header.magic() != kMagic)
    return invalid_input("message refused: not of this protocol");
  if (header.major() != kProtocolMajor && header.type() != proto::HELLO)
    return invalid_input("message refused: protocol " + std::to_string(header.major()) +
                         ", this program speaks " + std::to_string(kProtocolMajor));
  if (crc32c(body) != header.body_crc32c())
    return invalid_input("message refused: damaged on the way");
  Result<Message> message = unpack_body(header.type(), body);
  if (!message) return message.error();
  return Decoded{{header.minor(), header.session(), header.epoch(), header.sequence()},
                 header.major(),
                 std::move(message).value()};
}

std::string type_name(const Message& message) {
  struct Name {
#define PVSFARM_NAME(Plain, Proto, Type) \
  const char* operator()(const Plain&) const { return #Type; }
    PVSFARM_MESSAGES(PVSFARM_NAME)
#undef PVSFARM_NAME
  };
  return std::visit(Name{}, message);
}

}  // namespace pvsfarm
