/// Problem: an error response (RFC 9457), and Parsed<T>: a value or a Problem.
///
/// A parser collects all faults before it returns, so that a client can fix them at once.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/check.h"

namespace api {

/// One fault of the input. pointer: JSON pointer (RFC 6901) into the body, "" for the whole body;
/// for a query parameter "/name".
struct FieldError {
  std::string pointer;
  std::string detail;  ///< States what was found and what is allowed.
  friend bool operator==(const FieldError&, const FieldError&) = default;
};

struct Problem {
  int status = 500;
  std::string type;      ///< URI reference, "/docs#problem-..."
  std::string title;     ///< the same for all problems of this type
  std::string detail;    ///< about this problem
  std::string instance;  ///< path of the request; filled in where it is known
  std::vector<FieldError> errors;
  friend bool operator==(const Problem&, const Problem&) = default;
};

/// A value, or the problem that prevented it.
template <typename T>
class [[nodiscard]] Parsed {
 public:
  Parsed(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Parsed(Problem problem)
      : state_(std::in_place_index<1>, std::move(problem)) {
  }  // NOLINT(google-explicit-constructor)

  bool has_value() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }

  /// Pre: has_value().
  const T& operator*() const& {
    CHECK(has_value());
    return *std::get_if<0>(&state_);
  }
  T& operator*() & {
    CHECK(has_value());
    return *std::get_if<0>(&state_);
  }
  T&& operator*() && {
    CHECK(has_value());
    return std::move(*std::get_if<0>(&state_));
  }
  const T* operator->() const { return &**this; }
  T* operator->() { return &**this; }
  /// Pre: !has_value().
  const Problem& problem() const {
    CHECK(!has_value());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Problem> state_;
};

}  // namespace api
