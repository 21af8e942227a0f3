#include "core/render/pass_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace {

TEST(PassPlan, LooksAreAtPowersOfTwoAndHalfAbovePerReplicate) {
  std::vector<int> looks;
  for (int at = core::next_look(0, 2); at <= 64; at = core::next_look(at, 2)) {
    looks.push_back(at);
  }
  EXPECT_EQ(looks, (std::vector<int>{2, 4, 6, 8, 12, 16, 24, 32, 48, 64}));
}

TEST(PassPlan, LooksAndPassesOfSetsAreWholeSets) {
  std::vector<int> looks;
  for (int at = core::next_look(0, 2, 50); at <= 400; at = core::next_look(at, 2, 50)) {
    looks.push_back(at);
  }
  // 2^k and 1.5 * 2^k samples per replicate: 2 ... 48, 64, 96, 128, 192, 256, 384 in all.
  EXPECT_EQ(looks, (std::vector<int>{50, 100, 150, 200, 300, 400}));
  for (const int unit : {4, 32, 50, 1600}) {
    const int most = core::whole_sets(65536, unit);
    int at = 0;
    while (at < most) {
      const int end = core::pass_end(at, most, 2, unit);
      ASSERT_GT(end, at);
      ASSERT_EQ(end % unit, 0);
      ASSERT_LE(end, core::next_look(at, 2, unit));
      ASSERT_LE(end - at, std::max(at / 8, unit));
      at = end;
    }
    EXPECT_EQ(at, most);
    EXPECT_EQ(core::pass_end(5, most, 2, unit), unit == 4 ? 8 : unit) << "a set cut by a cancellation is completed";
  }
  EXPECT_EQ(core::whole_sets(30, 50), 30) << "less than a set is all that there may be";
}

TEST(PassPlan, PassesGrowByAnEighthAtMostAndMeetEveryLook) {
  for (const int most : {1, 2, 37, 1000, 65536}) {
    int at = 0;
    while (at < most) {
      const int end = core::pass_end(at, most, 2);
      ASSERT_GT(end, at);
      ASSERT_LE(end, most);
      ASSERT_LE(end, core::next_look(at, 2));
      ASSERT_LE(end - at, std::max(at / 8, 2));
      at = end;
    }
  }
}

}  // namespace
