#include "server/jobs/job_book.h"

#include <gtest/gtest.h>

namespace {

using server::BookLimits;
using server::Job;
using server::JobBook;
using server::JobMemory;
using server::JobPointer;
using server::JobRecord;
using server::Rank;

JobPointer made_job(std::int64_t sequence, bool is_preview = false, const std::string& owner = "") {
  JobRecord record;
  record.view.id = "job" + std::to_string(sequence);
  record.sequence = sequence;
  if (is_preview) {
    record.view.spec.job_class = api::JobClass::kPreview;
  }
  return std::make_shared<Job>(std::move(record), Job::History::kInLog, owner);
}

TEST(JobBook, TheQueueIsOrderedByClassPriorityAndAge) {
  JobBook book(BookLimits{});
  const auto old = made_job(1);
  const auto fresh = made_job(2);
  const auto urgent = made_job(3);
  const auto preview = made_job(4, true);
  book.enqueue(fresh, {});
  book.enqueue(old, {});
  book.enqueue(urgent, {.priority = 5});
  book.enqueue(preview, {.is_preview = true, .priority = -5});
  EXPECT_EQ(book.position("job4"), 0);
  EXPECT_EQ(book.position("job2"), 3);
  EXPECT_EQ(book.admit(), preview);
  EXPECT_EQ(book.admit(), urgent);
  EXPECT_EQ(book.admit(), old);
  EXPECT_EQ(book.admit(), fresh);
  EXPECT_EQ(book.admit(), nullptr);
}

TEST(JobBook, NoMoreRunThanHavePlaces) {
  JobBook book(BookLimits{.running_max = 1});
  book.enqueue(made_job(1), {});
  book.enqueue(made_job(2), {});
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_EQ(book.admit(), nullptr);
  book.leave("job1");
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBook, AHigherPriorityNeedNotWaitForALowerOneToEnd) {
  JobBook book(BookLimits{.running_max = 1});
  book.enqueue(made_job(1), {});
  ASSERT_NE(book.admit(), nullptr);
  book.enqueue(made_job(2), {.priority = 1});
  EXPECT_NE(book.admit(), nullptr);
  book.enqueue(made_job(3), {.priority = 2});
  EXPECT_EQ(book.admit(), nullptr);  // Twice the places at most.
}

TEST(JobBook, PreviewsNeedNoPlace) {
  JobBook book(BookLimits{.running_max = 1});
  book.enqueue(made_job(1), {});
  ASSERT_NE(book.admit(), nullptr);
  book.enqueue(made_job(2, true), {.is_preview = true});
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBook, AFullQueueSaysHowManyWaitAndWhatToDo) {
  JobBook book(BookLimits{.queue_max = 2});
  book.enqueue(made_job(1), {});
  EXPECT_EQ(book.full_text({}), "The queue is full: 1 job is waiting. Wait until one has started, and try again.");
  book.enqueue(made_job(2), {});
  EXPECT_EQ(book.full_text({}), "The queue is full: 2 jobs are waiting. Wait until one has started, and try again.");
}

TEST(JobBook, AFullQueueHasNoRoom) {
  JobBook book(BookLimits{.queue_max = 2, .running_max = 1});
  book.enqueue(made_job(1), {});
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_TRUE(book.has_room({}));
  book.enqueue(made_job(2), {});
  book.enqueue(made_job(3), {});
  EXPECT_FALSE(book.has_room({}));
  EXPECT_TRUE(book.has_room({.is_preview = true}));
  book.dequeue("job2");
  EXPECT_TRUE(book.has_room({}));
}

TEST(JobBook, AChangedPriorityMovesAWaitingJob) {
  JobBook book(BookLimits{});
  book.enqueue(made_job(1), {});
  book.enqueue(made_job(2), {});
  book.set_rank("job2", {.priority = 1});
  EXPECT_EQ(book.position("job2"), 0);
}

TEST(JobBook, OldFinalJobsAreForgottenFirst) {
  JobBook book(BookLimits{.final_jobs_max = 2});
  for (int i = 1; i <= 3; ++i) {
    const auto job = made_job(i);
    book.add(job);
    book.retire(job);
  }
  EXPECT_EQ(book.find("job1"), nullptr);
  EXPECT_NE(book.find("job2"), nullptr);
  EXPECT_NE(book.find("job3"), nullptr);
}

TEST(JobBook, ADeletedJobDoesNotComeBackWhenItsRunEnds) {
  JobBook book(BookLimits{});
  const auto job = made_job(1);
  book.add(job);
  book.forget("job1");
  book.retire(job);
  EXPECT_EQ(book.find("job1"), nullptr);
}

TEST(JobBook, OfTwoWhoLoadTheSameFinalJobBothGetOne) {
  JobBook book(BookLimits{});
  const auto first = made_job(1);
  const auto second = made_job(1);
  EXPECT_EQ(book.add_final(first), first);
  EXPECT_EQ(book.add_final(second), first);
}

constexpr Rank kNormal = {};
constexpr Rank kPreview = {.is_preview = true};
constexpr std::uint64_t kMost = 1600;  ///< 1500 for normal jobs

/// A film, and a scene with the name.
JobMemory memory(std::uint64_t film_bytes, const std::string& scene = "", std::uint64_t scene_bytes = 0) {
  JobMemory needed{.film_bytes = film_bytes, .shared_bytes = {}};
  if (!scene.empty()) {
    needed.shared_bytes[scene] = scene_bytes;
  }
  return needed;
}

TEST(JobBookMemory, JobsWaitUntilThereIsMemoryForThem) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(900));
  book.enqueue(made_job(2), kNormal, memory(601));
  book.enqueue(made_job(3), kNormal, memory(1));
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_EQ(book.memory_bytes(), 900U);
  EXPECT_EQ(book.admit(), nullptr);  // The small one does not pass the large one, which would wait for ever.
  EXPECT_TRUE(book.waits_for_memory());
  book.leave("job1");
  EXPECT_EQ(book.memory_bytes(), 0U);
  ASSERT_NE(book.admit(), nullptr);
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_EQ(book.memory_bytes(), 602U);
  EXPECT_FALSE(book.waits_for_memory());
}

TEST(JobBookMemory, ASixteenthIsForPreviews) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(1500));
  ASSERT_NE(book.admit(), nullptr);
  book.enqueue(made_job(2, true), kPreview, memory(100));
  ASSERT_NE(book.admit(), nullptr);
  book.enqueue(made_job(3, true), kPreview, memory(1));
  EXPECT_EQ(book.admit(), nullptr);
}

TEST(JobBookMemory, WhatJobsShareCountsOnce) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(50, "hall", 1400));
  book.enqueue(made_job(2), kNormal, memory(50, "hall", 1400));
  book.enqueue(made_job(3), kNormal, memory(50, "sponza", 1400));
  ASSERT_NE(book.admit(), nullptr);
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_EQ(book.memory_bytes(), 1500U);
  EXPECT_EQ(book.admit(), nullptr);
  book.leave("job1");
  EXPECT_EQ(book.memory_bytes(), 1450U);
  book.leave("job2");
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBookMemory, WhoIsAloneGetsWhatItNeeds) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(10, "large", 5000));
  book.enqueue(made_job(2), kNormal, memory(10));
  EXPECT_NE(book.admit(), nullptr);
  EXPECT_EQ(book.admit(), nullptr);
}

TEST(JobBookMemory, APauseKeepsTheMemoryAndTheLongestPausedIsParkedFirst) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  for (int i = 1; i <= 3; ++i) {
    book.enqueue(made_job(i), kNormal, memory(400));
    ASSERT_NE(book.admit(), nullptr);
  }
  book.pause("job2");
  book.pause("job1");
  EXPECT_EQ(book.memory_bytes(), 1200U);
  EXPECT_TRUE(book.take_parkable().empty());  // Nobody waits.
  book.enqueue(made_job(4), kNormal, memory(700));
  EXPECT_EQ(book.admit(), nullptr);
  EXPECT_EQ(book.take_parkable(), std::vector<std::string>{"job2"});
  EXPECT_TRUE(book.take_parkable().empty());  // It is under way.
  book.keep("job2");                          // It could not be saved.
  EXPECT_EQ(book.take_parkable(), std::vector<std::string>{"job2"});
  book.leave("job2");
  EXPECT_NE(book.admit(), nullptr);
}

TEST(JobBookMemory, OneThatGoesOnIsNotParked) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(900));
  ASSERT_NE(book.admit(), nullptr);
  book.pause("job1");
  book.claim("job1", kNormal);
  book.enqueue(made_job(2), kNormal, memory(900));
  EXPECT_EQ(book.admit(), nullptr);
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST(JobBookMemory, NobodyIsParkedInVain) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(1100));
  book.enqueue(made_job(2), kNormal, memory(200));
  ASSERT_NE(book.admit(), nullptr);
  ASSERT_NE(book.admit(), nullptr);
  book.pause("job2");
  book.enqueue(made_job(3), kNormal, memory(500));  // The one that runs leaves 400.
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST(JobBookMemory, PreviewsHaveNoFileToGoOnFrom) {
  JobBook book(BookLimits{.memory_max_bytes = kMost});
  book.enqueue(made_job(1, true), kPreview, memory(900));
  ASSERT_NE(book.admit(), nullptr);
  book.pause("job1");
  book.enqueue(made_job(2), kNormal, memory(900));
  EXPECT_EQ(book.admit(), nullptr);
  EXPECT_TRUE(book.take_parkable().empty());
}

TEST(JobBookMemory, PausedPreviewsCountAsPreviews) {
  JobBook book(BookLimits{.previews_max = 1});
  book.enqueue(made_job(1, true), kPreview);
  ASSERT_NE(book.admit(), nullptr);
  book.pause("job1");
  EXPECT_FALSE(book.has_room(kPreview));
}

TEST(JobBookMemory, WithoutAQueueThereIsRoomOnlyForWhatMayStart) {
  JobBook book(BookLimits{.queue_max = 0, .memory_max_bytes = kMost});
  book.enqueue(made_job(1), kNormal, memory(900));
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_TRUE(book.has_room(kNormal, memory(600)));
  EXPECT_FALSE(book.has_room(kNormal, memory(601)));
}

TEST(JobBookMemory, OneKeyLeavesPreviewsForOthers) {
  JobBook book(BookLimits{.previews_max = 3, .previews_of_owner_max = 2});
  book.enqueue(made_job(1, true, "a"), kPreview);
  ASSERT_NE(book.admit(), nullptr);
  EXPECT_TRUE(book.has_room(kPreview, {}, "a"));
  book.enqueue(made_job(2, true, "a"), kPreview);
  EXPECT_FALSE(book.has_room(kPreview, {}, "a"));
  EXPECT_TRUE(book.has_room(kPreview, {}, "b"));
  EXPECT_TRUE(book.has_room(kPreview));
  book.leave("job1");
  EXPECT_TRUE(book.has_room(kPreview, {}, "a"));
}

}  // namespace
