// What jobs hold in memory, and how paused ones give it back.
#include <gtest/gtest.h>

#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::JobPointer;
using test_support::kForever;
class JobsMemory : public test_support::JobsFixture {};

/// Paused jobs in memory beside one that runs: with room for one film, every start parks another
/// job.
TEST_F(JobsMemory, PausedJobsGiveTheirMemoryToOthersAndEndTheSame) {
  std::vector<std::string> undisturbed;
  for (int seed = 1; seed <= 3; ++seed) {
    const auto job = submit(200, R"(, "seed": )" + std::to_string(seed));
    ASSERT_TRUE(wait_for(job, JobState::kFinished));
    undisturbed.push_back(jobs->view(*job).film_digest);
  }
  const std::uint64_t scene_bytes =
      scenes->facts("cornell-box", server::Access::operators())->bytes;
  options.book.memory_max_bytes = (film_bytes() * 3 / 2 + scene_bytes) * 16 / 15;
  restart();
  std::vector<JobPointer> paused;
  for (int seed = 1; seed <= 3; ++seed) {
    const auto job = submit(200, R"(, "seed": )" + std::to_string(seed));
    ASSERT_TRUE(wait_for_samples(job)) << seed;
    ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
    EXPECT_LE(jobs->counts().held_bytes, options.book.memory_max_bytes);
    paused.push_back(job);
  }
  ASSERT_EQ(paused[2]->state(), JobState::kPaused);
  EXPECT_EQ(paused[0]->run(), nullptr);
  EXPECT_EQ(paused[1]->run(), nullptr);
  EXPECT_NE(paused[2]->run(), nullptr);
  // A parked job shows what it has.
  EXPECT_GE(jobs->view(*paused[0]).progress.samples_min, 2);
  const auto film = jobs->film(*paused[0]);
  ASSERT_TRUE(film) << film.error().message;
  for (std::size_t i = 0; i < paused.size(); ++i) {
    ASSERT_TRUE(
        jobs->patch(paused[i], R"({"paused": false})", std::nullopt, server::Access::operators()));
  }
  for (std::size_t i = 0; i < paused.size(); ++i) {
    ASSERT_TRUE(wait_for(paused[i], JobState::kFinished));
    EXPECT_EQ(jobs->view(*paused[i]).film_digest, undisturbed[i]);
  }
  EXPECT_EQ(jobs->counts().held_bytes, 0U);
}

TEST_F(JobsMemory, AFilmThatIsTooLargeForTheServerIsRefused) {
  const std::string before = submit(kForever)->id();
  options.book.memory_max_bytes = film_bytes();  // A part of it is for previews.
  restart();
  const auto found = jobs->find(before, server::Access::operators());
  ASSERT_TRUE(found);
  ASSERT_TRUE(wait_for(*found, JobState::kFailed));
  EXPECT_NE(jobs->view(**found).failure->detail.find("--memory"), std::string::npos);
  const auto refused = jobs->submit(request(8), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.problem().status, 422);
  ASSERT_EQ(refused.problem().errors.size(), 1U);
  EXPECT_EQ(refused.problem().errors[0].pointer, "/film");
}

}  // namespace
