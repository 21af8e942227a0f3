#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "core/base/cpu_time.h"
#include "server/jobs/denoise_service.h"
#include "server/observe/cpu_meter.h"

namespace {

using server::CpuMeter;
using server::DenoiseService;
using std::chrono::milliseconds;
using std::chrono::seconds;

void burn(double cpu_seconds) {
  const double end = core::thread_cpu_seconds() + cpu_seconds;
  while (core::thread_cpu_seconds() < end) {
  }
}

TEST(DenoiseBudget, IsATwentiethOfTheCpuTimeOfTheJob) {
  EXPECT_FALSE(DenoiseService::is_due(seconds(600), 18, 1));
  EXPECT_TRUE(DenoiseService::is_due(seconds(600), 19, 1));
}

TEST(DenoiseBudget, DoesNotDependOnTheTimeThatAStarvedThreadWaits) {
  // Denoised in a minute, for one CPU second of it; the job has had 20 since.
  EXPECT_TRUE(DenoiseService::is_due(seconds(20), 20, 1));
}

TEST(DenoiseBudget, KeepsAPaceOnAFastMachine) {
  EXPECT_FALSE(DenoiseService::is_due(milliseconds(1900), 100, 0.1));
  EXPECT_TRUE(DenoiseService::is_due(seconds(2), 100, 0.1));
}

TEST(DenoiseBudget, BeginsAnewWithAFilmThatIsRenderedAgain) {
  EXPECT_TRUE(DenoiseService::is_due(milliseconds(1), -50, 1));
}

TEST(CpuMeter, CountsAllThreadsAndNoWaiting) {
  CpuMeter meter;
  const auto parallel = meter.counted(core::parallel_for(4));
  parallel(4, [](int) { std::this_thread::sleep_for(milliseconds(50)); });
  EXPECT_LT(meter.seconds(), 0.02);
  parallel(4, [](int) { burn(0.05); });
  EXPECT_GE(meter.seconds(), 0.2);
  EXPECT_LT(meter.seconds(), 0.25);
}

TEST(CpuMeter, CountsTheThreadItself) {
  const CpuMeter meter;
  burn(0.05);
  EXPECT_GE(meter.seconds(), 0.05);
  EXPECT_LT(meter.seconds(), 0.07);
}

}  // namespace
