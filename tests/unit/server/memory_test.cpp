// What the process may use, and requests that wait for memory.
#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include "server/jobs/memory_gate.h"
#include "server/observe/machine_memory.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::MemoryGate;
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

TEST_F(MachineMemory, IsThatOfTheMachineWithoutAnyLimit) {
  EXPECT_EQ(usable(), 0U);
  put("proc/meminfo", "MemTotal:       1000 kB\nMemFree:         10 kB\n");
  put("proc/self/cgroup", "0::/user.slice/a.service\n");
  put("sys/fs/cgroup/user.slice/a.service/memory.max", "max\n");
  EXPECT_EQ(usable(), 1024000U);
}

TEST_F(MachineMemory, IsTheLeastLimitOfTheGroupsOnTheWay) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "0::/pod/container\n");
  put("sys/fs/cgroup/pod/container/memory.max", "500000\n");
  EXPECT_EQ(usable(), 500000U);
  put("sys/fs/cgroup/pod/memory.max", "400000\n");
  EXPECT_EQ(usable(), 400000U);
}

TEST_F(MachineMemory, InsideAContainerTheLimitStandsAtTheMount) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "0::/\n");
  put("sys/fs/cgroup/memory.max", "300000\n");
  EXPECT_EQ(usable(), 300000U);
}

TEST_F(MachineMemory, KnowsControlGroupsOfTheFirstVersion) {
  put("proc/meminfo", "MemTotal:       1000 kB\n");
  put("proc/self/cgroup", "5:cpu,cpuacct:/x\n4:hugetlb,memory:/docker/1\n");
  put("sys/fs/cgroup/memory/docker/1/memory.limit_in_bytes", "200000\n");
  EXPECT_EQ(usable(), 200000U);
}

TEST(MachineMemoryHere, IsKnown) { EXPECT_GT(usable_memory_bytes(), std::uint64_t{64} << 20U); }

TEST(MemoryGate, GivesWhatThereIsAndTakesItBack) {
  MemoryGate gate(100);
  {
    const auto first = gate.try_take(60);
    ASSERT_TRUE(first);
    EXPECT_FALSE(gate.try_take(41));
    EXPECT_TRUE(gate.try_take(40));
    EXPECT_EQ(gate.take(41, milliseconds(5)).error().code, core::ErrorCode::kUnavailable);
    EXPECT_EQ(gate.used_bytes(), 60U);
  }
  EXPECT_EQ(gate.used_bytes(), 0U);
}

TEST(MemoryGate, WhoIsAloneGetsAnyNumber) {
  MemoryGate gate(100);
  const auto large = gate.try_take(1000);
  EXPECT_TRUE(large);
  EXPECT_FALSE(gate.try_take(1));
}

TEST(MemoryGate, WhoWaitsIsServedWhenThereIsRoom) {
  MemoryGate gate(100);
  auto held = gate.try_take(100);
  ASSERT_TRUE(held);
  std::jthread other([&held] {
    std::this_thread::sleep_for(milliseconds(20));
    held.reset();
  });
  EXPECT_TRUE(gate.take(50, std::chrono::seconds(60)));
}

TEST(MemoryGate, ALeaseMayOutliveIt) {
  std::optional<MemoryGate::Lease> lease;
  {
    MemoryGate gate(100);
    lease.emplace(*gate.try_take(10));
  }
  lease.reset();
}

}  // namespace
