#include "server/config/about.h"

#include <algorithm>
#include <limits>

#include "core/accel/accel.h"
#include "core/accel/arithmetic.h"
#include "core/base/build_id.h"
#include "core/image_io/image_io.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_schema.h"
#include "core/wave/wave_tracer.h"
#include "server/config/url_limits.h"
#include "server/http/http_server.h"
#include "server/store/files.h"

namespace server {
namespace {

std::string compiler_name() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

/// Assumed if the machine's memory is unknown.
constexpr std::uint64_t kUsualMemory = std::uint64_t{8} << 30U;
/// Memory of the process besides what the gate accounts for: code, threads, connections, the store.
/// Resident before any request: 82 MB of code and libraries, and 33 MB of other memory. Some 20 MB
/// more once everything has been used, and 4 MB of encoded tiles.
constexpr std::uint64_t kProcessBytes = std::uint64_t{144} << 20U;

std::uint64_t percent_of(std::uint64_t whole, double percent) {
  return static_cast<std::uint64_t>(static_cast<double>(whole) * percent / 100);
}

std::uint64_t bytes_of(const Share& share, std::uint64_t whole) {
  return share.percent > 0 ? percent_of(whole, share.percent) : share.bytes;
}

}  // namespace

std::string program_version() { return TESSERA_VERSION; }

MemoryLimits memory_limits(const Config& config, std::uint64_t usable_bytes) {
  const std::uint64_t whole = usable_bytes > 0 ? usable_bytes : kUsualMemory;
  const std::uint64_t most = bytes_of(config.memory, usable_bytes);
  // Caches are part of the limit, and each takes at most a quarter.
  const std::uint64_t cache_max = most > 0 ? most / 4 : std::numeric_limits<std::uint64_t>::max();
  return {.all_bytes = most,
          .gate_bytes = most - std::min(most / 2, kProcessBytes),
          .scene_cache_bytes = std::min(bytes_of(config.scene_cache, whole), cache_max),
          .film_cache_bytes = std::min(bytes_of(config.film_cache, whole), cache_max)};
}

StorageLimits storage_limits(const Config& config) {
  const auto space = disk_space(config.data_dir);
  const std::uint64_t disk_bytes = space ? space->total_bytes : 0;
  const std::uint64_t total_bytes = bytes_of(config.disk_limit, disk_bytes);
  return {
      .total_bytes = total_bytes,
      .tenant_bytes = bytes_of(config.quota_storage, total_bytes > 0 ? total_bytes : disk_bytes)};
}

api::ServerView about_server(const Config& config, const MemoryLimits& memory,
                             const std::string& isa) {
  const StorageLimits storage = storage_limits(config);
  api::ServerView about;
  about.version = program_version();
  about.build.commit = TESSERA_COMMIT;
  about.build.id = core::linker_build_id();
  if (about.build.id.empty()) {
    about.build.id = about.build.commit;
  }
  about.build.compiler = compiler_name();
  about.build.isa = isa;
  about.build.arithmetic = core::arithmetic_class(isa);
  about.build.embree = core::embree_version();
  about.build.waves = core::waves_serve(isa);
  for (const core::BuiltinScene& scene : core::builtin_scenes()) {
    about.capabilities.scenes.push_back({std::string(scene.name), std::string(scene.summary)});
  }
  for (const core::ImageFormat& format : core::image_formats()) {
    about.capabilities.image_formats.push_back(
        {std::string(format.extension), std::string(format.mime)});
  }
  for (const core::ToneMapEntry& entry : core::tone_maps()) {
    about.capabilities.tone_maps.emplace_back(entry.name);
  }
  const auto extensions = core::supported_extensions();
  about.capabilities.extensions.assign(extensions.begin(), extensions.end());
  about.limits = {
      {"queue_jobs", config.queue_max},
      {"running_jobs", config.running_max},
      {"streams", config.streams_max},
      {"waiting_connections", HttpLimits().max_waiting},
      {"waiting_connections_of_an_address", HttpLimits().max_waiting_of_address},
      {"requests_at_a_time_of_a_client", HttpLimits().max_requests_of_client},
      {"lab_runs", config.lab_runs_max},
      {"samples_per_job", config.samples_max},
      {"upload_bytes", static_cast<std::int64_t>(config.upload_bytes_max)},
      {"memory_bytes_of_jobs", static_cast<std::int64_t>(memory.all_bytes)},
      {"scene_cache_bytes", static_cast<std::int64_t>(memory.scene_cache_bytes)},
      {"requests_per_minute_of_a_key", config.rate_limit},
      {"retention_seconds_of_the_server", config.retention_seconds},
      {"ended_jobs", config.ended_max},
      {"unfinished_jobs_of_a_key", config.quota_jobs},
      {"url_jobs_of_a_key", url_jobs_of_tenant(config)},
      {"url_jobs_of_a_preset", kUrlJobsOfPreset},
      {"previews_of_a_key", config.quota_previews},
      {"streams_of_a_key", config.quota_streams},
      {"lab_runs_of_a_key", config.quota_lab_runs},
      {"stored_bytes", static_cast<std::int64_t>(storage.total_bytes)},
      {"stored_bytes_of_a_key", static_cast<std::int64_t>(storage.tenant_bytes)},
      {"film_cache_bytes", static_cast<std::int64_t>(memory.film_cache_bytes)},
  };
  return about;
}

}  // namespace server
