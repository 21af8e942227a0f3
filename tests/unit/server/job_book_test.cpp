#include "server/jobs/job_book.h"

#include <gtest/gtest.h>

namespace {

using server::BookLimits;
using server::Job;
using server::JobBook;
using server::JobPointer;
using server::JobRecord;
using server::Rank;

JobPointer made_job(std::int64_t sequence, bool is_preview = false) {
  JobRecord record;
  record.view.id = "job" + std::to_string(sequence);
  record.sequence = sequence;
  if (is_preview) {
    record.view.spec.job_class = api::JobClass::kPreview;
  }
  return std::make_shared<Job>(std::move(record), Job::History::kInLog);
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

}  // namespace
