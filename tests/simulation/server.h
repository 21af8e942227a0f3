/// The server without HTTP: the objects that server/app.cpp makes of the store, the jobs and what
/// reads them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/auth/key_ring.h"
#include "server/config/live_config.h"
#include "server/http/stream_gate.h"
#include "server/jobs/denoise_service.h"
#include "server/jobs/job_service.h"
#include "server/jobs/tile_frames.h"
#include "server/observe/log.h"
#include "server/observe/memory_gate.h"
#include "server/observe/metrics.h"
#include "server/scenes/scene_service.h"
#include "server/store/assets.h"
#include "server/store/blob_store.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/job_table.h"
#include "server/store/key_table.h"
#include "server/store/scene_table.h"
#include "server/store/storage_quota.h"
#include "tests/simulation/broker.h"
#include "tests/simulation/comparisons.h"
#include "tests/simulation/workers.h"

namespace simulation {

inline constexpr int kTenants = 4;
/// Each tenant's newest comparison is always kept: those with several lose theirs first.
inline constexpr int kComparisons = 2 * kTenants;

struct Server {
  server::Log log{server::LogLevel::kOff};
  server::Metrics metrics;
  std::optional<server::DataDir> data;
  std::unique_ptr<server::Database> database;
  std::optional<server::BlobStore> blobs;
  std::optional<server::Assets> assets;
  std::optional<server::JobTable> table;
  std::optional<server::KeyTable> key_table;
  server::LiveConfig config{server::Config{}};
  std::optional<server::KeyRing> keys;
  std::optional<server::SceneTable> scene_table;
  std::optional<server::StorageQuota> quota;
  std::optional<server::MemoryGate> memory;
  std::optional<server::SceneService> scenes;
  std::optional<server::JobService> jobs;
  std::optional<server::DenoiseService> denoising;
  server::TileFrames frames;
  server::StreamGate streams{kTenants};
  std::optional<Comparisons> comparisons;
  std::int64_t run = 0;

  /// Opens the data directory. Returns what failed; empty: nothing.
  std::string open(const std::string& path) {
    auto opened_data = server::DataDir::open(path);
    if (!opened_data) {
      return opened_data.error().message;
    }
    data.emplace(*std::move(opened_data));
    auto opened = server::Database::open(data->database_path());
    if (!opened) {
      return opened.error().message;
    }
    database = *std::move(opened);
    auto store = server::BlobStore::open(data->assets_path());
    if (!store) {
      return store.error().message;
    }
    blobs.emplace(*std::move(store));
    assets.emplace(*database, *blobs);
    table.emplace(*database);
    key_table.emplace(*database);
    scene_table.emplace(*database);
    quota.emplace(*database, server::StorageLimits{});
    return "";
  }

  /// Resumes the jobs, likewise. workers: their seed; empty: there are none.
  std::string start(std::uint64_t memory_bytes, std::optional<std::uint64_t> workers) {
    memory.emplace(memory_bytes);
    scenes.emplace(*assets, *scene_table, *quota, *memory, server::SceneServiceOptions{});
    const auto number = table->next_run();
    if (!number) {
      return number.error().message;
    }
    run = *number;
    server::JobServiceOptions options;
    options.threads = 2;
    options.book.running_max = 3;
    if (workers) {
      options.queue = start_broker(*workers);
      options.work = Workers::options(*workers);
      options.render_threads = options.work.has_local_threads ? 1 : 0;
    }
    jobs.emplace(server::JobServiceParts{*table, *scenes, *data, log, metrics, *quota, *memory},
                 options, run);
    denoising.emplace(*jobs, *memory, log);
    comparisons.emplace(*database, *data, kComparisons);
    const auto resumed = jobs->resume();
    return resumed ? "" : resumed.error().message;
  }
};

}  // namespace simulation
