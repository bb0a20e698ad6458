#include "common/wire/amplification.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

namespace pvsfarm {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

class Counter {
 public:
  explicit Counter(std::span<const std::byte> body)
      : in_(reinterpret_cast<const std::uint8_t*>(body.data()), static_cast<int>(body.size())) {}

  bool count(const Descriptor& type, int depth) {
    if (depth > kMaxDepth) return false;
    while (const std::uint32_t tag = in_.ReadTag()) {
      if (++fields_ > kMaxFields) return false;
      const FieldDescriptor* field = type.FindFieldByNumber(Wire::GetTagFieldNumber(tag));
      if (!value(Wire::GetTagWireType(tag), field, depth)) return false;
    }
    return in_.ConsumedEntireMessage();
  }

 private:
  bool value(Wire::WireType wire, const FieldDescriptor* field, int depth) {
    std::uint64_t scalar = 0;
    std::uint32_t length = 0;
    switch (wire) {
      case Wire::WIRETYPE_VARINT:
        return in_.ReadVarint64(&scalar);
      case Wire::WIRETYPE_FIXED64:
        return in_.Skip(8);
      case Wire::WIRETYPE_FIXED32:
        return in_.Skip(4);
      case Wire::WIRETYPE_LENGTH_DELIMITED:
        break;
      default:
        return false;  // groups: no message here has any
    }
    if (!in_.ReadVarint32(&length) || length > kMaxBytes) return false;
    if (field == nullptr || field->type() != FieldDescriptor::TYPE_MESSAGE)
      return in_.Skip(static_cast<int>(length));
    if (static_cast<int>(length) > in_.BytesUntilLimit() && in_.BytesUntilLimit() >= 0)
      return false;
    const auto limit = in_.PushLimit(static_cast<int>(length));
    const bool good = count(*field->message_type(), depth + 1);
    in_.PopLimit(limit);
    return good;
  }

  static constexpr std::uint32_t kMaxBytes = 1u << 24;
  CodedInputStream in_;
  std::size_t fields_ = 0;
};

}  // namespace

bool grows_little(const Descriptor& type, std::span<const std::byte> body) {
  return Counter(body).count(type, 0);
}

}  // namespace pvsfarm
