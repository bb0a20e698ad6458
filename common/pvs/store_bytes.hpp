// Builds the bytes of a block: little endian, whatever the machine.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/vec.hpp"

namespace pvsfarm {

class ByteWriter {
 public:
  void put_u32(std::uint32_t value) { put(value, 4); }
  void put_u64(std::uint64_t value) { put(value, 8); }
  void put_f32(float value) { put_u32(std::bit_cast<std::uint32_t>(value)); }
  void put_f64(double value) { put_u64(std::bit_cast<std::uint64_t>(value)); }
  void put_vec3(const Vec3& v) {
    for (int a = 0; a < 3; ++a) put_f64(v[a]);
  }
  void put_varint(std::uint64_t value) {  // LEB128
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::byte>(value | 0x80));
    bytes_.push_back(static_cast<std::byte>(value));
  }
  // In the lowest `width` bytes.
  void put_number(std::uint64_t value, int width) { put(value, width); }
  // Each in `width` bits, one behind the other from the lowest bit on; then zeros to the next byte.
  void put_bits(std::span<const std::uint64_t> values, int width) {
    const std::size_t begin = bytes_.size();
    bytes_.resize(begin + (values.size() * static_cast<std::size_t>(width) + 7) / 8);
    std::size_t at = 8 * begin;
    for (const std::uint64_t value : values)
      for (int i = 0; i < width; ++i, ++at)
        bytes_[at / 8] |= static_cast<std::byte>((value >> i & 1) << (at % 8));
  }
  void put_bytes(std::span<const std::byte> data) {
    bytes_.insert(bytes_.end(), data.begin(), data.end());
  }
  void pad() { bytes_.resize((bytes_.size() + 7) & ~std::size_t{7}); }  // to 8 bytes, with zeros
  // Bytes that hold all numbers up to `greatest`.
  static int width_of(std::uint64_t greatest) { return (std::bit_width(greatest) + 7) / 8; }
  std::size_t size() const { return bytes_.size(); }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  void put(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::byte>(value >> (8 * i)));
  }

  std::vector<std::byte> bytes_;
};

}  // namespace pvsfarm
