/// What GET /v1/server tells of this program: version, build, names from the registries.
#pragma once

#include <string>

#include "api/server_view.h"
#include "server/config.h"
#include "server/store/storage_quota.h"

namespace server {

std::string program_version();
/// What may be kept, in bytes. Pre: the data directory is there; on a disk that tells nothing, percentages bind nobody.
StorageLimits storage_limits(const Config& config);
/// config: limits that the operator chose. isa: as core::resolve_isa() gives it.
api::ServerView about_server(const Config& config, const std::string& isa);

}  // namespace server
