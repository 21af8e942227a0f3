#include "core/render/task/pass_plan.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace {

template <typename Next>
std::vector<int> up_to(int most, const Next& next) {
  std::vector<int> out;
  for (int at = next(0); at <= most; at = next(at)) {
    out.push_back(at);
  }
  return out;
}

TEST(PassPlan, ErrorChecksDivideEachOctaveOfAReplicateIntoFour) {
  const auto checks = up_to(64, [](int at) { return core::next_check(at, 2); });
  EXPECT_EQ(checks, (std::vector<int>{2, 4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64}));
}

TEST(PassPlan, ErrorChecksAndPassesOfSetsAreWholeSets) {
  // 2 ... 48, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384 in total.
  EXPECT_EQ(up_to(400, [](int at) { return core::next_check(at, 2, 50); }),
            (std::vector<int>{50, 100, 150, 200, 250, 300, 350, 400}));
  for (const int unit : {4, 32, 50, 1600}) {
    const int most = core::whole_sets(65536, unit);
    int at = 0;
    while (at < most) {
      const int end = core::pass_end(at, most, 2, unit);
      ASSERT_GT(end, at);
      ASSERT_EQ(end % unit, 0);
      ASSERT_LE(end, core::next_check(at, 2, unit));
      ASSERT_LE(end - at, std::max(at / 8, unit));
      at = end;
    }
    EXPECT_EQ(at, most);
    EXPECT_EQ(core::pass_end(5, most, 2, unit), unit == 4 ? 8 : unit)
        << "a set interrupted by a cancellation is completed";
  }
  EXPECT_EQ(core::whole_sets(30, 50), 30) << "the limit is below one set";
}

TEST(PassPlan, PassesGrowByAtMostAnEighthAndIncludeEveryErrorCheck) {
  for (const int most : {1, 2, 37, 1000, 65536}) {
    int at = 0;
    while (at < most) {
      const int end = core::pass_end(at, most, 2);
      ASSERT_GT(end, at);
      ASSERT_LE(end, most);
      ASSERT_LE(end, core::next_check(at, 2));
      ASSERT_LE(end - at, std::max(at / 8, 2));
      at = end;
    }
  }
}

}  // namespace
