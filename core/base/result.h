/// Result<T>: a value or an Error. The only way a recoverable failure leaves a module.
///
/// Our own because C++20 has no std::expected; it keeps the same member names so that it can be
/// replaced by the standard one later.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "core/base/check.h"

namespace core {

/// What went wrong, by what the caller can do about it. api/errors.cpp says how each is answered.
enum class ErrorCode {
  kBadSyntax,            ///< not JSON at all, a broken query string
  kUnauthorized,         ///< no key, or one that is not known
  kForbidden,            ///< the key does not allow it
  kNotFound,             ///< no such thing, or not visible to the caller
  kNotAcceptable,        ///< no format that the caller accepts
  kConflict,             ///< not possible in the current state
  kGone,                 ///< was there and is not any more
  kPreconditionFailed,   ///< has changed since the caller read it
  kTooLarge,             ///< beyond a limit of size
  kUnsupportedMedia,     ///< a format that is not read
  kRangeNotSatisfiable,  ///< a range outside of the content
  kMisdirected,          ///< meant for a server of another name
  kInvalidArgument,      ///< well-formed, but a value is wrong or not available
  kMissingFiles,         ///< files that a scene names are missing
  kTooManyRequests,      ///< a queue or a quota is full; later it may not be
  kInternal,             ///< a fault of ours or of the machine
  kUnavailable,          ///< not now; later it may work
  kNoSpace,              ///< the disk is full
  kCancelled,            ///< the caller asked to stop; never leaves the process
  kOverQuota             ///< more than the operator grants. Last: stored jobs hold the numbers
};

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;  ///< One sentence for the caller; says the value seen and what is allowed.
  std::string where;    ///< JSON pointer or file path the message is about; empty if none.
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
