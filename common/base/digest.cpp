#include "common/base/digest.hpp"

#include <sodium.h>

#include <bit>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {
crypto_generichash_state* state_of(std::array<std::byte, 512>& bytes) {
  static_assert(sizeof(crypto_generichash_state) <= 512);
  return reinterpret_cast<crypto_generichash_state*>(bytes.data());
}
}  // namespace

std::string Digest::hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const std::uint8_t b : bytes) {
    out += kDigits[b >> 4];
    out += kDigits[b & 15];
  }
  return out;
}

DigestBuilder::DigestBuilder() {
  PVS_CHECK(sodium_init() >= 0);
  crypto_generichash_init(state_of(state_), nullptr, 0, 32);
}

DigestBuilder& DigestBuilder::add(std::span<const std::byte> data) {
  crypto_generichash_update(state_of(state_), reinterpret_cast<const unsigned char*>(data.data()),
                            data.size());
  return *this;
}

DigestBuilder& DigestBuilder::add(std::string_view text) {
  add_u64(text.size());
  return add(std::as_bytes(std::span(text)));
}

DigestBuilder& DigestBuilder::add_u64(std::uint64_t value) {
  std::array<std::byte, 8> little_endian;
  for (int i = 0; i < 8; ++i) little_endian[i] = static_cast<std::byte>(value >> (8 * i));
  return add(little_endian);
}

DigestBuilder& DigestBuilder::add_f64(double value) {
  return add_u64(std::bit_cast<std::uint64_t>(value));
}

Digest DigestBuilder::finish() {
  Digest digest;
  crypto_generichash_final(state_of(state_), digest.bytes.data(), digest.bytes.size());
  return digest;
}

Digest digest_of(std::span<const std::byte> data) { return DigestBuilder().add(data).finish(); }

}  // namespace pvsfarm
