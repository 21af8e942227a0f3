/// The jobs of a server without HTTP.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/unit/server/server_parts.h"
#include "tests/unit/server/server_test_support.h"

namespace test_support {

/// A server without HTTP; restart() acts like a new process.
class JobsFixture : public testing::Test, protected ServerParts {
 protected:
  void SetUp() override { start(); }
  void TearDown() override { halt(); }

  void start() {
    ASSERT_EQ(open(folder.file("data"), storage), "");
    load_scenes(memory_max_bytes, scene_options);
    const auto run = table->next_run();
    ASSERT_TRUE(run);
    jobs = std::make_unique<server::JobService>(of_jobs(), options, *run);
    ASSERT_TRUE(jobs->resume());
  }
  void halt() {
    jobs.reset();
    close();
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
  server::JobServiceOptions options = [] {
    server::JobServiceOptions made;
    made.threads = 2;
    made.checkpoint_seconds = 0.1;
    return made;
  }();
  server::StorageLimits storage;
  server::SceneServiceOptions scene_options;
  std::uint64_t memory_max_bytes = 0;
  std::unique_ptr<server::JobService> jobs;
};

inline constexpr int kForever = 65536;  ///< samples

}  // namespace test_support
