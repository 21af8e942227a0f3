// WorkBoard under a clock that only the test moves, with a queue in memory and workers that the
// test plays.
#include "server/jobs/work_board.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/units/unit_renderer.h"
#include "server/jobs/render_run.h"
#include "tests/unit/server/fake_queue.h"
#include "tests/unit/server/jobs_fixture.h"

namespace {

using api::JobState;
using core::ErrorCode;
using server::JobPointer;
using server::WorkBoard;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kLease = 15;
constexpr int kSamples = 8;

class WorkBoardTest : public test_support::JobsFixture {
 protected:
  void SetUp() override {
    ticks_ = Clock::time_point(std::chrono::hours(1)).time_since_epoch().count();
    queue_ = std::make_shared<test_support::FakeQueue>();
    options.queue = queue_;
    options.work.lease_seconds = kLease;
    options.work.now = [this] { return Clock::time_point(Clock::duration(ticks_.load())); };
    JobsFixture::SetUp();
  }
  WorkBoard& board() { return *jobs->board(); }
  static WorkBoard::Sender sender(const std::string& worker) { return {worker, "key " + worker}; }
  void pass(Clock::duration time) { ticks_ += time.count(); }

  void report(const std::string& worker, const std::map<std::string, double>& units = {}) {
    api::WorkerReport sent;
    sent.threads = 1;
    sent.units = units;
    EXPECT_TRUE(board().report(sender(worker), sent));
  }
  /// Waits for the name of a unit.
  std::string next_unit() {
    EXPECT_TRUE(wait_until([this] { return take_names() > 0; }));
    if (names_.empty()) {
      return "";
    }
    std::string name = std::move(names_.front());
    names_.pop_front();
    return name;
  }
  /// Waits until the name is published again.
  bool comes_again(const std::string& unit) {
    return wait_until([&] {
      take_names();
      return std::find(names_.begin(), names_.end(), unit) != names_.end();
    });
  }
  /// Renders the units that a worker leased.
  static std::string rendered(const JobPointer& job, const std::string& input) {
    auto work = core::decode_work(input, core::WorkPart::kInput);
    EXPECT_TRUE(work);
    const auto run = job->run();
    EXPECT_TRUE(run);
    core::UnitRenderer renderer(
        std::shared_ptr<const core::Renderer>(run, &run->task().renderer()));
    EXPECT_TRUE(renderer.render(*work, {}));
    return core::encode_work(*work, core::WorkPart::kResult);
  }
  /// Lets a worker render all that is left; returns the film's digest.
  std::string finished_by(const std::string& worker, const JobPointer& job) {
    EXPECT_TRUE(wait_until([&] {
      report(worker);
      while (take_names() > 0) {
        const std::string name = next_unit();
        if (const auto input = board().lease(name, sender(worker))) {
          EXPECT_TRUE(board().take(name, sender(worker), rendered(job, *input)));
        }
      }
      return api::is_final(job->state());
    }));
    EXPECT_EQ(job->state(), JobState::kFinished);
    return jobs->view(*job).film_digest;
  }
  bool is_waiting(const JobPointer& job) {
    const auto warnings = jobs->view(*job).warnings;
    return std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.find("is waiting") != std::string::npos;
    });
  }

  std::shared_ptr<test_support::FakeQueue> queue_;

 private:
  /// Returns the number of names that no test has taken.
  std::size_t take_names() {
    for (std::string& name : queue_->take_published()) {
      names_.push_back(std::move(name));
    }
    return names_.size();
  }

  std::atomic<Clock::rep> ticks_ = 0;
  std::deque<std::string> names_;
};

TEST_F(WorkBoardTest, ASuspendedWorkerStaysSuspendedWhenTheServerStartsAgain) {
  jobs->distrust("liar");
  restart();
  report("liar");
  report("honest");
  for (const api::WorkerView& worker : board().workers()) {
    EXPECT_EQ(worker.state, worker.id == "liar" ? "suspended" : "idle");
  }
}

TEST_F(WorkBoardTest, UnitsOfAWorkerMakeTheFilmOfAProcess) {
  report("a");
  const JobPointer job = submit(kSamples);
  const std::string by_worker = finished_by("a", job);
  EXPECT_GT(board().counts().taken, 0U);
  halt();
  options.queue = nullptr;
  start();
  const JobPointer here = submit(kSamples);
  ASSERT_TRUE(wait_for(here, JobState::kFinished));
  EXPECT_EQ(by_worker, jobs->view(*here).film_digest);
}

TEST_F(WorkBoardTest, AResultAfterTheLeaseIsRefusedAndAnotherWorkersIsTaken) {
  report("a");
  const JobPointer job = submit(kSamples);
  const std::string unit = next_unit();
  const auto input = board().lease(unit, sender("a"));
  ASSERT_TRUE(input);
  const std::string result = rendered(job, *input);
  const std::uint32_t before = jobs->view(*job).progress.revision;
  pass(seconds(kLease));
  std::this_thread::sleep_for(milliseconds(200));  // four rounds of the board's thread
  EXPECT_EQ(board().counts().expired, 0U) << "the lease ends after its time, not at it";
  pass(milliseconds(1));
  ASSERT_TRUE(wait_until([this] { return board().counts().expired == 1; }));
  EXPECT_EQ(board().take(unit, sender("a"), result).error().code, ErrorCode::kConflict);
  EXPECT_EQ(board().result_bytes_max(unit, sender("a")).error().code, ErrorCode::kConflict);
  EXPECT_EQ(jobs->view(*job).progress.revision, before) << "it is not in the film";
  report("b");
  ASSERT_TRUE(comes_again(unit));
  ASSERT_TRUE(board().lease(unit, sender("b")));
  EXPECT_TRUE(board().take(unit, sender("b"), result));
  EXPECT_EQ(board().take(unit, sender("b"), result).error().code, ErrorCode::kNotFound)
      << "it is taken once";
  finished_by("b", job);
}

TEST_F(WorkBoardTest, ReportsKeepALeaseOnlyWithProgress) {
  report("a");
  report("b");
  const JobPointer job = submit(kSamples);
  const std::string still = next_unit();
  ASSERT_TRUE(board().lease(still, sender("a")));
  const std::string moving = next_unit();
  ASSERT_TRUE(board().lease(moving, sender("b")));
  for (int second = 1; second <= kLease + 1; ++second) {
    pass(seconds(1));
    report("a", {{still, 0.0}});
    report("b", {{moving, static_cast<double>(second)}});
  }
  ASSERT_TRUE(wait_until([this] { return board().counts().expired == 1; }));
  EXPECT_EQ(board().result_bytes_max(still, sender("a")).error().code, ErrorCode::kConflict);
  EXPECT_TRUE(board().result_bytes_max(moving, sender("b")));
  EXPECT_EQ(board().job_of_lease(job->id(), "key a"), nullptr);
  EXPECT_EQ(board().job_of_lease(job->id(), "key b"), job);
}

TEST_F(WorkBoardTest, AJobWaitsOnceNoWorkerWasThereForALease) {
  report("a");
  const JobPointer job = submit(kSamples);
  next_unit();
  EXPECT_FALSE(is_waiting(job));
  pass(seconds(kLease + 1));  // "a" is lost now
  std::this_thread::sleep_for(milliseconds(200));
  pass(seconds(kLease + 1));
  EXPECT_TRUE(wait_until([&] { return is_waiting(job); }));
  report("b");
  pass(seconds(2));
  EXPECT_TRUE(wait_until([&] { return !is_waiting(job); }));
}

TEST_F(WorkBoardTest, AQueueThatLostItsNamesGetsThemAgain) {
  report("a");
  const JobPointer job = submit(kSamples);
  const std::string lost = next_unit();
  queue_->set_up(false);
  ASSERT_TRUE(wait_until([this] { return !board().counts().has_broker; }));
  queue_->set_up(true);
  ASSERT_TRUE(comes_again(lost));
  finished_by("a", job);
}

TEST_F(WorkBoardTest, UnitsOfACancelledJobAreDroppedAndTheirWorkersAsked) {
  report("a");
  const JobPointer job = submit(test_support::kForever);
  const std::string unit = next_unit();
  ASSERT_TRUE(board().lease(unit, sender("a")));
  EXPECT_FALSE(board().tiles_of(*job).empty());
  ASSERT_TRUE(jobs->cancel(job));
  ASSERT_TRUE(wait_until([this] { return board().counts().open == 0; }));
  EXPECT_TRUE(board().tiles_of(*job).empty());
  EXPECT_EQ(board().take(unit, sender("a"), "").error().code, ErrorCode::kNotFound);
  std::vector<std::string> asked;
  EXPECT_TRUE(wait_until([this, &asked] {
    const auto more = queue_->take_requests();
    asked.insert(asked.end(), more.begin(), more.end());
    return std::find(asked.begin(), asked.end(), "a") != asked.end();
  }));
}

class LocalThreadsToo : public WorkBoardTest {
 protected:
  void SetUp() override {
    options.render_threads = 1;
    options.work.has_local_threads = true;
    WorkBoardTest::SetUp();
  }
};

// The units wait for a worker, which is lost before it leases one.
TEST_F(LocalThreadsToo, RenderWhatNoWorkerTakes) {
  report("a");
  const JobPointer job = submit(256);
  next_unit();
  pass(seconds(kLease + 1));
  EXPECT_TRUE(wait_for(job, JobState::kFinished));
}

}  // namespace
