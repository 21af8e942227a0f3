/// What GET /v1/server tells of this program: version, build, names from the registries.
#pragma once

#include <string>

#include "api/server_view.h"
#include "server/config.h"

namespace server {

std::string program_version();
/// config: limits that the operator chose. isa: as core::resolve_isa() gives it.
api::ServerView about_server(const Config& config, const std::string& isa);

}  // namespace server
