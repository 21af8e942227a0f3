#include "server/jobs/scheduler.h"

#include <atomic>
#include <chrono>
#include <ctime>
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

/// Uses CPU time in slices, as often as requested, up to a maximum.
class Burner : public SliceSource {
 public:
  explicit Burner(double slice_seconds, int slices_max = 1 << 30)
      : slice_seconds_(slice_seconds), left_(slices_max) {}
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
  int done() const { return done_; }
  void allow(int slices) { left_ += slices; }

 private:
  const double slice_seconds_;
  std::atomic<int> left_;
  std::atomic<int> done_ = 0;
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

}  // namespace
