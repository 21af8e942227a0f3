// Jobs that are parked, or yield their places, while others wait for memory or a slot.

#include <chrono>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "server/store/film_file.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::Access;
using server::JobPointer;
using test_support::kForever;

class ParkedJobs : public test_support::JobsFixture {
 protected:
  void SetUp() override {
    options.checkpoint_seconds = 1000;  // None during a test.
    JobsFixture::SetUp();
  }
  static api::ParsedJob large_request(const std::string& scene) {
    const std::string film = R"({"width": 512, "height": 384, "layers": []})";
    auto parsed =
        api::parse_job(R"({"scene": ")" + scene + R"(", "film": )" + film +
                       R"(, "stop": {"samples_per_pixel": )" + std::to_string(kForever) + "}}");
    EXPECT_TRUE(parsed);
    return *std::move(parsed);
  }
  JobPointer submit_large(const std::string& scene = "cornell-box") {
    auto submitted = jobs->submit(large_request(scene), {});
    EXPECT_TRUE(submitted) << submitted.problem().detail;
    return submitted->job;
  }
  /// Restarts with memory for one large job, but not for two.
  void restart_with_little_memory() {
    api::JobView view;
    view.spec = large_request("cornell-box").spec;
    constexpr std::uint64_t kWorkBytes = 4 << 20U;  // As in run_builder.cpp.
    // Seven eighths of it are for jobs.
    memory_max_bytes = (server::blank_film(view)->bytes() + kWorkBytes) * 3 / 2 * 8 / 7;
    restart();
  }
  void set_paused(const JobPointer& job, bool paused) {
    EXPECT_TRUE(jobs->patch(job, paused ? R"({"paused": true})" : R"({"paused": false})",
                            std::nullopt, Access::operators()));
  }
};

TEST_F(ParkedJobs, TheRecordIsNotAheadOfTheFilm) {
  options.book.running_max = 1;
  restart();
  const JobPointer job = submit_large();
  ASSERT_TRUE(wait_for_samples(job));
  const JobPointer next = submit_large();
  ASSERT_TRUE(wait_for(job, JobState::kQueued));
  const api::JobView view = job->record().view;
  const auto film = server::blank_film(view);
  auto file = server::FilmFile::open(data->film_path(job->id()));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->restore(*film));
  EXPECT_GE(film->sample_counts().mean, view.progress.samples_mean);
  EXPECT_GE(view.progress.samples_min, 2);
}

TEST_F(ParkedJobs, APausedJobThatIsResumedBeforeItIsParkedKeepsItsPlace) {
  restart_with_little_memory();
  const JobPointer job = submit_large();
  const JobPointer others[] = {submit(kForever), submit(kForever)};
  ASSERT_TRUE(wait_for_samples(job));
  ASSERT_TRUE(wait_for_samples(others[0]));
  ASSERT_TRUE(wait_for_samples(others[1]));
  JobPointer waiting;
  {
    // Both threads that save films wait for these.
    const core::MutexLock first(others[0]->change_mutex());
    const core::MutexLock second(others[1]->change_mutex());
    for (const JobPointer& other : others) {
      other->run()->fail(core::Error{core::ErrorCode::kInternal, "broken", ""});
    }
    set_paused(job, true);
    waiting = submit_large("interior");  // The job is to be parked for it.
    set_paused(job, false);
  }
  ASSERT_TRUE(wait_for(others[0], JobState::kFailed));
  ASSERT_TRUE(wait_for(others[1], JobState::kFailed));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(job->state(), JobState::kRendering);
  EXPECT_EQ(waiting->state(), JobState::kQueued);
}

}  // namespace
