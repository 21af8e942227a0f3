/// Code shared by `submit` and `batch`.
#pragma once

#include <string>

namespace cli {

/// Returns a key that is the same for every attempt of one call, so that a repeated request creates
/// nothing twice.
std::string idempotency_key();

}  // namespace cli
