// A full disk: changes that the store refuses are not acknowledged, and jobs wait for space.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "server/store/disk_reserve.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using server::Access;
using server::JobPointer;
using std::chrono::milliseconds;
using test_support::kForever;

class FullDiskJobs : public test_support::JobsFixture {};

api::ParsedJob large_request(int samples) {
  auto parsed = api::parse_job(
      R"({"scene": "cornell-box", "film": {"width": 512, "height": 384, "layers": []},)"
      R"( "stop": {"samples_per_pixel": )" +
      std::to_string(samples) + "}}");
  EXPECT_TRUE(parsed);
  return *std::move(parsed);
}

/// Limits the size of files to `bytes` during its lifetime, which simulates a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {.rlim_cur = bytes, .rlim_max = before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

TEST_F(FullDiskJobs, DoesNotAcknowledgeChangesThatTheStoreRefuses) {
  const auto job = submit(kForever);
  ASSERT_TRUE(wait_for_samples(job));
  {
    const FullDisk full(0);
    const auto cancelled = jobs->cancel(job);
    ASSERT_FALSE(cancelled);
    EXPECT_EQ(cancelled.problem().status, 507);
    EXPECT_EQ(
        jobs->patch(job, R"({"paused": true})", std::nullopt, Access::operators()).problem().status,
        507);
    EXPECT_EQ(jobs->submit(request(8), {}).problem().status, 507);
    EXPECT_FALSE(api::is_final(job->state()));
  }
  EXPECT_TRUE(jobs->cancel(job));
}

TEST_F(FullDiskJobs, ASuspensionIsStoredOnceThereIsRoom) {
  const server::WorkerTable workers(*database, 1);
  {
    const FullDisk full(0);
    jobs->distrust("liar");
    const auto stored = workers.suspended();
    ASSERT_TRUE(stored);
    ASSERT_TRUE(stored->empty());
  }
  EXPECT_TRUE(wait_until([&] { return workers.suspended()->contains("liar"); }));
}

/// Above the journal of the database, which ends at 4 MB, and below the film of large_request().
constexpr rlim_t kLessThanTheFilm = 5'000'000;

TEST_F(FullDiskJobs, PausesAJobUntilThereIsSpace) {
  const auto whole = jobs->submit(large_request(8), {});
  ASSERT_TRUE(wait_for(whole->job, JobState::kFinished));
  JobPointer job;
  {
    const FullDisk full(kLessThanTheFilm);
    job = jobs->submit(large_request(8), {})->job;
    ASSERT_TRUE(wait_for(job, JobState::kPaused));
    EXPECT_EQ(jobs->view(*job).pause_reason, api::PauseReason::kStorageFull);
    EXPECT_EQ(jobs->jobs_without_room(), 1);
    std::this_thread::sleep_for(milliseconds(1500));  // the job has checked for space meanwhile
    EXPECT_EQ(job->state(), JobState::kPaused);
  }
  ASSERT_TRUE(wait_for(job, JobState::kFinished));
  EXPECT_EQ(jobs->view(*job).pause_reason, api::PauseReason::kNone);
  EXPECT_EQ(jobs->view(*job).film_digest, jobs->view(*whole->job).film_digest);
  EXPECT_TRUE(wait_until([&] { return jobs->counts().held_bytes == 0; }));
}

TEST_F(FullDiskJobs, AJobThatYieldsPausesIfItsFilmCannotBeStored) {
  options.book.running_max = 1;
  options.checkpoint_seconds = 1000;
  restart();
  const auto job = jobs->submit(large_request(kForever), {})->job;
  ASSERT_TRUE(wait_for_samples(job));
  const FullDisk full(kLessThanTheFilm);
  ASSERT_TRUE(jobs->submit(large_request(kForever), {}));
  ASSERT_TRUE(wait_for(job, JobState::kPaused));
  EXPECT_EQ(jobs->view(*job).pause_reason, api::PauseReason::kStorageFull);
}

TEST_F(FullDiskJobs, AFilmThatCannotBeStoredIsNotTriedAgainAtOnce) {
  api::JobView view;
  view.spec = large_request(kForever).spec;
  memory_max_bytes = (server::blank_film(view)->bytes() + (4 << 20U)) * 3 / 2 * 8 / 7;  // for one
  options.checkpoint_seconds = 1000;
  restart();
  const auto job = jobs->submit(large_request(kForever), {})->job;
  ASSERT_TRUE(wait_for_samples(job));
  ASSERT_TRUE(jobs->patch(job, R"({"paused": true})", std::nullopt, Access::operators()));
  const FullDisk full(kLessThanTheFilm);
  ASSERT_TRUE(jobs->submit(large_request(kForever), {}));  // The paused one is to be parked.
  const auto failures = [this] {
    server::MetricsText text;
    metrics.write(text);
    const std::string all = text.take();
    const std::string kName = R"(tessera_checkpoints_total{outcome="failed"} )";
    const std::size_t at = all.find(kName);
    return at == std::string::npos ? -1 : std::stoi(all.substr(at + kName.size()));
  };
  ASSERT_TRUE(wait_until([&] { return failures() > 0; }));
  std::this_thread::sleep_for(milliseconds(1000));  // four attempts to admit the other one
  EXPECT_EQ(failures(), 1);
}

TEST_F(FullDiskJobs, CancelsAWaitingJobAndReleasesEverything) {
  const FullDisk full(kLessThanTheFilm);
  for (const int samples : {2, kForever}) {  // at its end, and before
    const auto job = jobs->submit(large_request(samples), {})->job;
    ASSERT_TRUE(wait_for(job, JobState::kPaused));
    ASSERT_TRUE(jobs->cancel(job));
    EXPECT_TRUE(wait_until([&] { return jobs->counts().held_bytes == 0; }));
    EXPECT_TRUE(jobs->remove(job));
  }
}

TEST(DiskReserve, ReleasesAndReacquiresItsSpace) {
  const test_support::TemporaryFolder folder;
  const std::string path = folder.file("reserve");
  server::DiskReserve reserve(path);
  EXPECT_FALSE(reserve.is_taken());
  ASSERT_TRUE(reserve.take());
  EXPECT_GT(std::filesystem::file_size(path), 0U);
  EXPECT_TRUE(reserve.give_up());
  EXPECT_FALSE(reserve.is_taken());
  EXPECT_EQ(std::filesystem::file_size(path), 0U);
  EXPECT_FALSE(reserve.give_up());
  EXPECT_TRUE(reserve.take());
}

TEST(DiskReserve, IsNotTakenBackBeforeTheTransactionThatNeedsItEnds) {
  const test_support::TemporaryFolder folder;
  const auto database = *server::Database::open(folder.file("test.db"));
  int attempts = 0;
  const auto work = [&](server::Database::Session&) -> core::Status {
    if (++attempts == 1) {
      return core::Error{core::ErrorCode::kNoSpace, "", ""};
    }
    EXPECT_FALSE(database->reserve().take());
    return core::ok_status();
  };
  EXPECT_TRUE(database->transact(work));
  EXPECT_EQ(attempts, 2);
  EXPECT_TRUE(database->reserve().take());
}

}  // namespace
