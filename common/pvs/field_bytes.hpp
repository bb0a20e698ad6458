// Fields one behind the other: whole numbers as LEB128, floating-point ones as their bits, little
// endian. Both directions have one interface, so that a list of fields is written once.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/pvs/store_bytes.hpp"

namespace pvsfarm {

struct FieldWriter {
  ByteWriter bytes;
  void field(const double& value) { bytes.put_f64(value); }
  void field(const float& value) { bytes.put_f32(value); }
  void field(const std::uint64_t& value) { bytes.put_varint(value); }
  void field(const std::uint32_t& value) { bytes.put_varint(value); }
};

// Once anything is wrong (cut short, a number out of its range or not finite) it stays so, and
// fields read 0 or anything.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  void field(double& out) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits |= next() << (8 * i);
    out = std::bit_cast<double>(bits);
    refuse_unless(std::isfinite(out));
  }
  void field(float& out) {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(next()) << (8 * i);
    out = std::bit_cast<float>(bits);
    refuse_unless(std::isfinite(out));
  }
  void field(std::uint64_t& out) {
    out = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint64_t byte = next();
      refuse_unless(shift < 63 || byte <= 1);
      out |= (byte & 0x7f) << shift;
      if (byte < 0x80 || !whole_) return;
    }
  }
  void field(std::uint32_t& out) {
    std::uint64_t wide = 0;
    field(wide);
    refuse_unless(wide <= std::numeric_limits<std::uint32_t>::max());
    out = static_cast<std::uint32_t>(wide);
  }
  void refuse_unless(bool good) { whole_ = whole_ && good; }
  bool whole() const { return whole_; }                   // so far
  bool done() const { return whole_ && bytes_.empty(); }  // and nothing is left
  std::span<const std::byte> rest() const { return bytes_; }

 private:
  std::uint64_t next() {
    refuse_unless(!bytes_.empty());
    if (!whole_) return 0;
    const auto byte = std::to_integer<std::uint64_t>(bytes_.front());
    bytes_ = bytes_.subspan(1);
    return byte;
  }

  std::span<const std::byte> bytes_;
  bool whole_ = true;
};

}  // namespace pvsfarm
