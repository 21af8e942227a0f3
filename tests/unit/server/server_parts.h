/// What a server opens of its data directory, and the services below its jobs.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/jobs/job_service.h"
#include "server/observe/log.h"
#include "server/observe/memory_gate.h"
#include "server/observe/metrics.h"
#include "server/scenes/scene_service.h"
#include "server/store/assets.h"
#include "server/store/blob_store.h"
#include "server/store/data_dir.h"
#include "server/store/database.h"
#include "server/store/job_table.h"
#include "server/store/scene_table.h"
#include "server/store/storage_quota.h"

namespace test_support {

struct ServerParts {
  server::Log log{server::LogLevel::kOff};
  server::Metrics metrics;
  std::optional<server::DataDir> data;
  std::unique_ptr<server::Database> database;
  std::optional<server::BlobStore> blobs;
  std::optional<server::Assets> assets;
  std::optional<server::JobTable> table;
  std::optional<server::SceneTable> scene_table;
  std::optional<server::StorageQuota> quota;
  std::optional<server::MemoryGate> memory;
  std::optional<server::SceneService> scenes;

  /// Returns what failed; empty: nothing.
  std::string open(const std::string& path, const server::StorageLimits& limits = {}) {
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
    scene_table.emplace(*database);
    quota.emplace(*database, limits);
    return "";
  }
  /// memory_bytes: 0: unlimited. Pre: open.
  void load_scenes(std::uint64_t memory_bytes, const server::SceneServiceOptions& options = {}) {
    scenes.reset();
    memory.emplace(memory_bytes);
    scenes.emplace(*assets, *scene_table, *quota, *memory, options);
  }
  /// Pre: scenes are loaded.
  server::JobServiceParts of_jobs() {
    return {*table, *scenes, *data, log, metrics, *quota, *memory};
  }
  void close() {
    scenes.reset();
    memory.reset();
    quota.reset();
    scene_table.reset();
    table.reset();
    assets.reset();
    blobs.reset();
    database.reset();
    data.reset();
  }
};

}  // namespace test_support
