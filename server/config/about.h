/// The part of GET /v1/server that describes this program: version, build, registry names.
#pragma once

#include <string>

#include "api/answers/server_view.h"
#include "server/config/config.h"
#include "server/store/storage_quota.h"

namespace server {

std::string program_version();
/// Returns the storage limits in bytes. Pre: the data directory exists. If the size of the disk is
/// unknown, percentages do not limit.
StorageLimits storage_limits(const Config& config);
/// Memory limits in bytes; 0: no limit. If the machine's memory is unknown, nothing is limited.
struct MemoryLimits {
  std::uint64_t all_bytes = 0;
  std::uint64_t gate_bytes = 0;  ///< For jobs and requests, excluding the process itself.
  std::uint64_t scene_cache_bytes = 0;
  std::uint64_t film_cache_bytes = 0;
};
/// usable_bytes: from usable_memory_bytes().
MemoryLimits memory_limits(const Config& config, std::uint64_t usable_bytes);
/// config and memory: limits chosen by the operator. isa: from core::resolve_isa().
api::ServerView about_server(const Config& config, const MemoryLimits& memory,
                             const std::string& isa);

}  // namespace server
