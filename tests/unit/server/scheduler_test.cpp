#include "server/jobs/scheduler.h"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace {

using server::Rank;
using server::Scheduler;
using server::SliceSource;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

double thread_seconds() {
  timespec time = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Age of a source that has an image and no clock.
struct Aged {
  explicit Aged(std::int64_t its_age) : age(its_age) {}
  std::int64_t age;
};

/// Uses CPU time in slices, as often as requested, up to a maximum. Shares with others like it,
/// unless it has an age.
class Burner : public SliceSource {
 public:
  explicit Burner(double slice_seconds, int slices_max = 1 << 30)
      : slice_seconds_(slice_seconds), left_(slices_max) {}
  Burner(double slice_seconds, Aged age) : Burner(slice_seconds) {
    turn_ = {.age = age.age, .is_timed = false};
  }
  bool run_slice() override {
    if (left_.fetch_sub(1) <= 0) {
      left_ = 0;
      return false;
    }
    const double end = thread_seconds() + slice_seconds_;
    while (thread_seconds() < end) {
    }
    ++done_;
    return true;
  }
  Turn turn() const override { return turn_; }
  int done() const { return done_; }
  void allow(int slices) { left_ += slices; }

 private:
  const double slice_seconds_;
  Turn turn_ = {.is_timed = true};
  std::atomic<int> left_;
  std::atomic<int> done_ = 0;
};

/// Writes its name into a record for each slice. Its first pass takes two slices, all of it four.
class Staged : public SliceSource {
 public:
  Staged(char name, std::int64_t age, std::string& record)
      : name_(name), age_(age), record_(record) {}
  bool run_slice() override {
    if (done_ == 4) {
      return false;
    }
    ++done_;
    record_ += name_;
    return true;
  }
  Turn turn() const override { return {.age = age_, .has_image = done_ >= 2}; }

 private:
  const char name_;
  const std::int64_t age_;
  std::string& record_;
  std::atomic<int> done_ = 0;
};

/// Occupies the only thread until it is opened, so that the others are all there when it is free.
class Gate : public SliceSource {
 public:
  bool run_slice() override {
    is_reached_ = true;
    while (!is_open_) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    return false;
  }
  bool is_reached() const { return is_reached_; }
  void open() { is_open_ = true; }

 private:
  std::atomic<bool> is_reached_ = false;
  std::atomic<bool> is_open_ = false;
};

template <typename Condition>
bool eventually(const Condition& condition) {
  const auto deadline = Clock::now() + milliseconds(30000);
  while (!condition() && Clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  return condition();
}

TEST(Scheduler, TenantsGetEqualCpuTimeForAnyNumberOfJobs) {
  Scheduler scheduler(2);
  std::vector<std::shared_ptr<Burner>> many;
  for (int i = 0; i < 6; ++i) {
    many.push_back(std::make_shared<Burner>(0.002));
    scheduler.add(many.back(), {}, "many");
  }
  const auto one = std::make_shared<Burner>(0.002);
  scheduler.add(one, {}, "one");
  ASSERT_TRUE(eventually([&] { return one->done() >= 120; }));
  int of_many = 0;
  for (const auto& burner : many) {
    of_many += burner->done();
    // Each of them gets a sixth of that.
    EXPECT_GT(burner->done(), 10);
  }
  scheduler.stop();
  // Both start equal; at the end they differ by at most the active slices, of 0.24 s.
  EXPECT_GT(of_many, 90);
  EXPECT_LT(of_many, 160);
}

TEST(Scheduler, ReturningTenantHasNoCredit) {
  Scheduler scheduler(1);
  const auto first = std::make_shared<Burner>(0.002);
  scheduler.add(first, {}, "first");
  ASSERT_TRUE(eventually([&] { return first->done() >= 100; }));
  const auto second = std::make_shared<Burner>(0.002);
  const int before = first->done();
  scheduler.add(second, {}, "second");
  ASSERT_TRUE(eventually([&] { return second->done() >= 50; }));
  // If its earlier time counted, the first would have waited for 100 slices.
  EXPECT_GT(first->done() - before, 25);
  scheduler.stop();
}

TEST(Scheduler, EqualJobsGetEqualCpuTimeForAnySlices) {
  Scheduler scheduler(2);
  const auto fine = std::make_shared<Burner>(0.001);
  const auto coarse = std::make_shared<Burner>(0.004);
  scheduler.add(fine, {});
  scheduler.add(coarse, {});
  ASSERT_TRUE(eventually([&] { return coarse->done() >= 60; }));
  const double ratio = fine->done() * 0.001 / (coarse->done() * 0.004);
  scheduler.stop();
  // Both start equal; at the end they differ by at most the active slices, of 0.24 s.
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 1.25);
}

TEST(Scheduler, HigherPriorityIsServedExclusively) {
  Scheduler scheduler(1);
  const auto low = std::make_shared<Burner>(0.001);
  scheduler.add(low, {.priority = 0});
  ASSERT_TRUE(eventually([&] { return low->done() > 5; }));
  const auto high = std::make_shared<Burner>(0.001, 50);
  scheduler.add(high, {.priority = 1});
  const int before = low->done();
  ASSERT_TRUE(eventually([&] { return high->done() >= 49; }));
  // The slice that ran when it arrived, and one already selected.
  EXPECT_LE(low->done() - before, 2);
}

TEST(Scheduler, HigherPriorityIsServedExclusivelyByEveryThread) {
  Scheduler scheduler(2);
  const auto high = std::make_shared<Burner>(0.0001);
  const auto low = std::make_shared<Burner>(0.0001);
  scheduler.add(high, {.priority = 1});
  scheduler.add(low, {.priority = 0}, "another tenant");
  ASSERT_TRUE(eventually([&] { return high->done() >= 500; }));
  scheduler.stop();
  EXPECT_EQ(low->done(), 0);
}

TEST(Scheduler, PreviewPrecedesAnyPriority) {
  Scheduler scheduler(1);
  const auto normal = std::make_shared<Burner>(0.001);
  scheduler.add(normal, {.priority = 100});
  ASSERT_TRUE(eventually([&] { return normal->done() > 5; }));
  const auto preview = std::make_shared<Burner>(0.001, 50);
  scheduler.add(preview, {.is_preview = true, .priority = -100});
  const int before = normal->done();
  ASSERT_TRUE(eventually([&] { return preview->done() >= 49; }));
  EXPECT_LE(normal->done() - before, 2);
}

TEST(Scheduler, NewSourceDoesNotStarveEarlierOnes) {
  Scheduler scheduler(1);
  const auto old = std::make_shared<Burner>(0.001);
  scheduler.add(old, {});
  ASSERT_TRUE(eventually([&] { return old->done() > 200; }));
  const auto fresh = std::make_shared<Burner>(0.001);
  scheduler.add(fresh, {});
  const int before = old->done();
  ASSERT_TRUE(eventually([&] { return fresh->done() >= 50; }));
  EXPECT_GE(old->done() - before, 40);
}

TEST(Scheduler, SourceWithoutWorkLeavesTheThreadsToOthers) {
  Scheduler scheduler(2);
  const auto empty = std::make_shared<Burner>(0.001, 0);
  const auto busy = std::make_shared<Burner>(0.001);
  scheduler.add(empty, {.priority = 100});
  scheduler.add(busy, {});
  EXPECT_TRUE(eventually([&] { return busy->done() > 100; }));
  empty->allow(5);  // Found although the threads always have other work.
  EXPECT_TRUE(eventually([&] { return empty->done() == 5; }));
}

TEST(Scheduler, FindsNewWorkOfTheOnlySource) {
  Scheduler scheduler(1);
  const auto source = std::make_shared<Burner>(0.0001, 1);
  scheduler.add(source, {});
  ASSERT_TRUE(eventually([&] { return source->done() == 1; }));
  source->allow(1);
  EXPECT_TRUE(eventually([&] { return source->done() == 2; }));
}

TEST(Scheduler, ThreadsAreIdleWhileJobsHaveNoSlices) {
  Scheduler scheduler(2);
  std::this_thread::sleep_for(milliseconds(60));
  EXPECT_EQ(scheduler.times().idle_seconds, 0);  // nothing to wait for
  scheduler.add(std::make_shared<Burner>(0.001, 1), {});
  EXPECT_TRUE(eventually([&] { return scheduler.times().idle_seconds > 0.1; }));
  EXPECT_GE(scheduler.times().cpu_seconds, 0.001);
}

TEST(Scheduler, NothingRunsAfterRemove) {
  Scheduler scheduler(2);
  const auto source = std::make_shared<Burner>(0.001);
  scheduler.add(source, {});
  ASSERT_TRUE(eventually([&] { return source->done() > 10; }));
  scheduler.remove(*source);
  const int after = source->done() + 2;  // one may be active on each thread
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_LE(source->done(), after);
  EXPECT_EQ(scheduler.active_count(), 0);
}

TEST(Scheduler, ChangedPriorityAppliesToTheNextSlice) {
  Scheduler scheduler(1);
  const auto a = std::make_shared<Burner>(0.001);
  const auto b = std::make_shared<Burner>(0.001);
  scheduler.add(a, {.priority = 1});
  scheduler.add(b, {.priority = 0});
  ASSERT_TRUE(eventually([&] { return a->done() > 20; }));
  scheduler.set_rank(*b, {.priority = 2});
  const int before = a->done();
  ASSERT_TRUE(eventually([&] { return b->done() > 50; }));
  EXPECT_LE(a->done() - before, 2);
}

TEST(Scheduler, ReportsTheNextSourceAndCountsWorkServedElsewhere) {
  Scheduler scheduler(1);
  const auto none = [] { return std::make_shared<Burner>(0.001, 0); };
  const auto low = none();
  const auto first = none();
  const auto second = none();
  const auto preview = none();
  scheduler.add(low, Rank{.is_preview = false, .priority = -1}, "a");
  scheduler.add(first, {}, "a");
  scheduler.add(second, {}, "b");
  scheduler.add(preview, Rank{.is_preview = true, .priority = 0}, "a");
  const auto is_turn_of = [&](const std::vector<std::shared_ptr<SliceSource>>& wanted) {
    return eventually([&] { return scheduler.in_turn() == wanted; });  // requested slices run
  };
  scheduler.charge(*second, 1);
  EXPECT_TRUE(is_turn_of({preview, first, second, low}));
  scheduler.charge(*first, 2);
  EXPECT_TRUE(is_turn_of({preview, second, first, low}));
}

/// Runs the sources, which were added in this order, to their end.
template <typename... Sources>
void run_all(Scheduler& scheduler, const Sources&... sources) {
  const auto gate = std::make_shared<Gate>();
  scheduler.add(gate, Rank{.is_preview = true, .priority = 0});
  ASSERT_TRUE(eventually([&] { return gate->is_reached(); }));
  (scheduler.add(sources, {}), ...);
  gate->open();
  scheduler.remove(*gate);
  const auto last = std::make_shared<Burner>(0.0001);
  scheduler.add(last, {.priority = -1});  // Its turn comes when the others have no more slices.
  ASSERT_TRUE(eventually([&] { return last->done() > 0; }));
  scheduler.stop();
}

TEST(Scheduler, FirstPassOfEachJobComesFirst) {
  Scheduler scheduler(1);
  std::string record;
  run_all(scheduler, std::make_shared<Staged>('c', 3, record),
          std::make_shared<Staged>('a', 1, record), std::make_shared<Staged>('b', 2, record));
  EXPECT_EQ(record.substr(0, 6), "aabbcc");
  EXPECT_EQ(record.size(), 12U);
}

TEST(Scheduler, YoungerJobsOfATenantGetASixteenthOfItsTime) {
  Scheduler scheduler(2);
  const auto oldest = std::make_shared<Burner>(0.001, Aged(1));
  const auto second = std::make_shared<Burner>(0.001, Aged(2));
  const auto third = std::make_shared<Burner>(0.001, Aged(3));
  for (const auto& job : {third, oldest, second}) {
    scheduler.add(job, {});
  }
  ASSERT_TRUE(eventually([&] { return second->done() + third->done() >= 40; }));
  // 15 times as many; each of the three may be ahead by its slices that run, at most 2.
  const int followers = second->done() + third->done();
  EXPECT_GT(oldest->done(), 15 * (followers - 6));
  EXPECT_LT(oldest->done(), 15 * (followers + 6));
  scheduler.remove(*oldest);
  const int before = third->done();
  const int done = second->done();
  ASSERT_TRUE(eventually([&] { return second->done() - done >= 300; }));
  EXPECT_LT(third->done() - before, 40);  // 20, or ahead by some
  scheduler.stop();
}

TEST(Scheduler, JobsWhoseClockRunsGetAsMuchAsTheOldest) {
  Scheduler scheduler(1);
  const auto oldest = std::make_shared<Burner>(0.001, Aged(1));
  const auto young = std::make_shared<Burner>(0.001, Aged(2));
  const auto timed = std::make_shared<Burner>(0.001);
  scheduler.add(oldest, {});
  scheduler.add(young, {});
  scheduler.add(timed, {});
  ASSERT_TRUE(eventually([&] { return timed->done() >= 150; }));
  EXPECT_GT(oldest->done(), 120);
  EXPECT_LT(oldest->done(), 180);
  EXPECT_LT(young->done(), 30);  // 10, or ahead by some
  scheduler.stop();
}

TEST(Scheduler, AgeDoesNotCountBetweenTenants) {
  Scheduler scheduler(1);
  const auto old = std::make_shared<Burner>(0.001, Aged(1));
  const auto young = std::make_shared<Burner>(0.001, Aged(2));
  scheduler.add(old, {}, "a");
  scheduler.add(young, {}, "b");
  ASSERT_TRUE(eventually([&] { return young->done() >= 100; }));
  EXPECT_GT(old->done(), 70);
  EXPECT_LT(old->done(), 140);
  scheduler.stop();
}

}  // namespace
