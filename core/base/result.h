/// Result<T>: a value or an Error. Every recoverable failure leaves a module this way.
///
/// C++20 has no std::expected; this class has the same member names, so that it can be replaced by
/// it later.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "core/base/check.h"

namespace core {

/// Kinds of errors, by what the caller can do about them. Layers above add codes of their own with
/// the numbers that are free here.
enum class ErrorCode {
  kBadSyntax = 0,          ///< the text is not in its format at all: not JSON, a broken query
  kForbidden = 2,          ///< the caller may not do this
  kNotFound = 3,           ///< does not exist, or is not visible to the caller
  kConflict = 5,           ///< not possible in the current state
  kTooLarge = 8,           ///< beyond a limit of size
  kUnsupportedFormat = 9,  ///< a file format that is not read
  kInvalidArgument = 12,   ///< well-formed, but a value is wrong or not available
  kMissingFiles = 13,      ///< files that a scene names are missing
  kInternal = 15,          ///< a bug, or a failure of the machine
  kUnavailable = 16,       ///< not now; a later attempt may succeed
  kNoSpace = 17,           ///< the disk is full
  kCancelled = 18          ///< the caller asked to stop; never leaves the process
};

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;  ///< One sentence for the caller, with the actual value and the allowed
                        ///< ones.
  std::string where;    ///< JSON pointer or file path that the message refers to; empty if none.
};

template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool has_value() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }

  /// Pre: has_value().
  const T& value() const& {
    CHECK(has_value());
    return *std::get_if<0>(&state_);
  }
  T& value() & {
    CHECK(has_value());
    return *std::get_if<0>(&state_);
  }
  T&& value() && {
    CHECK(has_value());
    return std::move(*std::get_if<0>(&state_));
  }
  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }
  /// Pre: !has_value().
  const Error& error() const {
    CHECK(!has_value());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Success without a value.
using Status = Result<std::monostate>;
inline Status ok_status() { return Status(std::monostate{}); }

}  // namespace core
