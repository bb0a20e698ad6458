// Result<T>: a value, or an Error that names the file, task or peer at fault and how to mend it.
// Bugs are not errors: those abort through PVS_CHECK (check.hpp).
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "common/base/check.hpp"

namespace pvsfarm {

// The numbers are the process exit codes of the contract.
enum class ErrorKind : int {
  kCommandLine = 1,
  kIo = 2,
  kInvalidInput = 3,
  kRuntime = 4,
  kUnsupported = 5,
  kIncomplete = 6,
  kViolation = 7,  // something declared hidden was seen
  kInterrupted = 130,
};

struct Error {
  ErrorKind kind = ErrorKind::kRuntime;
  std::string text;  // one line
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}  // NOLINT: a value is a Result
  Result(Error error) : state_(std::move(error)) {}  // NOLINT: an Error is a Result

  bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }
  T& value() & { PVS_CHECK(ok()); return std::get<T>(state_); }
  const T& value() const& { PVS_CHECK(ok()); return std::get<T>(state_); }
  // By value: what a temporary Result holds outlives it, in a range-for too.
  T value() && { PVS_CHECK(ok()); return std::get<T>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { PVS_CHECK(!ok()); return std::get<Error>(state_); }

 private:
  std::variant<T, Error> state_;
};

// The Result of an operation that yields nothing but success.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT: an Error is a Status
  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const { PVS_CHECK(!ok()); return *error_; }

 private:
  std::optional<Error> error_;
};

inline Error io_error(std::string text) { return {ErrorKind::kIo, std::move(text)}; }
inline Error invalid_input(std::string text) { return {ErrorKind::kInvalidInput, std::move(text)}; }
inline Error runtime_error(std::string text) { return {ErrorKind::kRuntime, std::move(text)}; }

}  // namespace pvsfarm
