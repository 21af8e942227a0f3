// Loops on several threads: every step once, and exceptions of steps reach the caller.
#include "core/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <new>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace {

TEST(ParallelFor, DoesEveryStepOnce) {
  for (const int threads : {0, 1, 3, 100}) {
    std::vector<std::atomic<int>> done(57);
    core::parallel_for(threads)(57, [&](int i) { ++done[static_cast<std::size_t>(i)]; });
    EXPECT_TRUE(std::all_of(done.begin(), done.end(), [](const auto& n) { return n == 1; }));
  }
}

TEST(ParallelFor, ThrowsWhatAStepThrows) {
  for (const int threads : {1, 4}) {
    std::atomic<int> steps = 0;
    EXPECT_THROW(core::parallel_for(threads)(1'000'000,
                                             [&](int i) {
                                               ++steps;
                                               if (i == 10) {
                                                 throw std::bad_alloc();
                                               }
                                             }),
                 std::bad_alloc);
    EXPECT_LT(steps, 1'000'000);
    EXPECT_TRUE(threads > 1 || steps == 11);
  }
}

TEST(ParallelFor, DoesWithTheThreadsThatTheSystemStarts) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
  rlimit little = before;
  little.rlim_cur = 1;  // Stacks of threads need address space.
  std::atomic<int> steps = 0;
  const auto loop = core::parallel_for(4);
  const std::function<void(int)> step = [&](int) { ++steps; };
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &little), 0);
  loop(20, step);
  ASSERT_EQ(::setrlimit(RLIMIT_AS, &before), 0);
  EXPECT_EQ(steps, 20);
}

}  // namespace
