#include "server/jobs/job_book.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

using server::BookLimits;
using server::Job;
using server::JobBook;
using server::JobMemory;
using server::JobPointer;
using server::JobRecord;
using server::Rank;

server::MemoryGate& unlimited() {
  static server::MemoryGate gate(0);
  return gate;
}

JobPointer made_job(std::int64_t sequence, bool is_preview = false,
                    const std::string& tenant = "") {
  JobRecord record;
  record.view.id = "job" + std::to_string(sequence);
  record.sequence = sequence;
  record.tenant = tenant;
  if (is_preview) {
    record.view.spec.job_class = api::JobClass::kPreview;
  }
  return std::make_shared<Job>(std::move(record), Job::History::kInLog);
}

TEST(JobBook, OrdersTheQueueByClassPriorityAndAge) {
  JobBook book(BookLimits{}, unlimited());
  const auto old = made_job(1);
  const auto fresh = made_job(2);
  const auto urgent = made_job(3);
  const auto preview = made_job(4, true);
  book.enqueue(fresh, {});
  book.enqueue(old, {});
  book.enqueue(urgent, {.rank = {.priority = 5}});
  book.enqueue(preview, {.rank = {.is_preview = true, .priority = -5}});
  EXPECT_EQ(book.position(*preview), 0);
  EXPECT_EQ(book.position(*fresh), 3);
  std::vector<std::shared_ptr<JobBook::Slot>> slots;
  for (const auto& next : {preview, urgent, old, fresh}) {
    slots.push_back(book.admit());
    ASSERT_NE(slots.back(), nullptr);
    EXPECT_EQ(slots.back()->job(), next);
  }
  EXPECT_EQ(book.admit(), nullptr);
}

TEST(JobBook, TenantsAlternateWithinARank) {
  JobBook book(BookLimits{.running_max = 2}, unlimited());
  std::vector<JobPointer> jobs = {nullptr};
  for (int i = 1; i <= 7; ++i) {
    jobs.push_back(made_job(i, false, i <= 4 ? "many" : "few"));
  }
  for (std::size_t i = 1; i <= 4; ++i) {
    book.enqueue(jobs[i], {});
  }
  auto first = book.admit();
  auto second = book.admit();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->job(), jobs[1]);
  EXPECT_EQ(second->job(), jobs[2]);
  EXPECT_EQ(book.admit(), nullptr);
  for (std::size_t i = 5; i <= 7; ++i) {
    book.enqueue(jobs[i], {});
  }
  EXPECT_EQ(book.position(*jobs[5]), 0);  // no job of its tenant runs
  EXPECT_EQ(book.position(*jobs[6]), 1);
  EXPECT_EQ(book.position(*jobs[3]), 2);  // two already run
  EXPECT_EQ(book.position(*jobs[7]), 3);
  EXPECT_EQ(book.position(*jobs[4]), 4);
  // A tenant without a running job gets a slot beyond the limit, and a second one only below it.
  const auto beyond = book.admit();
  ASSERT_NE(beyond, nullptr);
  EXPECT_EQ(beyond->job(), jobs[5]);
  EXPECT_EQ(book.admit(), nullptr);
  first.reset();
  EXPECT_EQ(book.admit(), nullptr);
  second.reset();
  EXPECT_EQ(book.position(*jobs[3]), 0);
  const auto next = book.admit();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->job(), jobs[3]);
}

JobPointer job_with_image(std::int64_t sequence) {
  JobRecord record = made_job(sequence)->record();
  record.view.progress.samples_min = 1;
  return std::make_shared<Job>(std::move(record), Job::History::kInLog);
}

TEST(JobBook, JobsWithoutAnImageComeFirst) {
  JobBook book(BookLimits{}, unlimited());
  const std::vector<JobPointer> jobs = {job_with_image(1), made_job(2), job_with_image(3),
                                        made_job(4)};
  for (const JobPointer& job : jobs) {
    book.enqueue(job, {});
  }
  EXPECT_EQ(book.position(*jobs[1]), 0);
  EXPECT_EQ(book.position(*jobs[3]), 1);
  EXPECT_EQ(book.position(*jobs[0]), 2);
  EXPECT_EQ(book.position(*jobs[2]), 3);
}

class YieldingJobs : public testing::Test {
 protected:
  void start(const JobPointer& job) {
    book_.enqueue(job, {});
    slots_.push_back(book_.admit());
    ASSERT_TRUE(slots_.back() && slots_.back()->job() == job);
  }
  /// The job that is to be parked. images: jobs that have one.
  JobPointer yielding(const std::set<JobPointer>& images, const std::set<JobPointer>& timed = {}) {
    const auto is_in = [](const std::set<JobPointer>& set, const Job& job) {
      return std::any_of(set.begin(), set.end(),
                         [&](const auto& each) { return each.get() == &job; });
    };
    return book_.take_yielding([&](const Job& job) -> server::SliceSource::Turn {
      return {.has_image = is_in(images, job), .is_timed = is_in(timed, job)};
    });
  }
  JobBook book_{BookLimits{.running_max = 2}, unlimited()};
  std::vector<std::shared_ptr<JobBook::Slot>> slots_;
  JobPointer a_ = made_job(1);
  JobPointer b_ = made_job(2);
};

TEST_F(YieldingJobs, TheYoungestYieldsOnceAllHaveImages) {
  start(a_);
  start(b_);
  EXPECT_EQ(yielding({a_, b_}), nullptr) << "nobody waits";
  book_.enqueue(made_job(3), {});
  EXPECT_EQ(yielding({a_}), nullptr);
  EXPECT_EQ(yielding({a_, b_}), b_);
  EXPECT_EQ(yielding({a_, b_}), nullptr) << "it is being parked";
  book_.keep(*b_);
  EXPECT_EQ(yielding({a_, b_}, {b_}), a_) << "the time of b runs out while it waits";
}

TEST_F(YieldingJobs, AJobWithAnImageGetsTheSlotOfAYoungerOne) {
  start(a_);
  start(made_job(4));
  const JobPointer c = slots_.back()->job();
  book_.enqueue(job_with_image(5), {});
  EXPECT_EQ(yielding({a_, c}), nullptr);
  book_.enqueue(job_with_image(3), {});
  EXPECT_EQ(yielding({a_, c}), c);
}

TEST_F(YieldingJobs, NotForOtherTenantsRanksOrScenes) {
  start(a_);
  start(b_);
  const JobPointer other = made_job(3);
  JobRecord record = other->record();
  record.view.spec.scene = "other";
  other->set_record(record);
  book_.enqueue(other, {});
  EXPECT_EQ(yielding({a_, b_}), nullptr);
  book_.dequeue(*other);
  const JobPointer minor = made_job(4);
  book_.enqueue(minor, {.rank = {.priority = -1}});
  EXPECT_EQ(yielding({a_, b_}), nullptr);
  book_.dequeue(*minor);
  start(made_job(5, false, "tenant"));  // Beyond the limit.
  const JobPointer guest = slots_.back()->job();
  book_.enqueue(made_job(6), {});
  EXPECT_EQ(yielding({a_, b_, guest}), nullptr) << "more jobs run than the limit";
  const JobPointer next = made_job(7, false, "tenant");
  book_.enqueue(next, {});
  ASSERT_EQ(book_.position(*next), 0);
  EXPECT_EQ(yielding({a_, b_, guest}), guest);
}

TEST_F(YieldingJobs, TheFirstJobOfATenantGetsASlotOfATenantThatHasSeveral) {
  start(a_);
  start(b_);
  start(made_job(3, false, "one"));
  const JobPointer single = slots_.back()->job();
  start(made_job(4, false, "two"));  // Twice the limit.
  const JobPointer other = slots_.back()->job();
  const JobPointer first = made_job(5, false, "three");
  book_.enqueue(first, {});
  EXPECT_EQ(yielding({single, other}), nullptr) << "others have one job each";
  EXPECT_EQ(yielding({a_, single, other}), a_) << "b has no image yet";
  book_.keep(*a_);
  EXPECT_EQ(yielding({a_, b_, single, other}), b_);
  slots_.erase(slots_.begin() + 1);
  slots_.push_back(book_.admit());
  ASSERT_TRUE(slots_.back());
  EXPECT_EQ(slots_.back()->job(), first);
  book_.enqueue(job_with_image(6), {});
  EXPECT_EQ(yielding({a_, single, other, first}), nullptr) << "each has one";
}

TEST(JobBook, SlotsBeyondTheLimitEndAtTwiceTheLimit) {
  JobBook book(BookLimits{.running_max = 2}, unlimited());
  std::vector<std::shared_ptr<JobBook::Slot>> slots;
  for (int i = 1; i <= 6; ++i) {
    book.enqueue(made_job(i, false, "tenant " + std::to_string(i)), {});
    slots.push_back(book.admit());
    EXPECT_EQ(slots.back() != nullptr, i <= 4) << i;
  }
}

TEST(JobBook, RunsNoMoreJobsThanSlots) {
  JobBook book(BookLimits{.running_max = 1}, unlimited());
  book.enqueue(made_job(1), {});
  book.enqueue(made_job(2), {});
  auto slot = book.admit();
  ASSERT_NE(slot, nullptr);
  EXPECT_EQ(book.admit(), nullptr);
  slot.reset();
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBook, HigherPriorityNeedNotWaitForALowerOneToEnd) {
  JobBook book(BookLimits{.running_max = 1}, unlimited());
  book.enqueue(made_job(1), {});
  const auto low = book.admit();
  ASSERT_NE(low, nullptr);
  book.enqueue(made_job(2), {.rank = {.priority = 1}});
  const auto high = book.admit();
  EXPECT_NE(high, nullptr);
  book.enqueue(made_job(3), {.rank = {.priority = 2}});
  EXPECT_EQ(book.admit(), nullptr);  // at most twice the slots
}

TEST(JobBook, PreviewsNeedNoSlot) {
  JobBook book(BookLimits{.running_max = 1}, unlimited());
  book.enqueue(made_job(1), {});
  const auto slot = book.admit();
  ASSERT_NE(slot, nullptr);
  book.enqueue(made_job(2, true), {.rank = {.is_preview = true}});
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBook, FullQueueReportsItsLengthAndARemedy) {
  JobBook book(BookLimits{.queue_max = 2}, unlimited());
  book.enqueue(made_job(1), {});
  EXPECT_EQ(book.full_text({}),
            "The queue is full: 1 job is waiting. Wait until one has started, and try again.");
  book.enqueue(made_job(2), {});
  EXPECT_EQ(book.full_text({}),
            "The queue is full: 2 jobs are waiting. Wait until one has started, and try again.");
}

TEST(JobBook, FullQueueHasNoRoom) {
  JobBook book(BookLimits{.queue_max = 2, .running_max = 1}, unlimited());
  book.enqueue(made_job(1), {});
  const auto slot = book.admit();
  ASSERT_NE(slot, nullptr);
  EXPECT_TRUE(book.has_room({}));
  const auto second = made_job(2);
  book.enqueue(second, {});
  book.enqueue(made_job(3), {});
  EXPECT_FALSE(book.has_room({}));
  EXPECT_TRUE(book.has_room({.rank = {.is_preview = true}}));
  book.dequeue(*second);
  EXPECT_TRUE(book.has_room({}));
}

TEST(JobBook, ChangedPriorityMovesAWaitingJob) {
  JobBook book(BookLimits{}, unlimited());
  book.enqueue(made_job(1), {});
  const auto second = made_job(2);
  book.enqueue(second, {});
  book.set_rank(*second, {.priority = 1});
  EXPECT_EQ(book.position(*second), 0);
}

TEST(JobBook, ForgetsOldFinalJobsFirst) {
  JobBook book(BookLimits{.final_jobs_max = 2}, unlimited());
  for (int i = 1; i <= 3; ++i) {
    const auto job = made_job(i);
    book.add(job);
    book.retire(job);
  }
  EXPECT_EQ(book.find("job1"), nullptr);
  EXPECT_NE(book.find("job2"), nullptr);
  EXPECT_NE(book.find("job3"), nullptr);
}

TEST(JobBook, DeletedJobDoesNotReturnWhenItsRunEnds) {
  JobBook book(BookLimits{}, unlimited());
  const auto job = made_job(1);
  book.add(job);
  book.forget(*job);
  book.retire(job);
  EXPECT_EQ(book.find("job1"), nullptr);
}

TEST(JobBook, ReusedIdIsAnotherJob) {
  JobBook book(BookLimits{.final_jobs_max = 1}, unlimited());
  const auto old = made_job(1);
  const auto fresh = made_job(1);
  book.add(old);
  book.enqueue(old, {});
  auto slot = book.admit();
  book.forget(*old);
  book.add(fresh);
  book.enqueue(fresh, {});
  book.retire(old);
  book.forget(*old);
  book.dequeue(*old);
  EXPECT_EQ(book.find("job1"), fresh);
  EXPECT_EQ(book.position(*fresh), 0);
  EXPECT_EQ(book.holders(), std::vector<JobPointer>{old});
  slot.reset();
  EXPECT_TRUE(book.holders().empty());
}

TEST(JobBook, ReturningASlotCallsOnLeave) {
  int left = 0;
  JobBook book(BookLimits{.running_max = 1}, unlimited(), [&left] { ++left; });
  book.enqueue(made_job(1), {});
  auto slot = book.admit();
  EXPECT_EQ(left, 0);
  slot.reset();
  EXPECT_EQ(left, 1);
}

TEST(JobBook, TwoThreadsThatLoadTheSameFinalJobGetOneObject) {
  JobBook book(BookLimits{}, unlimited());
  const auto first = made_job(1);
  const auto second = made_job(1);
  EXPECT_EQ(book.add_final(first), first);
  EXPECT_EQ(book.add_final(second), first);
}

constexpr Rank kNormal = {};
constexpr Rank kPreview = {.is_preview = true};
constexpr std::uint64_t kMost = 1600;  ///< 1400 for normal jobs, 1500 for previews

/// A film, and a named scene.
JobMemory memory(std::uint64_t film_bytes, const std::string& scene = "",
                 std::uint64_t scene_bytes = 0) {
  JobMemory needed{.film_bytes = film_bytes, .shared_bytes = {}};
  if (!scene.empty()) {
    needed.shared_bytes[scene] = scene_bytes;
  }
  return needed;
}

/// The jobs of a test, and their slots.
class JobBookMemory : public testing::Test {
 protected:
  /// bytes_max: 0 for unlimited memory.
  JobBook& make_book(BookLimits limits, std::uint64_t bytes_max = 0) {
    return book_.emplace(limits, memory_.emplace(bytes_max));
  }
  server::MemoryGate& gate() { return *memory_; }
  /// Adds a job to the queue, and to a slot if one is free.
  bool start(JobBook& book, int number, Rank rank, const JobMemory& needed = {},
             const std::string& tenant = "") {
    wait(book, number, rank, needed, tenant);
    return admit(book);
  }
  void wait(JobBook& book, int number, Rank rank, const JobMemory& needed = {},
            const std::string& tenant = "") {
    jobs_[number] = made_job(number, rank.is_preview, tenant);
    book.enqueue(jobs_[number], {.rank = rank, .memory = needed});
  }
  bool admit(JobBook& book) {
    auto slot = book.admit();
    if (!slot) {
      return false;
    }
    const JobPointer job = slot->job();
    slots_[job->sequence()] = std::move(slot);
    return true;
  }
  const Job& job(int number) { return *jobs_.at(number); }
  const JobPointer& pointer(int number) { return jobs_.at(number); }
  void leave(int number) { slots_.erase(number); }

 private:
  std::optional<server::MemoryGate> memory_;
  std::optional<JobBook> book_;
  std::map<int, JobPointer> jobs_;
  std::map<std::int64_t, std::shared_ptr<JobBook::Slot>> slots_;
};

TEST_F(JobBookMemory, JobsWaitForMemory) {
  JobBook& book = make_book(BookLimits{}, kMost);
  wait(book, 1, kNormal, memory(900));
  wait(book, 2, kNormal, memory(601));
  ASSERT_TRUE(start(book, 3, kNormal, memory(1)));
  EXPECT_EQ(book.memory_bytes(), 900U);
  EXPECT_FALSE(
      admit(book));  // the small job does not overtake the large one, which would never start
  EXPECT_TRUE(book.waits_for_memory());
  leave(1);
  EXPECT_EQ(book.memory_bytes(), 0U);
  ASSERT_TRUE(admit(book));
  ASSERT_TRUE(admit(book));
  EXPECT_EQ(book.memory_bytes(), 602U);
  EXPECT_FALSE(book.waits_for_memory());
}

TEST_F(JobBookMemory, ReservesAnEighthForRequestsAndHalfOfItForPreviews) {
  JobBook& book = make_book(BookLimits{}, kMost);
  ASSERT_TRUE(start(book, 1, kNormal, memory(1400)));
  ASSERT_TRUE(start(book, 2, kPreview, memory(100)));
  wait(book, 3, kPreview, memory(1));
  EXPECT_FALSE(admit(book));
}

TEST_F(JobBookMemory, FirstJobOfATenantMayUseTheMemoryOfPreviews) {
  JobBook& book = make_book(BookLimits{}, kMost);
  ASSERT_TRUE(start(book, 1, kNormal, memory(1400), "b"));
  EXPECT_FALSE(start(book, 2, kNormal, memory(1), "b"));
  EXPECT_TRUE(start(book, 3, kNormal, memory(100), "a"));  // It comes before the second of b.
  EXPECT_FALSE(start(book, 4, kNormal, memory(1), "a"));
}

TEST_F(JobBookMemory, SmallFirstJobOfATenantDoesNotWaitForRequestsThatHoldEverything) {
  JobBook& book = make_book(BookLimits{}, kMost);
  const auto request = gate().take({.bytes = kMost, .tenant = "b"}, "an image");
  ASSERT_TRUE(request);
  EXPECT_FALSE(start(book, 1, kNormal, memory(26), "c"));
  book.dequeue(job(1));
  EXPECT_TRUE(start(book, 2, kNormal, memory(25), "a"));  // 1/64 of the memory.
}

TEST_F(JobBookMemory, ReclaimersMayUseTheBook) {
  JobBook& book = make_book(BookLimits{}, kMost);
  std::optional<server::MemoryGate::Lease> cached =
      gate().note({.bytes = 1500}, server::MemoryGate::Kind::kIdle);
  gate().add_reclaimer([&] {
    EXPECT_FALSE(book.forget_oldest_preview());  // There is none.
    const bool any = cached.has_value();
    cached.reset();
    return any;
  });
  EXPECT_TRUE(start(book, 1, kNormal, memory(1000)));
}

TEST_F(JobBookMemory, CountsSharedMemoryOfJobsOnce) {
  JobBook& book = make_book(BookLimits{}, kMost);
  wait(book, 1, kNormal, memory(50, "hall", 1300));
  wait(book, 2, kNormal, memory(50, "hall", 1300));
  ASSERT_TRUE(start(book, 3, kNormal, memory(50, "sponza", 1300)));
  ASSERT_TRUE(admit(book));
  EXPECT_EQ(book.memory_bytes(), 1400U);
  EXPECT_FALSE(admit(book));
  leave(1);
  EXPECT_EQ(book.memory_bytes(), 1350U);
  leave(2);
  EXPECT_TRUE(admit(book));
}

TEST_F(JobBookMemory, JobThatNeverFitsGetsASlotWithoutMemoryAndDelaysNoOther) {
  JobBook& book = make_book(BookLimits{}, kMost);
  wait(book, 1, kNormal, memory(10, "large", 5000));
  wait(book, 2, kNormal, memory(10));
  EXPECT_TRUE(admit(book));
  EXPECT_EQ(book.memory_bytes(), 0U);
  EXPECT_TRUE(admit(book));
  EXPECT_EQ(book.memory_bytes(), 10U);
}

TEST_F(JobBookMemory, DoesNotGiveMemoryOfRequestsToJobs) {
  JobBook& book = make_book(BookLimits{}, kMost);
  auto request = gate().take(800, "an image");
  ASSERT_TRUE(request);
  ASSERT_TRUE(start(book, 1, kNormal, memory(600)));
  wait(book, 2, kNormal, memory(1));
  EXPECT_FALSE(admit(book));
  EXPECT_TRUE(book.waits_for_memory());
  *request = {};
  EXPECT_TRUE(admit(book));
}

TEST_F(JobBookMemory, ReleasesLoadingMemoryWhenTheSceneIsLoaded) {
  JobBook& book = make_book(BookLimits{}, kMost);
  JobMemory needed = memory(100, "hall", 300);
  needed.load_bytes = 900;
  needed.work_bytes = 50;
  ASSERT_TRUE(start(book, 1, kNormal, needed));
  EXPECT_EQ(book.memory_bytes(), 1200U);
  EXPECT_EQ(gate().used_bytes(), 1200U);
  book.end_load(job(1), {{"hall", 300}});
  EXPECT_EQ(book.memory_bytes(), 450U);
  EXPECT_EQ(gate().used_bytes(), 450U);
}

TEST_F(JobBookMemory, CountsALoadedSceneOnceUnderItsCacheName) {
  JobBook& book = make_book(BookLimits{}, kMost);
  ASSERT_TRUE(start(book, 1, kNormal, memory(100, "hall from anywhere", 300)));
  const auto cached =
      gate().note({.shared = {{"hall from here", 300}}}, server::MemoryGate::Kind::kIdle);
  EXPECT_EQ(gate().used_bytes(), 700U);
  book.end_load(job(1), {{"hall from here", 300}});
  EXPECT_EQ(gate().used_bytes(), 400U);
}

TEST_F(JobBookMemory, PauseKeepsTheMemoryAndTheLongestPausedIsParkedFirst) {
  JobBook& book = make_book(BookLimits{}, kMost);
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(start(book, i, kNormal, memory(400)));
  }
  book.pause(job(2));
  book.pause(job(1));
  EXPECT_EQ(book.memory_bytes(), 1200U);
  EXPECT_TRUE(book.take_parkable().empty());  // no job waits
  wait(book, 4, kNormal, memory(600));
  EXPECT_FALSE(admit(book));
  EXPECT_EQ(book.take_parkable(), std::vector<JobPointer>{pointer(2)});
  EXPECT_TRUE(book.take_parkable().empty());  // it is in progress
  book.keep(job(2));                          // it could not be saved
  EXPECT_EQ(book.take_parkable(), std::vector<JobPointer>{pointer(2)});
  leave(2);
  EXPECT_TRUE(admit(book));
}

TEST_F(JobBookMemory, DoesNotParkAResumedJob) {
  JobBook& book = make_book(BookLimits{}, kMost);
  ASSERT_TRUE(start(book, 1, kNormal, memory(900)));
  book.pause(job(1));
  book.claim(job(1), kNormal);
  wait(book, 2, kNormal, memory(900));
  EXPECT_FALSE(admit(book));
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST_F(JobBookMemory, ParksNoJobIfThatFreesTooLittle) {
  JobBook& book = make_book(BookLimits{}, kMost);
  wait(book, 1, kNormal, memory(1100));
  ASSERT_TRUE(start(book, 2, kNormal, memory(200)));
  ASSERT_TRUE(admit(book));
  book.pause(job(2));
  wait(book, 3, kNormal, memory(500));  // the running job leaves 300
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST_F(JobBookMemory, DoesNotParkPreviewsWhichHaveNoFile) {
  JobBook& book = make_book(BookLimits{}, kMost);
  ASSERT_TRUE(start(book, 1, kPreview, memory(900)));
  book.pause(job(1));
  wait(book, 2, kNormal, memory(900));
  EXPECT_FALSE(admit(book));
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST_F(JobBookMemory, CountsPausedPreviewsAsPreviews) {
  JobBook& book = make_book(BookLimits{.previews_max = 1});
  ASSERT_TRUE(start(book, 1, kPreview));
  book.pause(job(1));
  EXPECT_FALSE(book.has_room({.rank = kPreview}));
}

TEST_F(JobBookMemory, AcceptsOnlyStartableJobsWithoutAQueue) {
  JobBook& book = make_book(BookLimits{.queue_max = 0}, kMost);
  ASSERT_TRUE(start(book, 1, kNormal, memory(900)));
  EXPECT_TRUE(book.has_room({.rank = kNormal, .memory = memory(500)}));
  EXPECT_FALSE(book.has_room({.rank = kNormal, .memory = memory(501)}));
}

TEST_F(JobBookMemory, LeavesPreviewsForOtherTenants) {
  JobBook& book = make_book(BookLimits{.previews_max = 3, .previews_of_tenant_max = 2});
  ASSERT_TRUE(start(book, 1, kPreview, {}, "a"));
  EXPECT_TRUE(book.has_room({.rank = kPreview}, "a"));
  wait(book, 2, kPreview, {}, "a");
  EXPECT_FALSE(book.has_room({.rank = kPreview}, "a"));
  EXPECT_TRUE(book.has_room({.rank = kPreview}, "b"));
  EXPECT_TRUE(book.has_room({.rank = kPreview}));
  leave(1);
  EXPECT_TRUE(book.has_room({.rank = kPreview}, "a"));
}

}  // namespace
