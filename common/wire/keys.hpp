// Keys of the farm (Curve25519, as CURVE of ZeroMQ uses them), their files, and the list of those a
// coordinator lets in. Written as 64 hexadecimal digits: no shell, YAML or TOML needs quotes then.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/base/result.hpp"
#include "common/wire/roles.hpp"

namespace pvsfarm {

using KeyBytes = std::array<std::uint8_t, 32>;

std::string hex_of(const KeyBytes& key);
std::optional<KeyBytes> key_from_hex(std::string_view text);

struct KeyPair {
  KeyBytes public_key{};
  KeyBytes secret{};
};
KeyPair make_key_pair();

// A new file that only its owner reads. Errors: kIo; kInvalidInput, there is a file already.
Status write_key_file(const std::string& path, const KeyPair& keys);
// Errors: kIo; kInvalidInput (not such a file, its two keys do not belong together, others than
// its owner and group may read it, or others than its owner may write it).
Result<KeyPair> read_key_file(const std::string& path);
// A public key in digits, or the path of a file that holds one on a line of its own.
// Errors: kIo, kInvalidInput.
Result<KeyBytes> read_public_key(const std::string& key_or_path);

inline constexpr std::size_t kMaxAllowedKeys = 10'000;

// Lines `ROLE KEY [NAME]`; empty ones and those that begin with # are passed over.
class AllowList {
 public:
  // Errors: kInvalidInput, naming `source` and the line.
  static Result<AllowList> parse(std::string_view text, const std::string& source);
  // Errors: kIo; kInvalidInput, also for a file that others than its owner may write.
  static Result<AllowList> read(const std::string& path);

  Role role_of(std::string_view hex) const;  // kNone: not on the list
  std::size_t size() const { return roles_.size(); }

 private:
  std::map<std::string, Role, std::less<>> roles_;  // by the key's digits, in small letters
};

// What the two ends of a connection need.
struct ServerSecurity {
  KeyPair keys;
  AllowList allow;
};
struct ClientSecurity {
  KeyPair keys;
  KeyBytes server{};
};

}  // namespace pvsfarm
