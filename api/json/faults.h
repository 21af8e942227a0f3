/// Faults: the field errors found by a parser.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "api/json/errors.h"
#include "api/problem.h"
#include "core/base/result.h"

namespace api {

class Faults {
 public:
  void add(std::string pointer, std::string detail) {
    all_too_large_ = false;
    keep({std::move(pointer), std::move(detail)});
  }
  /// Adds a fault for a well-formed value that exceeds a size limit.
  void add_too_large(std::string pointer, std::string detail) {
    keep({std::move(pointer), std::move(detail)});
  }
  void append(const Faults& others) {
    for (const FieldError& error : others.errors_) {
      keep(error);
    }
    all_too_large_ = all_too_large_ && others.all_too_large_;
  }
  bool empty() const noexcept { return errors_.empty(); }
  /// Returns 413 if every fault is one of size, otherwise 422. Pre: not empty.
  Problem problem() const {
    return make_problem(
        all_too_large_ ? core::ErrorCode::kTooLarge : core::ErrorCode::kInvalidArgument, errors_);
  }

 private:
  /// Limit on the faults kept: a hostile body can contain a hundred thousand.
  static constexpr std::size_t kKept = 256;
  void keep(FieldError error) {
    if (errors_.size() < kKept) {
      errors_.push_back(std::move(error));
    }
  }

  std::vector<FieldError> errors_;
  bool all_too_large_ = true;
};

}  // namespace api
