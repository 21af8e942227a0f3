/// The jobs of a server without HTTP.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "server/jobs/job_service.h"
#include "server/store/database.h"
#include "tests/unit/server/server_test_support.h"

namespace test_support {

/// A server without HTTP; restart() acts like a new process.
class JobsFixture : public testing::Test {
 protected:
  void SetUp() override { start(); }
  void TearDown() override { halt(); }

  void start() {
    auto opened_data = server::DataDir::open(folder.file("data"));
    ASSERT_TRUE(opened_data) << opened_data.error().message;
    data = std::make_unique<server::DataDir>(std::move(*opened_data));
    auto opened = server::Database::open(data->database_path());
    ASSERT_TRUE(opened);
    database = std::move(*opened);
    auto store = server::BlobStore::open(data->assets_path());
    ASSERT_TRUE(store);
    blobs = std::make_unique<server::BlobStore>(std::move(*store));
    table = std::make_unique<server::JobTable>(*database);
    scene_table = std::make_unique<server::SceneTable>(*database);
    quota = std::make_unique<server::StorageQuota>(*database, storage);
    assets = std::make_unique<server::Assets>(*database, *blobs);
    memory = std::make_unique<server::MemoryGate>(memory_max_bytes);
    scenes = std::make_unique<server::SceneService>(*assets, *scene_table, *quota, *memory,
                                                    scene_options);
    const auto run = table->next_run();
    ASSERT_TRUE(run);
    jobs = std::make_unique<server::JobService>(
        server::JobServiceParts{*table, *scenes, *data, log, metrics, *quota, *memory}, options,
        *run);
    ASSERT_TRUE(jobs->resume());
  }
  void halt() {
    jobs.reset();
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
  void restart() {
    halt();
    start();
  }

  static api::ParsedJob request(int samples, const std::string& more = "") {
    auto parsed =
        api::parse_job(R"({"scene": "cornell-box", "film": {"width": 64, "height": 40})" + more +
                       R"(, "stop": {"samples_per_pixel": )" + std::to_string(samples) + "}}");
    EXPECT_TRUE(parsed) << parsed.problem().detail;
    return *std::move(parsed);
  }
  server::JobPointer submit(int samples, const std::string& more = "") {
    auto submitted = jobs->submit(request(samples, more), {});
    EXPECT_TRUE(submitted) << submitted.problem().detail;
    return submitted->job;
  }
  static bool wait_for(const server::JobPointer& job,
                       const std::function<bool(api::JobState)>& wanted) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!wanted(job->state()) && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return wanted(job->state());
  }
  static bool wait_for(const server::JobPointer& job, api::JobState state) {
    return wait_for(job, [state](api::JobState now) { return now == state; });
  }
  bool wait_for_samples(const server::JobPointer& job) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (jobs->view(*job).progress.samples_min < 2 &&
           std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return jobs->view(*job).progress.samples_min >= 2;
  }

  static std::uint64_t film_bytes() {
    api::JobView view;
    view.spec = request(8).spec;
    return server::blank_film(view)->bytes();
  }

  static bool wait_until(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }

  TemporaryFolder folder;
  server::Log log{server::LogLevel::kOff};
  server::Metrics metrics;
  server::JobServiceOptions options = [] {
    server::JobServiceOptions made;
    made.threads = 2;
    made.checkpoint_seconds = 0.1;
    return made;
  }();
  std::unique_ptr<server::DataDir> data;
  std::unique_ptr<server::Database> database;
  std::unique_ptr<server::BlobStore> blobs;
  std::unique_ptr<server::Assets> assets;
  std::unique_ptr<server::JobTable> table;
  std::unique_ptr<server::SceneTable> scene_table;
  server::StorageLimits storage;
  server::SceneServiceOptions scene_options;
  std::unique_ptr<server::StorageQuota> quota;
  std::uint64_t memory_max_bytes = 0;
  std::unique_ptr<server::MemoryGate> memory;
  std::unique_ptr<server::SceneService> scenes;
  std::unique_ptr<server::JobService> jobs;
};

inline constexpr int kForever = 65536;  ///< samples

}  // namespace test_support
