/// The part of GET /v1/server about this program: version, build, names from the registries.
#pragma once

#include <string>

#include "api/server_view.h"
#include "server/config.h"
#include "server/store/storage_quota.h"

namespace server {

std::string program_version();
/// What may be kept, in bytes. Pre: the data directory is there; where the size of the disk
/// is unknown, percentages are no limit.
StorageLimits storage_limits(const Config& config);
/// What may be held in memory, in bytes; 0: any number. Where nothing is known of the machine,
/// nobody is bound.
struct MemoryLimits {
  std::uint64_t all_bytes = 0;
  std::uint64_t gate_bytes = 0;  ///< for jobs and requests: without the process itself
  std::uint64_t scene_cache_bytes = 0;
  std::uint64_t film_cache_bytes = 0;
};
/// usable_bytes: as usable_memory_bytes() gives it.
MemoryLimits memory_limits(const Config& config, std::uint64_t usable_bytes);
/// config and memory: limits that the operator chose. isa: as core::resolve_isa() gives it.
api::ServerView about_server(const Config& config, const MemoryLimits& memory,
                             const std::string& isa);

}  // namespace server
