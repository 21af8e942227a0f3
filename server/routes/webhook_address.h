/// Addresses that webhooks may call.
#pragma once

#include <optional>
#include <string>

#include "server/config/config.h"

namespace server {

/// Returns why the address may not be called; empty: it may. Names are resolved only at the call;
/// numeric addresses are checked here.
std::optional<std::string> webhook_address_fault(const Config& config, const std::string& url);

}  // namespace server
