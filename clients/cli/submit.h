/// What `submit` and `batch` share.
#pragma once

#include <string>

namespace cli {

/// The same for every try of one call, so that a repeated request makes nothing twice.
std::string idempotency_key();

}  // namespace cli
