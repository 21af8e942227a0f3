// The memory limit of the process, and requests that wait for memory.
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/cgroup.h"
#include "server/observe/machine_memory.h"
#include "server/observe/memory_gate.h"
#include "server/scenes/single_flight_cache.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::MemoryGate;
using server::SingleFlightCache;
using server::usable_memory_bytes;
using std::chrono::milliseconds;

class MachineMemory : public testing::Test {
 protected:
  void put(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = folder.file(path);
    std::filesystem::create_directories(file.parent_path());
    test_support::write_file(file, text);
  }
  std::uint64_t usable() const { return usable_memory_bytes(folder.file("")); }

  test_support::TemporaryFolder folder;
};

TEST_F(MachineMemory, IsThatOfTheMachineWithoutALimit) {
  EXPECT_EQ(usable(), 0U);
  put("proc/meminfo", "MemTotal:       1000 kB\nMemFree:         10 kB\n");
  put("proc/self/cgroup", "0::/user.slice/a.service\n");
  put("sys/fs/cgroup/user.slice/a.service/memory.max", "max\n");
  EXPECT_EQ(usable(), 1024000U);
}

TEST_F(MachineMemory, IsTheSmallestLimitOfTheEnclosingGroups) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "0::/pod/container\n");
  put("sys/fs/cgroup/pod/container/memory.max", "500000\n");
  EXPECT_EQ(usable(), 500000U);
  put("sys/fs/cgroup/pod/memory.max", "400000\n");
  EXPECT_EQ(usable(), 400000U);
}

TEST_F(MachineMemory, LimitInsideAContainerIsAtTheMount) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "0::/\n");
  put("sys/fs/cgroup/memory.max", "300000\n");
  EXPECT_EQ(usable(), 300000U);
}

TEST_F(MachineMemory, SupportsControlGroupsV1) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "5:cpu,cpuacct:/x\n4:hugetlb,memory:/docker/1\n");
  put("sys/fs/cgroup/memory/docker/1/memory.limit_in_bytes", "200000\n");
  EXPECT_EQ(usable(), 200000U);
}

class UsableThreads : public MachineMemory {
 protected:
  int threads() const { return core::usable_threads(folder.file("")); }
  static int machine() { return static_cast<int>(std::thread::hardware_concurrency()); }
};

TEST_F(UsableThreads, AreThoseOfTheMachineWithoutAQuota) {
  EXPECT_EQ(threads(), machine());
  put("proc/self/cgroup", "0::/pod\n");
  put("sys/fs/cgroup/pod/cpu.max", "max 100000\n");
  EXPECT_EQ(threads(), machine());
}

TEST_F(UsableThreads, AreTheQuotaRoundedUp) {
  put("proc/self/cgroup", "0::/pod/container\n");
  put("sys/fs/cgroup/pod/cpu.max", "50000 100000\n");
  EXPECT_EQ(threads(), 1);
  put("sys/fs/cgroup/pod/cpu.max", "100000000 100000\n");
  EXPECT_EQ(threads(), machine());
  put("sys/fs/cgroup/pod/container/cpu.max", "90000 100000\n");
  EXPECT_EQ(threads(), 1);
}

TEST_F(UsableThreads, FollowTheOlderControlGroups) {
  put("proc/self/cgroup", "4:memory:/a\n3:cpu,cpuacct:/a\n");
  put("sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "-1\n");
  put("sys/fs/cgroup/cpu/a/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(threads(), machine());
  put("sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "20000\n");
  EXPECT_EQ(threads(), 1);
}

TEST(MachineMemoryHere, IsKnown) { EXPECT_GT(usable_memory_bytes(), std::uint64_t{64} << 20U); }

TEST(MemoryGate, GrantsAvailableMemoryAndReclaimsIt) {
  MemoryGate gate(100);
  {
    const auto first = gate.take(60, "a");
    ASSERT_TRUE(first);
    const auto refused = gate.take(41, "a scene", milliseconds(5));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, core::ErrorCode::kUnavailable);
    EXPECT_EQ(refused.error().message,
              "a scene needs 4.1e-05 MB of memory, and 6e-05 MB of 0.0001 MB are in use "
              "(--memory); try again");
    EXPECT_TRUE(gate.take(40, "b", milliseconds(5)));
    EXPECT_EQ(gate.used_bytes(), 60U);
  }
  EXPECT_EQ(gate.used_bytes(), 0U);
}

TEST(MemoryGate, RefusesRequestsThatNeverFitAtOnce) {
  MemoryGate gate(100);
  EXPECT_EQ(gate.take(101, "a scene", std::chrono::hours(1)).error().code,
            core::ErrorCode::kTooLarge);
  auto lease = gate.take(60, "a scene");
  ASSERT_TRUE(lease);
  EXPECT_EQ(lease->grow(41, std::chrono::hours(1)).error().code, core::ErrorCode::kTooLarge);
  EXPECT_EQ(gate.used_bytes(), 60U);
}

TEST(MemoryGate, GrantsAnyAmountWithoutALimit) {
  MemoryGate gate(0);
  EXPECT_TRUE(gate.take(std::uint64_t{1} << 60U, "a"));
}

TEST(MemoryGate, ServesWaitingRequestsWhenMemoryIsFree) {
  MemoryGate gate(100);
  auto held = gate.take(100, "a");
  ASSERT_TRUE(held);
  std::jthread other([&held] {
    std::this_thread::sleep_for(milliseconds(20));
    *held = {};
  });
  EXPECT_TRUE(gate.take(50, "b", std::chrono::seconds(60)));
}

TEST(MemoryGate, CountsNamedMemoryOnceAtItsLargestSize) {
  MemoryGate gate(100);
  const server::MemoryUse hall = {.bytes = 5, .shared = {{"hall", 40}}};
  auto first = gate.take(hall, "a");
  auto second = gate.take(hall, "b");
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  EXPECT_EQ(gate.used_bytes(), 50U);
  {
    const auto larger = gate.take({.shared = {{"hall", 60}}}, "c");
    ASSERT_TRUE(larger);
    EXPECT_EQ(gate.used_bytes(), 70U);
  }
  *first = {};
  EXPECT_EQ(gate.used_bytes(), 45U);
}

TEST(MemoryGate, ReclaimsIdleMemoryOnlyWhenFull) {
  MemoryGate gate(100);
  std::vector<MemoryGate::Lease> cache;
  for (int i = 0; i < 3; ++i) {
    cache.push_back(gate.note({.bytes = 30}, MemoryGate::Kind::kIdle));
  }
  gate.add_reclaimer([&cache] {
    const bool any = !cache.empty();
    if (any) {
      cache.pop_back();
    }
    return any;
  });
  ASSERT_TRUE(gate.take(10, "a"));
  EXPECT_EQ(cache.size(), 3U);
  ASSERT_TRUE(gate.take(40, "b", milliseconds(0)));
  EXPECT_EQ(cache.size(), 2U);
  const auto most = gate.take(50, "c");
  ASSERT_TRUE(most);
  EXPECT_EQ(cache.size(), 1U);
  EXPECT_FALSE(gate.take(51, "d", milliseconds(0)));
  EXPECT_EQ(cache.size(), 1U) << "reclaimed without need";
}

/// Values of 30 bytes, each with its lease.
class IdleValues {
 public:
  explicit IdleValues(MemoryGate& gate) : gate_(gate) {
    gate.add_reclaimer([this] {
      ++asked;
      return first.drop_unused() || second.drop_unused();
    });
  }
  void add(SingleFlightCache<int>& cache, const std::string& key) {
    auto lease = gate_.note({.bytes = 30}, MemoryGate::Kind::kIdle);
    cache.put(key, {server::with_lease(std::make_shared<const int>(1), std::move(lease)), 30});
  }
  SingleFlightCache<int> first{1000};
  SingleFlightCache<int> second{1000};
  int asked = 0;

 private:
  MemoryGate& gate_;
};

// Two reclaimers of two caches each. What somebody holds is not memory that can be had.
TEST(MemoryGate, ReclaimersGoOnToTheNextCacheAndLeaveWhatIsInUse) {
  MemoryGate gate(120);
  IdleValues early(gate);
  IdleValues late(gate);
  early.add(early.first, "held");
  early.add(early.second, "early");
  late.add(late.first, "held too");
  late.add(late.second, "late");
  auto held = early.first.peek("held");
  const auto held_too = late.first.peek("held too");
  EXPECT_EQ(gate.used_bytes(), 120U);
  auto one = gate.take(30, "a", milliseconds(0));
  ASSERT_TRUE(one);
  EXPECT_EQ(early.second.count(), 0U) << "the first reclaimer's second cache";
  EXPECT_EQ(late.asked, 0) << "not before the first has nothing left";
  auto two = gate.take(30, "b", milliseconds(0));
  ASSERT_TRUE(two);
  EXPECT_EQ(late.second.count(), 0U);
  EXPECT_EQ(gate.take(30, "c", milliseconds(0)).error().code, core::ErrorCode::kUnavailable);
  EXPECT_FALSE(gate.drop_one_idle());
  EXPECT_NE(early.first.peek("held"), nullptr);
  EXPECT_NE(late.first.peek("held too"), nullptr);
  EXPECT_EQ(gate.used_bytes(), 120U) << "what is in use still counts";
  held.reset();
  EXPECT_TRUE(gate.take(30, "c", milliseconds(0)));
  EXPECT_EQ(early.first.count(), 0U);
  EXPECT_EQ(late.first.count(), 1U);
}

TEST(MemoryGate, LeaseGrowsShrinksAndChanges) {
  MemoryGate gate(100);
  auto lease = gate.take(10, "a");
  ASSERT_TRUE(lease);
  ASSERT_TRUE(lease->grow(50));
  EXPECT_EQ(gate.used_bytes(), 60U);
  lease->shrink_to(20);
  EXPECT_EQ(gate.used_bytes(), 20U);
  EXPECT_EQ(gate.try_change(*lease, {.bytes = 90}, 80), MemoryGate::Fit::kNo);
  EXPECT_EQ(gate.try_change(*lease, {.bytes = 80}, 80), MemoryGate::Fit::kYes);
  MemoryGate::change(*lease, {.bytes = 200});
  EXPECT_EQ(gate.used_bytes(), 200U);
}

TEST(MemoryGate, SmallRequestsDoNotWaitForATenantThatHoldsEverything) {
  MemoryGate gate(6400);
  const auto take = [&gate](std::uint64_t bytes, const char* tenant) {
    return gate.take({.bytes = bytes, .tenant = tenant}, "a", milliseconds(0));
  };
  const auto all = take(6400, "b");
  ASSERT_TRUE(all);
  EXPECT_FALSE(take(1, "b"));    // It holds much.
  EXPECT_FALSE(take(101, "a"));  // Beyond 1/64 of the limit.
  std::vector<core::Result<MemoryGate::Lease>> small;
  for (const char* tenant : {"c", "d", "e", "f"}) {
    ASSERT_TRUE(small.emplace_back(take(100, tenant)));
    EXPECT_FALSE(take(1, tenant));
  }
  EXPECT_FALSE(take(1, "g"));  // Beyond 1/16 together.
}

TEST(MemoryGate, FreedMemoryGoesToTheWaitingTenantThatHoldsLeast) {
  MemoryGate gate(100);
  auto first = gate.take({.bytes = 60, .tenant = "b"}, "a");
  auto second = gate.take({.bytes = 40, .tenant = "b"}, "a");
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  core::Result<MemoryGate::Lease> waited = core::Error{core::ErrorCode::kUnavailable, "", ""};
  std::jthread other(
      [&] { waited = gate.take({.bytes = 50, .tenant = "a"}, "a", std::chrono::seconds(60)); });
  std::this_thread::sleep_for(milliseconds(200));  // Until it waits.
  *second = {};
  EXPECT_FALSE(gate.take({.bytes = 30, .tenant = "b"}, "a", milliseconds(0)));
  *first = {};
  other.join();
  EXPECT_TRUE(waited);
  EXPECT_TRUE(gate.take({.bytes = 30, .tenant = "b"}, "a", milliseconds(0)));
}

TEST(MemoryGate, LeaseMayOutliveIt) {
  std::optional<MemoryGate::Lease> lease;
  {
    MemoryGate gate(100);
    lease.emplace(*gate.take(10, "a"));
  }
  lease.reset();
}

}  // namespace
