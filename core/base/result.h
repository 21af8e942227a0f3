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

/// Classifies errors by what the caller can do about them. api/errors.cpp maps them to responses.
enum class ErrorCode {
  kBadSyntax,            ///< not JSON, or a broken query string
  kUnauthorized,         ///< no key, or an unknown one
  kForbidden,            ///< the key does not allow it
  kNotFound,             ///< does not exist, or is not visible to the caller
  kNotAcceptable,        ///< the caller accepts none of the formats
  kConflict,             ///< impossible in the current state
  kGone,                 ///< no longer exists
  kPreconditionFailed,   ///< changed since the caller read it
  kTooLarge,             ///< exceeds a size limit
  kUnsupportedMedia,     ///< unsupported format
  kRangeNotSatisfiable,  ///< range outside of the content
  kMisdirected,          ///< addressed to a server of another name
  kInvalidArgument,      ///< well-formed, but a value is wrong or unavailable
  kMissingFiles,         ///< files that a scene refers to are missing
  kTooManyRequests,      ///< a queue or quota is full; retry later
  kInternal,             ///< an internal or machine error
  kUnavailable,          ///< temporarily unavailable; retry later
  kNoSpace,              ///< disk full
  kCancelled,            ///< the caller asked to stop; never leaves the process
  kOverQuota  ///< above the operator's limit. Must stay last: stored jobs contain the numbers
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
