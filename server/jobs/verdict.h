/// Verdict: the result of changing a job: success, or the refusal that the API returns.
#pragma once

#include <utility>
#include <variant>

#include "api/json/errors.h"
#include "api/problem.h"
#include "core/base/check.h"
#include "core/base/result.h"

namespace server {

class [[nodiscard]] Verdict {
 public:
  /// Success.
  Verdict() = default;
  Verdict(core::Error error) : refusal_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  Verdict(api::Problem problem)
      : refusal_(std::move(problem)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const { return std::holds_alternative<std::monostate>(refusal_); }
  /// True if refused with that code; false for problems found by a parser.
  bool is(core::ErrorCode code) const { return error() != nullptr && error()->code == code; }
  /// Null for problems found by a parser.
  const core::Error* error() const { return std::get_if<core::Error>(&refusal_); }
  /// Pre: refused.
  api::Problem problem() const {
    CHECK(!*this);
    return error() != nullptr ? api::from_error(*error()) : *std::get_if<api::Problem>(&refusal_);
  }

 private:
  std::variant<std::monostate, core::Error, api::Problem> refusal_;
};

}  // namespace server
