/// Errors of files that are well-formed but have a value that is wrong or not available.
#pragma once

#include <string>
#include <utility>

#include "core/base/result.h"

namespace core {

inline Error invalid(std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message), ""};
}

/// where: a JSON pointer.
inline Error invalid(std::string where, std::string message) {
  return {ErrorCode::kInvalidArgument, std::move(message), std::move(where)};
}

}  // namespace core
