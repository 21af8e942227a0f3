#include "server/scenes/single_flight_cache.h"

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <stop_token>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace {

using Cache = server::SingleFlightCache<int>;

Cache::Made made(int value, std::uint64_t bytes = 1) {
  return {.value = std::make_shared<const int>(value), .bytes = bytes};
}

TEST(SingleFlightCache, ConcurrentRequestsMakeTheValueOnce) {
  Cache cache(100);
  std::atomic<int> makings = 0;
  std::vector<std::jthread> threads;
  std::atomic<int> right = 0;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const auto value = cache.get("a", [&]() -> core::Result<Cache::Made> {
        ++makings;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return made(7);
      });
      right += value && **value == 7 ? 1 : 0;
    });
  }
  threads.clear();
  EXPECT_EQ(makings, 1);
  EXPECT_EQ(right, 8);
}

TEST(SingleFlightCache, ErrorsAreSharedButNotKept) {
  Cache cache(100);
  const auto failed = cache.get("a", []() -> core::Result<Cache::Made> {
    return core::Error{core::ErrorCode::kNotFound, "none", ""};
  });
  EXPECT_EQ(failed.error().message, "none");
  EXPECT_TRUE(cache.get("a", []() -> core::Result<Cache::Made> { return made(1); }));
}

TEST(SingleFlightCache, WhoStillWaitsMakesTheValueThatAStoppedCallerDidNot) {
  Cache cache(100);
  std::stop_source leaver;
  std::atomic<bool> has_begun = false;
  std::jthread first([&] {
    const auto value = cache.get(
        "a",
        [&]() -> core::Result<Cache::Made> {
          has_begun = true;
          while (!leaver.stop_requested()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
          return core::Error{core::ErrorCode::kCancelled, "stopped", ""};
        },
        leaver.get_token());
    EXPECT_EQ(value.error().code, core::ErrorCode::kCancelled);
  });
  while (!has_begun) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::stop_source impatient;
  impatient.request_stop();
  const auto never = [&]() -> core::Result<Cache::Made> { return made(9); };
  EXPECT_EQ(cache.get("a", never, impatient.get_token()).error().code, core::ErrorCode::kCancelled);
  std::jthread second([&] {
    const auto value = cache.get("a", []() -> core::Result<Cache::Made> { return made(2); });
    ASSERT_TRUE(value);
    EXPECT_EQ(**value, 2);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  leaver.request_stop();
}

TEST(SingleFlightCache, EvictsTheLeastRecentlyUsedFirst) {
  Cache cache(2);
  cache.put("a", made(1));
  cache.put("b", made(2));
  EXPECT_TRUE(cache.get("a", []() -> core::Result<Cache::Made> { return made(9); }));
  cache.put("c", made(3));
  EXPECT_NE(cache.peek("a"), nullptr);
  EXPECT_EQ(cache.peek("b"), nullptr);
  EXPECT_EQ(cache.bytes(), 2U);
}

TEST(SingleFlightCache, OneValueMayExceedTheLimit) {
  Cache cache(2);
  cache.put("a", made(1));
  cache.put("big", made(2, 100));
  EXPECT_EQ(cache.peek("a"), nullptr);
  EXPECT_NE(cache.peek("big"), nullptr);
}

TEST(SingleFlightCache, AValueThatDoesNotFitIsGivenAndNotKept) {
  Cache cache(2, Cache::Oversized::kNotKept);
  cache.put("a", made(1));
  int calls = 0;
  const auto make = [&calls]() -> core::Result<Cache::Made> {
    ++calls;
    return made(7, 3);
  };
  for (int i = 0; i < 2; ++i) {
    const auto big = cache.get("big", make);
    ASSERT_TRUE(big);
    EXPECT_EQ(**big, 7);
  }
  EXPECT_EQ(calls, 2);
  EXPECT_EQ(cache.peek("big"), nullptr);
  EXPECT_NE(cache.peek("a"), nullptr) << "it pushes no other out";
  EXPECT_EQ(cache.bytes(), 1U);
  cache.put("a", made(1, 3));
  EXPECT_EQ(cache.peek("a"), nullptr) << "the older value would be wrong";
  EXPECT_EQ(cache.bytes(), 0U);
  cache.put("whole", made(1, 2));
  EXPECT_NE(cache.peek("whole"), nullptr);
}

TEST(SingleFlightCache, HeldValueOutlivesTheCache) {
  Cache::Pointer held;
  {
    Cache cache(1);
    cache.put("a", made(5));
    held = cache.peek("a");
    cache.erase_prefix("a");
    EXPECT_EQ(cache.peek("a"), nullptr);
    EXPECT_EQ(cache.bytes(), 0U);
  }
  EXPECT_EQ(*held, 5);
}

// A drop is reported only if it has freed memory.
TEST(SingleFlightCache, DropUnusedKeepsWhatIsInUse) {
  Cache cache(100);
  cache.put("held, oldest", made(1, 10));
  const Cache::Pointer oldest = cache.peek("held, oldest");
  cache.put("older", made(2, 20));
  cache.put("newer", made(3, 30));
  cache.put("held, newest", made(4, 40));
  Cache::Pointer newest = cache.peek("held, newest");
  EXPECT_TRUE(cache.drop_unused());
  EXPECT_EQ(cache.peek("older"), nullptr);
  EXPECT_EQ(cache.bytes(), 80U);
  EXPECT_TRUE(cache.drop_unused());
  EXPECT_EQ(cache.peek("newer"), nullptr);
  EXPECT_FALSE(cache.drop_unused());
  EXPECT_EQ(cache.peek("held, oldest"), oldest);
  EXPECT_EQ(cache.peek("held, newest"), newest);
  EXPECT_EQ(cache.bytes(), 50U);
  newest.reset();
  EXPECT_TRUE(cache.drop_unused());
  EXPECT_EQ(cache.bytes(), 10U);
}

TEST(SingleFlightCache, FactoryThatThrowsFreesTheKey) {
  Cache cache(10);
  EXPECT_THROW(static_cast<void>(cache.get(
                   "a", []() -> core::Result<Cache::Made> { throw std::runtime_error("no"); })),
               std::runtime_error);
  EXPECT_TRUE(cache.get("a", []() -> core::Result<Cache::Made> { return made(1); }));
}

}  // namespace
