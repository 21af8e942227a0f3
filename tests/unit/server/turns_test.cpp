// Pools that tenants share: turns of requests, and background work.
#include "server/observe/turns.h"

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/jobs/background.h"

namespace {

using server::Background;
using server::Turns;

TEST(Turns, ATenantWithoutAPlaceIsNotKeptWaiting) {
  Turns turns(1);
  const auto first = turns.take("b", {});
  ASSERT_TRUE(first);
  EXPECT_FALSE(turns.take("b", {}, std::chrono::seconds(0)));
  const auto other = turns.take("a", {}, std::chrono::seconds(0));
  EXPECT_TRUE(other);
  EXPECT_FALSE(turns.take("c", {}, std::chrono::seconds(0))) << "at most twice as many";
}

TEST(Turns, WhoHasFewestPlacesComesFirst) {
  Turns turns(2);
  auto first = std::make_optional(turns.take("b", {}));
  auto second = std::make_optional(turns.take("b", {}));
  auto third = std::make_optional(turns.take("c", {}));
  std::vector<std::string> order;
  std::mutex mutex;
  const auto ask = [&](const std::string& tenant) {
    const auto turn = turns.take(tenant, {});
    const std::lock_guard lock(mutex);
    order.push_back(tenant);
  };
  std::thread old([&] { ask("b"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const auto fourth = turns.take("d", {});
  std::thread fresh([&] { ask("a"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  first.reset();
  fresh.join();
  EXPECT_EQ(order.front(), "a");
  second.reset();
  third.reset();
  old.join();
}

TEST(Turns, AStopEndsTheWait) {
  Turns turns(1);
  const auto held = turns.take("a", {});
  std::stop_source source;
  auto waiting = std::async(std::launch::async,
                            [&] { return turns.take("a", source.get_token(), std::nullopt); });
  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  source.request_stop();
  const auto ended = waiting.get();
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().code, core::ErrorCode::kCancelled);
}

TEST(Background, OneTenantCannotOccupyAllThreads) {
  Background background(3, 2, Background::Priority::kNormal);
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::atomic<int> running = 0;
  for (int i = 0; i < 6; ++i) {
    background.post(
        [&running, released] {
          ++running;
          released.wait();
        },
        "b");
  }
  std::promise<int> done;
  background.post([&] { done.set_value(running.load()); }, "a");
  EXPECT_LE(done.get_future().get(), 2);
  release.set_value();
  background.stop(Background::Waiting::kFinish);
  EXPECT_EQ(running, 6);
}

}  // namespace
