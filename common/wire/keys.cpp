#include "common/wire/keys.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "common/base/check.hpp"
#include "common/base/file.hpp"

namespace pvsfarm {
namespace {

constexpr std::size_t kMaxFileBytes = 4u << 20;
constexpr std::string_view kKeyFileHead = "pvsfarm-key 1";
using Z85 = std::array<char, 41>;

KeyBytes from_z85(const Z85& text) {
  KeyBytes key{};
  PVS_CHECK(zmq_z85_decode(key.data(), text.data()) != nullptr);
  return key;
}

KeyBytes public_of(const KeyBytes& secret) {
  Z85 secret_text{}, public_text{};
  PVS_CHECK(zmq_z85_encode(secret_text.data(), secret.data(), secret.size()) != nullptr);
  PVS_CHECK_EQ(zmq_curve_public(public_text.data(), secret_text.data()), 0);
  return from_z85(public_text);
}

// The words of the lines that say something, at most three a line; the third takes the rest.
struct Line {
  std::size_t number = 0;
  std::vector<std::string_view> words;
};

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view rest = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    Line line{number, {}};
    constexpr const char* kBlanks = " \t\r";
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
      if (rest.empty()) break;
      const std::size_t length =
          line.words.size() < 2 ? std::min(rest.find_first_of(kBlanks), rest.size()) : rest.size();
      line.words.push_back(rest.substr(0, length));
      rest.remove_prefix(length);
    }
    if (!line.words.empty() && line.words[0][0] != '#') lines.push_back(std::move(line));
  }
  return lines;
}

enum class Readers { kAnybody, kOwnerAndGroup };

// Whoever can write such a file decides who is let in, or which key is used.
Result<std::string> read_guarded(const std::string& path, Readers readers) {
  struct stat info;
  if (stat(path.c_str(), &info) != 0) return io_error(path + ": " + std::strerror(errno));
  if (!S_ISREG(info.st_mode)) return invalid_input(path + ": not a regular file");
  if ((info.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    return invalid_input(path + ": others may write it; chmod go-w it first");
  if (readers == Readers::kOwnerAndGroup && (info.st_mode & S_IROTH) != 0)
    return invalid_input(path + ": everybody may read this private key; chmod 600 it, and make " +
                         "a new one if somebody may have");
  if (static_cast<std::uint64_t>(info.st_size) > kMaxFileBytes)
    return invalid_input(path + ": too long to be a file of keys");
  return read_file(path);
}

}  // namespace

std::string hex_of(const KeyBytes& key) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : key) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::optional<KeyBytes> key_from_hex(std::string_view text) {
  KeyBytes key{};
  if (text.size() != 2 * key.size()) return std::nullopt;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    int digit = 0;
    if (c >= '0' && c <= '9') {
      digit = c - '0';
    } else if (c >= 'a' && c <= 'f') {
      digit = c - 'a' + 10;
    } else if (c >= 'A' && c <= 'F') {
      digit = c - 'A' + 10;
    } else {
      return std::nullopt;
    }
    key[i / 2] = static_cast<std::uint8_t>(key[i / 2] << 4 | digit);
  }
  return key;
}

KeyPair make_key_pair() {
  Z85 public_text{}, secret_text{};
  PVS_CHECK_EQ(zmq_curve_keypair(public_text.data(), secret_text.data()), 0);
  return {from_z85(public_text), from_z85(secret_text)};
}

Status write_key_file(const std::string& path, const KeyPair& keys) {
  // Never over another file, nor through a link that somebody left there.
  const int file =
      open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0 && errno == EEXIST)
    return invalid_input(path +
                         ": is there already, and a lost private key cannot be made again; "
                         "give another name, or remove it first");
  if (file < 0) return io_error(path + ": cannot make the file: " + std::strerror(errno));
  const std::string text = std::string(kKeyFileHead) + "\npublic " + hex_of(keys.public_key) +
                           "\nsecret " + hex_of(keys.secret) + '\n';
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       fchmod(file, S_IRUSR | S_IWUSR) == 0 && fsync(file) == 0;
  const int error = errno;
  close(file);
  if (written) return {};
  unlink(path.c_str());
  return io_error(path + ": cannot write the key: " + std::strerror(error));
}

Result<KeyPair> read_key_file(const std::string& path) {
  const Result<std::string> text = read_guarded(path, Readers::kOwnerAndGroup);
  if (!text) return text.error();
  std::optional<KeyBytes> public_key, secret;
  if (text->rfind(kKeyFileHead, 0) == 0)
    for (const Line& line : lines_of(*text)) {
      if (line.words.size() != 2) continue;
      if (line.words[0] == "public") public_key = key_from_hex(line.words[1]);
      if (line.words[0] == "secret") secret = key_from_hex(line.words[1]);
    }
  if (!public_key || !secret || public_of(*secret) != *public_key)
    return invalid_input(path + ": not a private key of pvsfarm keygen");
  return KeyPair{*public_key, *secret};
}

Result<KeyBytes> read_public_key(const std::string& key_or_path) {
  if (const auto key = key_from_hex(key_or_path)) return *key;
  const Result<std::string> text = read_guarded(key_or_path, Readers::kAnybody);
  if (!text)
    return Error{text.error().kind,
                 text.error().text + " (neither a key of 64 hexadecimal digits nor a file of one)"};
  for (const Line& line : lines_of(*text))
    for (const std::string_view word : line.words)
      if (line.words[0] != "secret")
        if (const auto key = key_from_hex(word)) return *key;
  return invalid_input(key_or_path + ": holds no public key of 64 hexadecimal digits");
}

Result<AllowList> AllowList::parse(std::string_view text, const std::string& source) {
  AllowList list;
  for (const Line& line : lines_of(text)) {
    const std::string place = source + ", line " + std::to_string(line.number) + ": ";
    const std::optional<Role> role = role_named(line.words[0]);
    const auto key = line.words.size() < 2 ? std::nullopt : key_from_hex(line.words[1]);
    if (!role || !key)
      return invalid_input(place + "not `worker|admin|viewer KEY [NAME]`, with a key of 64 " +
                           "hexadecimal digits as pvsfarm keygen prints it");
    if (!list.roles_.emplace(hex_of(*key), *role).second)
      return invalid_input(place + "this key is there already; a key has one role");
    if (list.roles_.size() > kMaxAllowedKeys)
      return invalid_input(place + "more than " + std::to_string(kMaxAllowedKeys) + " keys");
  }
  return list;
}

Result<AllowList> AllowList::read(const std::string& path) {
  const Result<std::string> text = read_guarded(path, Readers::kAnybody);
  if (!text) return text.error();
  return parse(*text, path);
}

Role AllowList::role_of(std::string_view hex) const {
  const auto found = roles_.find(hex);
  return found == roles_.end() ? Role::kNone : found->second;
}

}  // namespace pvsfarm
