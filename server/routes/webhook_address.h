/// Where webhook calls may go.
#pragma once

#include <optional>
#include <string>

#include "server/config.h"

namespace server {

/// Why no call may go to that address; empty: one may. A name is looked up when the call is made;
/// numbers are judged at once.
std::optional<std::string> webhook_address_fault(const Config& config, const std::string& url);

}  // namespace server
