// Content digests: BLAKE2b-256, from libsodium. Used for scene bundles, stores and deltas.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace pvsfarm {

struct Digest {
  std::array<std::uint8_t, 32> bytes{};
  std::string hex() const;
  friend auto operator<=>(const Digest&, const Digest&) = default;
};

// Feeds a digest piece by piece. Threads: one object, one thread.
class DigestBuilder {
 public:
  DigestBuilder();
  DigestBuilder& add(std::span<const std::byte> data);
  DigestBuilder& add(std::string_view text);  // the length, then the characters
  DigestBuilder& add_u64(std::uint64_t value);
  DigestBuilder& add_f64(double value);  // the bit pattern
  Digest finish();                       // once

 private:
  alignas(64) std::array<std::byte, 512> state_;
};

Digest digest_of(std::span<const std::byte> data);

}  // namespace pvsfarm
