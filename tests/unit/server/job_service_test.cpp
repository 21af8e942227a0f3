#include "server/jobs/job_service.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/json/error_codes.h"
#include "core/integrators/registry.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::Access;
using server::JobPointer;
using server::JobService;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

using test_support::kForever;
class Jobs : public test_support::JobsFixture {};

TEST_F(Jobs, JobFinishesWithItsDigestAndItsFilm) {
  const auto job = submit(8);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  const api::JobView view = jobs->view(*job);
  EXPECT_EQ(view.stop_reason, core::StopReason::kSamples);
  EXPECT_EQ(view.progress.samples_min, 8);
  EXPECT_EQ(view.progress.fraction, 1.0);
  EXPECT_EQ(view.film_digest.size(), 64U);
  const auto film = jobs->films().film(*job);
  ASSERT_TRUE(film);
  EXPECT_EQ((*film)->digest(), view.film_digest);
  EXPECT_FALSE(jobs->films().points(*job).empty());
}

TEST_F(Jobs, SameJobGivesTheSameDigest) {
  const auto first = submit(8);
  const auto second = submit(8);
  ASSERT_TRUE(wait_for(first, JobState::kFinished));
  ASSERT_TRUE(wait_for(second, JobState::kFinished));
  EXPECT_EQ(jobs->view(*first).film_digest, jobs->view(*second).film_digest);
}

TEST_F(Jobs, RetriesAFailedJobFromItsCheckpoint) {
  const auto whole = submit(2048);
  ASSERT_TRUE(wait_for(whole, JobState::kFinished));
  const std::string digest = jobs->view(*whole).film_digest;
  EXPECT_EQ(jobs->retry(whole).problem().status, 409);
  const std::string id = submit(2048, R"(, "name": "failed")")->id();
  ASSERT_TRUE(wait_for_samples(*jobs->find(id, Access::operators())));
  halt();
  memory_max_bytes = film_bytes() / 2;
  start();
  auto job = *jobs->find(id, Access::operators());
  ASSERT_TRUE(wait_for(job, JobState::kFailed));
  const double elapsed = jobs->view(*job).progress.elapsed_seconds;
  EXPECT_GT(elapsed, 0);
  memory_max_bytes = 0;
  restart();
  job = *jobs->find(id, Access::operators());
  const auto retried = jobs->retry(job);
  ASSERT_TRUE(retried) << retried.problem().detail;
  EXPECT_FALSE(jobs->view(*job).failure);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  EXPECT_EQ(jobs->view(*job).film_digest, digest);
  EXPECT_GE(jobs->view(*job).progress.elapsed_seconds, elapsed);
}

TEST_F(Jobs, ReportsADamagedFilmOfAFinishedJobOnceWithoutRenderingAgain) {
  const std::string id = submit(8)->id();
  ASSERT_TRUE(wait_for(*jobs->find(id, Access::operators()), JobState::kFinished));
  halt();
  const std::string path = folder.file("data/films/" + id + ".film");
  test_support::write_file(path, std::string(100000, 'x'));
  start();
  const auto job = *jobs->find(id, Access::operators());
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(jobs->films().film(*job).error().code, api::kGone);
  }
  EXPECT_EQ(jobs->extend(job, R"({"stop": {"samples_per_pixel": 16}})").problem().status, 409);
  const auto told = [](const api::JobView& view) {
    return std::count_if(view.warnings.begin(), view.warnings.end(), [](const std::string& each) {
      return each.find("damaged") != std::string::npos;
    });
  };
  EXPECT_EQ(told(jobs->view(*job)), 1);
  EXPECT_EQ(job->state(), JobState::kFinished);
  restart();
  EXPECT_EQ(told(jobs->view(**jobs->find(id, Access::operators()))), 1);
  EXPECT_EQ(std::filesystem::file_size(path), 100000U);
}

TEST_F(Jobs, ForgetsEndedJobsBeyondTheRetention) {
  options.retention.count = 2;
  restart();
  std::vector<std::string> ids;
  for (int i = 0; i < 4; ++i) {
    ids.push_back(submit(4)->id());
    ASSERT_TRUE(wait_for(*jobs->find(ids.back(), Access::operators()), JobState::kFinished));
  }
  const auto is_there = [&](const std::string& id) {
    return jobs->find(id, Access::operators()).has_value();
  };
  EXPECT_TRUE(wait_until([&] { return !is_there(ids[0]) && !is_there(ids[1]); }));
  EXPECT_TRUE(is_there(ids[2]));
  EXPECT_TRUE(is_there(ids[3]));
  options.retention = {.seconds = 0.001};
  restart();
  EXPECT_TRUE(wait_until([&] { return !is_there(ids[2]) && !is_there(ids[3]); }));
}

TEST_F(Jobs, ResumedByAnotherBuildWarnsOnceThatTheFilmHoldsSamplesOfTwo) {
  options.build = R"({"id": "aaaa"})";
  restart();
  const std::string id = submit(2048)->id();
  ASSERT_TRUE(wait_for_samples(*jobs->find(id, Access::operators())));
  const auto warnings = [&] {
    const api::JobView view = jobs->view(**jobs->find(id, Access::operators()));
    return std::count_if(
        view.warnings.begin(), view.warnings.end(), [](const std::string& warning) {
          return warning.find("begun by build aaaa and continues with build bbbb") !=
                 std::string::npos;
        });
  };
  restart();
  ASSERT_TRUE(wait_for(*jobs->find(id, Access::operators()), JobState::kRendering));
  EXPECT_EQ(warnings(), 0);
  options.build = R"({"id": "bbbb"})";
  for (int i = 0; i < 2; ++i) {
    restart();
    ASSERT_TRUE(wait_for(*jobs->find(id, Access::operators()), JobState::kRendering));
    EXPECT_EQ(warnings(), 1);
  }
  ASSERT_TRUE(wait_for(*jobs->find(id, Access::operators()), JobState::kFinished));
  EXPECT_EQ(warnings(), 1);
}

TEST_F(Jobs, StartsNoJobWhileDrainingAndFinishesRunningOnes) {
  options.book.running_max = 1;
  restart();
  const auto running = submit(512, R"(, "priority": 1)");
  const auto waiting = submit(8);
  ASSERT_TRUE(wait_for_samples(running));
  jobs->set_draining(true);
  EXPECT_EQ(jobs->submit(request(8), {}).problem().status, 503);
  ASSERT_TRUE(wait_for(running, JobState::kFinished));
  EXPECT_TRUE(wait_until([&] { return jobs->drain().running == 0; }));
  EXPECT_EQ(waiting->state(), JobState::kQueued);
  EXPECT_EQ(jobs->drain().queued, 1);
  jobs->set_draining(false);
  EXPECT_TRUE(wait_for(waiting, JobState::kFinished));
  EXPECT_TRUE(jobs->submit(request(8), {}));
}

TEST_F(Jobs, FinishedJobOutlivesTheProcess) {
  const auto job = submit(8);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  const api::JobView before = jobs->view(*job);
  const std::string id = job->id();
  restart();
  const auto found = jobs->find(id, Access::operators());
  ASSERT_TRUE(found);
  const api::JobView after = jobs->view(**found);
  EXPECT_EQ(after.state, JobState::kFinished);
  EXPECT_EQ(after.film_digest, before.film_digest);
  EXPECT_EQ(after.progress.rays, before.progress.rays);
  EXPECT_EQ(after.progress.error.relative, before.progress.error.relative);
  EXPECT_EQ((*jobs->films().film(**found))->digest(), before.film_digest);
  EXPECT_TRUE((*found)->end_mark());
}

TEST_F(Jobs, InterruptedJobEndsBitForBitTheSame) {
  const auto whole = submit(256);
  ASSERT_TRUE(wait_for(whole, JobState::kFinished));
  const std::string digest = jobs->view(*whole).film_digest;
  const auto job = submit(256, R"(, "name": "interrupted")");
  const std::string id = job->id();
  ASSERT_TRUE(wait_for_samples(job));
  restart();
  const auto resumed = jobs->find(id, Access::operators());
  ASSERT_TRUE(resumed);
  ASSERT_TRUE(wait_for(*resumed, JobState::kFinished));
  EXPECT_EQ(jobs->view(**resumed).film_digest, digest);
}

TEST_F(Jobs, CancelledJobKeepsItsImage) {
  const auto job = submit(kForever);
  ASSERT_TRUE(wait_for_samples(job));
  ASSERT_TRUE(jobs->cancel(job));
  EXPECT_EQ(job->state(), JobState::kCancelled);
  EXPECT_EQ(jobs->view(*job).stop_reason, core::StopReason::kCancelled);
  EXPECT_LT(jobs->view(*job).progress.fraction, 1.0);
  EXPECT_TRUE(jobs->cancel(job));  // cancelling twice is not an error
  const std::string id = job->id();
  restart();
  const auto found = jobs->find(id, Access::operators());
  ASSERT_TRUE(found);
  EXPECT_EQ((*found)->state(), JobState::kCancelled);
  EXPECT_TRUE(jobs->films().film(**found));
}

TEST_F(Jobs, PausedJobStopsAndResumes) {
  const auto job = submit(kForever);
  ASSERT_TRUE(wait_for_samples(job));
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
  EXPECT_EQ(job->state(), JobState::kPaused);
  std::this_thread::sleep_for(milliseconds(100));
  const auto revision = jobs->view(*job).progress.revision;
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_EQ(jobs->view(*job).progress.revision, revision);
  ASSERT_TRUE(jobs->patch(job, R"({"paused": false, "stop": {"samples_per_pixel": 64}})",
                          std::nullopt, server::Access::operators()));
  EXPECT_TRUE(wait_for(job, JobState::kFinished));
}

TEST_F(Jobs, PausedJobIsPausedAfterARestartAndResumesToTheSameFilm) {
  const auto whole = submit(128);
  ASSERT_TRUE(wait_for(whole, JobState::kFinished));
  const std::string digest = jobs->view(*whole).film_digest;
  const auto job = submit(128, R"(, "name": "paused")");
  const std::string id = job->id();
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
  restart();
  auto found = jobs->find(id, Access::operators());
  ASSERT_TRUE(found);
  EXPECT_EQ((*found)->state(), JobState::kPaused);
  ASSERT_TRUE(
      jobs->patch(*found, R"({"paused": false})", std::nullopt, server::Access::operators()));
  ASSERT_TRUE(wait_for(*found, JobState::kFinished));
  EXPECT_EQ(jobs->view(**found).film_digest, digest);
}

TEST_F(Jobs, TextOfTheSpecFollowsItsChanges) {
  const auto job = submit(kForever);
  const auto before = job->spec_text();
  EXPECT_EQ(before.version, 1U);
  EXPECT_EQ(*before.text, api::spec_json(jobs->view(*job).spec));
  ASSERT_TRUE(jobs->patch(job, R"({"priority": 5})", std::nullopt, Access::operators()));
  const auto after = job->spec_text();
  EXPECT_EQ(after.version, 2U);
  EXPECT_EQ(*after.text, api::spec_json(jobs->view(*job).spec));
  EXPECT_NE(*after.text, *before.text);
}

TEST_F(Jobs, PatchChecksItsVersion) {
  const auto job = submit(kForever);
  EXPECT_EQ(jobs->view(*job).spec_version, 1U);
  ASSERT_TRUE(jobs->patch(job, R"({"priority": 5})", std::vector<std::uint32_t>{7, 1},
                          Access::operators()));
  EXPECT_EQ(jobs->view(*job).spec_version, 2U);
  EXPECT_EQ(
      jobs->patch(job, R"({"priority": 6})", std::vector<std::uint32_t>{7, 1}, Access::operators())
          .problem()
          .status,
      412);
  ASSERT_TRUE(jobs->cancel(job));
  EXPECT_EQ(
      jobs->patch(job, R"({"stop": {"seconds": 1}})", std::nullopt, server::Access::operators())
          .problem()
          .status,
      409);
  EXPECT_TRUE(
      jobs->patch(job, R"({"labels": {"a": "b"}})", std::nullopt, server::Access::operators()));
}

TEST_F(Jobs, ExtensionGivesTheFilmOfALongerJob) {
  const auto whole = submit(64);
  ASSERT_TRUE(wait_for(whole, JobState::kFinished));
  const auto job = submit(16);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  EXPECT_EQ(jobs->extend(job, R"({"stop": {"samples_per_pixel": 16}})").problem().status, 422);
  ASSERT_TRUE(jobs->extend(job, R"({"stop": {"samples_per_pixel": 64}})"));
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  EXPECT_EQ(jobs->view(*job).film_digest, jobs->view(*whole).film_digest);
}

TEST_F(Jobs, OneKeyGivesOneJob) {
  const JobService::Submission key{.key = "k", .body_hash = "h"};
  const auto first = jobs->submit(request(8), key);
  ASSERT_TRUE(first);
  const auto second = jobs->submit(request(8), key);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->is_replay);
  EXPECT_EQ(second->job, first->job);
  EXPECT_EQ(jobs->submit(request(16), {.key = "k", .body_hash = "other"}).problem().status, 409);
  const std::string id = first->job->id();
  restart();
  const auto third = jobs->submit(request(8), key);
  ASSERT_TRUE(third);
  EXPECT_EQ(third->job->id(), id);
}

TEST_F(Jobs, NextPreviewOfAKeySupersedesThePreviousOne) {
  const std::string preview = R"(, "class": "preview", "preview_key": "orbit")";
  const auto first = submit(kForever, preview);
  const auto second = submit(8, preview);
  EXPECT_TRUE(wait_for(first, JobState::kCancelled));
  EXPECT_TRUE(wait_for(second, JobState::kFinished));
  EXPECT_TRUE(jobs->films().film(*second));
  const std::string id = second->id();
  restart();
  EXPECT_EQ(jobs->find(id, Access::operators()).error().code, core::ErrorCode::kNotFound);
}

TEST_F(Jobs, DeletesOnlyFinalJobs) {
  const auto job = submit(kForever);
  EXPECT_EQ(jobs->remove(job).problem().status, 409);
  ASSERT_TRUE(jobs->cancel(job));
  ASSERT_TRUE(jobs->remove(job));
  EXPECT_EQ(jobs->find(job->id(), Access::operators()).error().code, core::ErrorCode::kNotFound);
}

TEST_F(Jobs, AJobThatTheListLacksIsNotFound) {
  const auto job = submit(8, R"(, "name": "listed")");
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  bool is_listed = true;
  bool is_found = true;
  std::thread reader([&] {  // Deleting removes the record first and the film last.
    while (is_listed) {
      const auto page = jobs->index().list({}, Access::operators());
      is_listed = page && !page->jobs.empty();
    }
    is_found = bool(jobs->find(job->id(), Access::operators()));
  });
  EXPECT_TRUE(jobs->remove(job));
  reader.join();
  EXPECT_FALSE(is_found);
}

TEST_F(Jobs, RendersADamagedFilmAgainToTheSameEnd) {
  const auto whole = submit(64);
  ASSERT_TRUE(wait_for(whole, JobState::kFinished));
  const std::string digest = jobs->view(*whole).film_digest;
  const auto job = submit(64, R"(, "name": "damaged")");
  const std::string id = job->id();
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, server::Access::operators()));
  halt();
  test_support::write_file(folder.file("data/films/" + id + ".film"), std::string(100000, 'x'));
  start();
  const auto found = jobs->find(id, Access::operators());
  ASSERT_TRUE(found);
  ASSERT_TRUE(
      jobs->patch(*found, R"({"paused": false})", std::nullopt, server::Access::operators()));
  ASSERT_TRUE(wait_for(*found, JobState::kFinished));
  EXPECT_EQ(jobs->view(**found).film_digest, digest);
  EXPECT_FALSE(jobs->view(**found).warnings.empty());
}

TEST_F(Jobs, EndedJobsWithSamplesOfALiarAreWarnedOfWhereverTheyAre) {
  const std::string kLiar = R"(a "liar" \ of course)";  // A worker's name may be any text.
  options.book.final_jobs_max = 2;
  restart();
  std::vector<std::string> ids;
  for (int i = 0; i < 6; ++i) {
    const auto job = submit(2);
    jobs->note_unverified(*job, i == 5 ? "honest" : kLiar);
    ASSERT_TRUE(wait_for(job, JobState::kFinished));
    ids.push_back(job->id());
  }
  const auto warnings = [&](const std::string& id) {
    const auto found = jobs->find(id, Access::operators());
    const auto all = found ? jobs->view(**found).warnings : std::vector<std::string>();
    return std::count_if(all.begin(), all.end(), [](const std::string& text) {
      return text.find("the image may be wrong") != std::string::npos;
    });
  };
  restart();
  jobs->distrust("\"of course\"");
  EXPECT_EQ(warnings(ids[0]), 0);
  jobs->distrust(kLiar);
  jobs->distrust(kLiar);
  restart();
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(warnings(ids[i]), 1);
  }
  EXPECT_EQ(warnings(ids[5]), 0);
}

TEST_F(Jobs, ADoubtedJobIsNotContinuedButRenderedAnewWhenItIsRetried) {
  options.book.running_max = 1;
  restart();
  const auto job = submit(8);
  jobs->note_unverified(*job, "liar");
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  const api::JobView before = jobs->view(*job);
  EXPECT_EQ(jobs->retry(job).problem().status, 409) << "nothing is known against it";
  jobs->distrust("liar");
  EXPECT_EQ(jobs->view(*job).state, JobState::kFinished) << "clients have its image";
  EXPECT_EQ(jobs->extend(job, R"({"stop": {"samples_per_pixel": 16}})").problem().status, 409);
  const auto busy = submit(kForever, R"(, "priority": 1)");
  ASSERT_TRUE(wait_for_samples(busy));
  ASSERT_TRUE(jobs->retry(job));
  EXPECT_EQ(jobs->view(*job).progress.samples_max, 0);
  EXPECT_FALSE(std::filesystem::exists(data->film_path(job->id())));
  EXPECT_EQ(jobs->view(*job).warnings, before.warnings);
  ASSERT_TRUE(jobs->cancel(busy));
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  EXPECT_EQ(jobs->view(*job).film_digest, before.film_digest);
}

TEST_F(Jobs, AFilmThatIsMergedWhileALiarIsFoundIsDoubted) {
  const auto job = submit(2);
  jobs->note_unverified(*job, "liar");
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  const auto film = jobs->films().final_film(*job, {});
  ASSERT_TRUE(film);
  JobService::FinishedFilm merged;
  merged.spec = job->record().view.spec;
  merged.film = *film;
  merged.unverified = job->record().unverified;
  const auto before = jobs->add_finished(merged);
  ASSERT_TRUE(before);
  jobs->distrust("liar");
  const auto after = jobs->add_finished(merged);
  ASSERT_TRUE(after);
  restart();
  const auto later = jobs->add_finished(merged);
  ASSERT_TRUE(later);
  for (const JobPointer& each : {*before, *after, *later}) {
    const auto found = jobs->find(each->id(), Access::operators());
    ASSERT_TRUE(found);
    EXPECT_TRUE(jobs->view(**found).is_doubted);
  }
}

// On a full disk a suspension can be stored, and a job's doubt only kept in memory.
TEST_F(Jobs, JobsOfASuspendedWorkerAreDoubtedWhenTheServerStartsAgain) {
  const auto job = submit(2);
  jobs->note_unverified(*job, "liar");
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  ASSERT_TRUE(server::WorkerTable(*database, 1).suspend("liar"));
  restart();
  const auto found = jobs->find(job->id(), Access::operators());
  ASSERT_TRUE(found);
  EXPECT_TRUE(wait_until([&] { return jobs->view(**found).is_doubted; }));
}

// A job that ends while it is listed is in one state in the store, and already in another for
// readers.
TEST_F(Jobs, AListShowsOnlyJobsInTheStatesThatItIsAskedFor) {
  const auto older = submit(2);
  ASSERT_TRUE(wait_for(older, JobState::kFinished));
  const auto job = submit(kForever);
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, Access::operators()));
  server::JobRecord ended = job->record();
  ended.view.state = JobState::kFinished;
  ASSERT_TRUE(table->update(server::to_row(ended), {}, {}));
  server::JobQuery query;
  query.states = {"finished"};
  query.limit = 1;
  const auto page = jobs->index().list(query, Access::operators());
  ASSERT_TRUE(page);
  EXPECT_TRUE(page->jobs.empty());
  ASSERT_TRUE(page->next);
  query.before = page->next;
  const auto rest = jobs->index().list(query, Access::operators());
  ASSERT_TRUE(rest);
  ASSERT_EQ(rest->jobs.size(), 1U);
  EXPECT_EQ(rest->jobs[0].id, older->id());
  EXPECT_FALSE(rest->next);
}

TEST_F(Jobs, ARequestByContentIsNotAnsweredWithADoubtedJob) {
  const JobService::Submission submission = {
      .key = "hash", .body_hash = "hash", .is_by_content = true};
  const auto first = jobs->submit(request(2), submission);
  ASSERT_TRUE(first);
  jobs->note_unverified(*first->job, "liar");
  ASSERT_TRUE(wait_for(first->job, JobState::kFinished));
  EXPECT_TRUE(jobs->submit(request(2), submission)->is_replay);
  jobs->distrust("liar");
  EXPECT_FALSE(jobs->submit(request(2), submission)->is_replay);
}

TEST_F(Jobs, AForgottenFilmThatTheProcessDidNotRemoveIsRemovedByTheNext) {
  const auto job = submit(8);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  server::JobRecord record = job->record();
  server::forget_samples(record);
  ASSERT_TRUE(jobs->films().announce_removal(*job));
  const std::string film = data->film_path(job->id());
  jobs->films().remove_all_loose();  // As resume() does.
  EXPECT_TRUE(std::filesystem::exists(film)) << "the change was not committed";
  ASSERT_TRUE(table->update(server::to_row(record), {}));
  jobs->films().remove_all_loose();
  EXPECT_FALSE(std::filesystem::exists(film));
}

TEST_F(Jobs, HasNoFilmWithoutASample) {
  options.book.running_max = 1;
  restart();
  const auto busy = submit(kForever, R"(, "priority": 5)");
  const auto waiting = submit(8);
  EXPECT_EQ(waiting->state(), JobState::kQueued);
  EXPECT_EQ(jobs->view(*waiting).queue_position, 0);
  EXPECT_EQ(jobs->films().film(*waiting).error().code, core::ErrorCode::kConflict);
  ASSERT_TRUE(jobs->cancel(busy));
  EXPECT_TRUE(wait_for(waiting, JobState::kFinished));
}

TEST_F(Jobs, FullQueueRefuses) {
  options.book.running_max = 1;
  options.book.queue_max = 1;
  restart();
  submit(kForever, R"(, "priority": 1)");
  submit(8);
  EXPECT_EQ(jobs->submit(request(8), {}).problem().status, 429);
}

TEST_F(Jobs, EvictsTheOldestFilmsBeyondTheDiskLimit) {
  storage.total_bytes = 1;
  restart();
  const auto job = submit(8);
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  const auto deadline = Clock::now() + std::chrono::seconds(30);
  while (jobs->films().film(*job) && Clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_EQ(jobs->films().film(*job).error().code, api::kGone);
  EXPECT_EQ(jobs->view(*job).state, JobState::kFinished);
}

TEST_F(Jobs, EvictsFilmsOfCancelledJobsToo) {
  std::vector<JobPointer> cancelled;
  for (int i = 0; i < 20; ++i) {  // more than one batch of the search
    cancelled.push_back(submit(kForever));
    ASSERT_TRUE(wait_for_samples(cancelled.back()));
    ASSERT_TRUE(jobs->cancel(cancelled.back()));
    const auto settled = jobs->films().final_film(*cancelled.back(), {});
    ASSERT_TRUE(settled) << settled.error().message;
  }
  storage.total_bytes = 1;
  restart();
  const auto last = submit(8);
  ASSERT_TRUE(wait_for(last, JobState::kFinished));
  const auto deadline = Clock::now() + std::chrono::seconds(60);
  while (quota->total()->film_bytes > 1 && Clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_EQ(quota->total()->film_bytes, 0U);
  const auto first = jobs->find(cancelled.front()->id(), Access::operators());
  ASSERT_TRUE(first);
  EXPECT_EQ(jobs->films().film(**first).error().code, api::kGone);
}

TEST_F(Jobs, TenantKeepsNoMoreThanTheQuota) {
  const std::uint64_t one =
      server::FilmFile::disk_bytes_max(*core::make_film(request(8).spec.render));
  storage.tenant_bytes = one + one / 2;
  restart();
  const JobService::Submission mine{.access = Access::of("me")};
  const auto first = jobs->submit(request(kForever), mine);
  ASSERT_TRUE(first);
  const auto second = jobs->submit(request(8), mine);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.problem().status, 507);
  ASSERT_EQ(second.problem().errors.size(), 1U);
  EXPECT_EQ(second.problem().errors.front().pointer, "/film");
  EXPECT_TRUE(jobs->submit(request(8), {.access = Access::of("other")}));
  EXPECT_TRUE(jobs->submit(request(8), {}));
  EXPECT_TRUE(
      jobs->submit(request(8, R"(, "class": "preview")"), mine));  // leaves nothing on the disk
  ASSERT_TRUE(jobs->cancel(first->job));
  ASSERT_TRUE(wait_for(first->job, JobState::kCancelled));
  static_cast<void>(jobs->films().final_film(*first->job, {}));
  ASSERT_TRUE(jobs->remove(first->job));
  EXPECT_EQ(quota->of_tenant("me")->film_bytes, 0U);
  EXPECT_TRUE(jobs->submit(request(8), mine));
}

TEST_F(Jobs, RemovesAFilmWithoutAJobAtTheNextStart) {
  const auto kept = submit(8);
  ASSERT_TRUE(wait_for(kept, JobState::kFinished));
  const std::string begun = "00000000-0000-4000-8000-00000000000a";
  const std::string strange = "00000000-0000-4000-8000-00000000000b";
  ASSERT_TRUE(table->note_loose_film(begun));
  ASSERT_TRUE(table->note_loose_film(kept->id()));
  for (const std::string& id : {begun, strange}) {
    test_support::write_file(data->film_path(id), "half a film");
  }
  restart();
  EXPECT_FALSE(std::filesystem::exists(data->film_path(begun)));
  EXPECT_TRUE(std::filesystem::exists(data->film_path(strange)));  // not a file of the server
  EXPECT_TRUE(jobs->films().film(**jobs->find(kept->id(), Access::operators())));
}

TEST_F(Jobs, JobForgottenWhileLoadingLeavesNoFilm) {
  scene_options.cache_bytes = 0;  // every job loads its scene again
  restart();
  for (int i = 0; i < 8; ++i) {
    auto asked = request(kForever);
    asked.spec.scene = "interior";
    const auto submitted = jobs->submit(asked, {});
    ASSERT_TRUE(submitted);
    ASSERT_TRUE(wait_for(submitted->job, [](JobState now) { return now != JobState::kQueued; }));
    std::this_thread::sleep_for(milliseconds(i));  // at different times
    ASSERT_TRUE(jobs->cancel(submitted->job));
    ASSERT_TRUE(jobs->remove(submitted->job));
  }
  const std::string films = data->films_path();
  halt();
  EXPECT_TRUE(std::filesystem::is_empty(films));
}

TEST_F(Jobs, ListsCombineJobsOfMemoryAndStoreInOneOrder) {
  const auto first = submit(8);
  const auto preview = submit(8, R"(, "class": "preview")");
  const auto last = submit(8);
  ASSERT_TRUE(wait_for(last, JobState::kFinished));
  server::JobQuery query;
  query.limit = 2;
  const auto page = jobs->index().list(query, Access::operators());
  ASSERT_TRUE(page);
  ASSERT_EQ(page->jobs.size(), 2U);
  EXPECT_EQ(page->jobs[0].id, last->id());
  EXPECT_EQ(page->jobs[1].id, preview->id());
  ASSERT_TRUE(page->next);
  query.before = page->next;
  const auto rest = jobs->index().list(query, Access::operators());
  ASSERT_EQ(rest->jobs.size(), 1U);
  EXPECT_EQ(rest->jobs[0].id, first->id());
  EXPECT_FALSE(rest->next);
}

TEST_F(Jobs, RefusesAnUnknownSceneOrCameraAtOnce) {
  auto unknown = request(8);
  unknown.spec.scene = "nowhere";
  EXPECT_EQ(jobs->submit(unknown, {}).problem().status, 404);
  auto camera = request(8);
  camera.spec.camera.name = "nobody";
  const auto refused = jobs->submit(camera, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.problem().status, 422);
  EXPECT_EQ(refused.problem().errors.at(0).pointer, "/camera/name");
}

TEST_F(Jobs, ManyJobsAtOnceAllEnd) {
  std::vector<JobPointer> all;
  for (int i = 0; i < 24; ++i) {
    all.push_back(submit(4, R"(, "priority": )" + std::to_string(i % 3)));
    if (i % 5 == 4) {
      EXPECT_TRUE(jobs->cancel(all[static_cast<std::size_t>(i) - 2]));
    }
  }
  for (const JobPointer& job : all) {
    EXPECT_TRUE(wait_for(job, [](JobState state) { return api::is_final(state); }));
    EXPECT_NE(job->state(), JobState::kFailed);
  }
}

}  // namespace
