// Memory of jobs, and how paused jobs release it.
#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::JobPointer;
class JobsMemory : public test_support::JobsFixture {};

/// Paused jobs in memory and one that runs: with memory for one film, every start parks another
/// job.
TEST_F(JobsMemory, PausedJobsReleaseTheirMemoryAndEndTheSame) {
  std::vector<std::string> undisturbed;
  for (int seed = 1; seed <= 3; ++seed) {
    const auto job = submit(200, R"(, "seed": )" + std::to_string(seed));
    ASSERT_TRUE(wait_for(job, JobState::kFinished));
    undisturbed.push_back(jobs->view(*job).film_digest);
  }
  const std::uint64_t scene_bytes =
      scenes->facts("cornell-box", server::Access::operators())->bytes;
  // A job's memory in addition to its film is at most as much again (server/jobs/run_builder.cpp);
  // an eighth is for requests.
  memory_max_bytes = (film_bytes() * 3 + scene_bytes) * 8 / 7;
  restart();
  std::vector<JobPointer> paused;
  for (int seed = 1; seed <= 3; ++seed) {
    const auto job = submit(200, R"(, "seed": )" + std::to_string(seed));
    ASSERT_TRUE(wait_for_samples(job)) << seed;
    ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
    EXPECT_LE(jobs->counts().held_bytes, memory_max_bytes);
    paused.push_back(job);
  }
  ASSERT_EQ(paused[2]->state(), JobState::kPaused);
  EXPECT_EQ(paused[0]->run(), nullptr);
  EXPECT_EQ(paused[1]->run(), nullptr);
  EXPECT_NE(paused[2]->run(), nullptr);
  // A parked job shows its progress.
  EXPECT_GE(jobs->view(*paused[0]).progress.samples_min, 2);
  const auto film = jobs->films().film(*paused[0]);
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

TEST_F(JobsMemory, DryRunReportsTheAdmittedMemory) {
  // A film of 4 MB; the scene is negligible, loaded or not.
  const std::string film = R"(, "film": {"width": 256, "height": 256})";
  const auto parsed = api::parse_job(R"({"scene": "cornell-box")" + film + "}");
  ASSERT_TRUE(parsed);
  const auto cost = jobs->estimate(parsed->spec, "", {});
  ASSERT_TRUE(cost) << cost.error().message;
  memory_max_bytes = static_cast<std::uint64_t>(cost->memory_bytes_high * 8 / 7) + 8;
  restart();
  const auto submitted = jobs->submit(*parsed, {});
  ASSERT_TRUE(submitted) << submitted.problem().detail;
  ASSERT_TRUE(wait_for_samples(submitted->job));
  EXPECT_EQ(static_cast<double>(jobs->counts().held_bytes), cost->memory_bytes_high);
  memory_max_bytes -= 64;
  restart();
  EXPECT_FALSE(jobs->submit(*parsed, {}));
}

TEST_F(JobsMemory, AutomaticIntegratorIsAdmittedWithTheMemoryOfAnyCandidate) {
  const auto bytes_of = [this](std::string_view integrator, const std::string& stop) {
    const auto parsed =
        api::parse_job(R"({"scene": "cornell-box", "film": {"width": 128, "height": 96},
                                          "integrator": {"max_depth": 256, "type": ")" +
                       std::string(integrator) + R"("}, "stop": )" + stop + "}");
    EXPECT_TRUE(parsed);
    const auto cost = jobs->estimate(parsed->spec, "", {});
    EXPECT_TRUE(cost) << cost.error().message;
    return cost->memory_bytes_high;
  };
  core::RenderSettings automatic;
  automatic.integrator = core::kAutomaticIntegrator;
  for (const bool has_target : {false, true}) {
    const std::string stop = has_target ? R"({"relative_error": 0.1})" : R"({"seconds": 1})";
    const double admitted = bytes_of(core::kAutomaticIntegrator, stop);
    for (const auto name : core::candidates_of(automatic, has_target)) {
      EXPECT_GE(admitted, bytes_of(name, stop)) << name;
    }
  }
}

TEST_F(JobsMemory, RefusesAFilmTooLargeForTheServer) {
  const auto parsed =
      api::parse_job(R"({"scene": "cornell-box", "film": {"width": 256, "height": 256},
                         "stop": {"samples_per_pixel": 65536}})");
  ASSERT_TRUE(parsed);
  const auto before = jobs->submit(*parsed, {});
  ASSERT_TRUE(before) << before.problem().detail;
  api::JobView view;
  view.spec = parsed->spec;
  memory_max_bytes = server::blank_film(view)->bytes();  // an eighth of it is for requests
  const std::string id = before->job->id();
  restart();
  const auto found = jobs->find(id, server::Access::operators());
  ASSERT_TRUE(found);
  ASSERT_TRUE(wait_for(*found, JobState::kFailed));
  EXPECT_NE(jobs->view(**found).failure->detail.find("--memory"), std::string::npos);
  const auto refused = jobs->submit(*parsed, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.problem().status, 413);
  ASSERT_EQ(refused.problem().errors.size(), 1U);
  EXPECT_EQ(refused.problem().errors[0].pointer, "/film");
}

}  // namespace
