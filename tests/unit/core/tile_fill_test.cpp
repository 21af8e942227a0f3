// Which samples of a tile are traced together: squares of pixels, windows of passes.
#include "core/render/picture/tile_fill.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using core::DueSample;
using core::TileState;

/// x, y, sample.
using Sample = std::array<int, 3>;
using Groups = std::set<std::vector<Sample>>;

constexpr int kBlock = 3;

TileState tile(int replicates) {
  TileState state;
  state.rect = {32, 0, 10, 7};
  state.pixels.resize(70 * static_cast<std::size_t>(replicates));
  return state;
}

/// The groups of the slices that end at `ends`. Each pixel's statistics are accumulated in the
/// order of its samples.
Groups groups_of(TileState& state, const core::FillRule& rule, const std::vector<int>& ends) {
  Groups groups;
  for (const int end : ends) {
    EXPECT_TRUE(core::fill_tile_in_groups(
        state, rule, kBlock, end, {},
        [&](std::span<const DueSample> due, int each, std::span<core::PathSample> /*out*/) {
          std::vector<Sample> group;
          std::map<std::pair<int, int>, int> counts;
          for (const DueSample& d : due) {
            group.push_back({d.x, d.y, d.sample});
            ++counts[{d.x, d.y}];
            EXPECT_LT(std::abs(d.x - due[0].x), kBlock);
            EXPECT_LT(std::abs(d.y - due[0].y), kBlock);
            EXPECT_EQ(d.sample % rule.replicates, due[0].sample % rule.replicates)
                << "replicates are independent";
          }
          for (const auto& [pixel, count] : counts) {
            EXPECT_EQ(count, each);
          }
          EXPECT_TRUE(groups.insert(std::move(group)).second);
        }));
    EXPECT_EQ(state.samples, end);
  }
  return groups;
}

std::map<std::pair<int, int>, std::vector<int>> samples_of_pixels(const Groups& groups) {
  std::map<std::pair<int, int>, std::vector<int>> out;
  for (const auto& group : groups) {
    for (const Sample& s : group) {
      out[{s[0], s[1]}].push_back(s[2]);
    }
  }
  for (auto& [pixel, samples] : out) {
    std::sort(samples.begin(), samples.end());
  }
  return out;
}

std::vector<int> numbers(int end) {
  std::vector<int> out;
  for (int i = 0; i < end; ++i) {
    out.push_back(i);
  }
  return out;
}

TEST(GroupsOfPaths, ContainEverySampleOfEveryPixelOnce) {
  for (const int history : {1, 2, 3}) {
    const core::FillRule rule = {.replicates = 4, .step = 2 * history, .history = history};
    TileState state = tile(4);
    const Groups groups = groups_of(state, rule, {24});
    const auto pixels = samples_of_pixels(groups);
    EXPECT_EQ(pixels.size(), 70U);
    for (const auto& [pixel, samples] : pixels) {
      EXPECT_EQ(samples, numbers(24));
    }
  }
}

TEST(GroupsOfPaths, CoverTheirWholeWindow) {
  const core::FillRule rule = {.replicates = 4, .step = 6, .history = 3};
  TileState state = tile(4);
  for (const auto& group : groups_of(state, rule, {24})) {
    std::set<int> samples;
    for (const Sample& s : group) {
      samples.insert(s[2]);
    }
    const int first = *samples.begin();
    EXPECT_EQ(samples, (std::set<int>{first, first + 4, first + 8}));
    EXPECT_LT(first % 12, 4) << "windows start at multiples of 12 samples";
  }
}

TEST(GroupsOfPaths, AreIndependentOfSlicesThatEndAtWindows) {
  const core::FillRule rule = {.replicates = 4, .step = 6, .history = 3};
  TileState whole = tile(4);
  TileState cut = tile(4);
  TileState badly_cut = tile(4);
  const Groups expected = groups_of(whole, rule, {36});
  EXPECT_EQ(groups_of(cut, rule, {12, 24, 36}), expected);
  EXPECT_NE(groups_of(badly_cut, rule, {12, 20, 36}), expected)
      << "an interrupted window must be detected";
}

// A limit ends a job within a window: all samples are present, in a shorter window.
TEST(GroupsOfPaths, OfTheLastWindowMayBeShorter) {
  const core::FillRule rule = {.replicates = 2, .step = 4, .history = 4};
  TileState state = tile(2);
  const Groups groups = groups_of(state, rule, {13});
  for (const auto& [pixel, samples] : samples_of_pixels(groups)) {
    EXPECT_EQ(samples, numbers(13));
  }
  for (const auto& group : groups) {
    for (const Sample& s : group) {
      EXPECT_EQ(s[2] / 8, group[0][2] / 8) << "one window";
    }
  }
}

// Pixels get different counts, all of them whole windows of each replicate.
TEST(GroupsOfPaths, FollowAPlan) {
  const core::FillRule rule = {.replicates = 4, .step = 6, .history = 3};
  TileState state = tile(4);
  groups_of(state, rule, {12});
  state.span = {12, 24};
  for (std::size_t p = 0; p < 70; ++p) {
    state.plan.push_back({6, 6 + 6 * static_cast<std::uint32_t>(p % 4)});
  }
  const Groups groups = groups_of(state, rule, {15, 24});
  const auto pixels = samples_of_pixels(groups);
  std::size_t p = 0;
  for (int y = 0; y < 7; ++y) {
    for (int x = 32; x < 42; ++x, ++p) {
      std::vector<int> expected;
      for (int k = 6; k < 6 + 6 * static_cast<int>(p % 4); ++k) {
        expected.push_back(k / 2 * 4 + k % 2 * 2);  // half A: replicates 0 and 2 alternately
      }
      for (int k = 6; k < 6 + 6 * static_cast<int>(p % 4); ++k) {
        expected.push_back(k / 2 * 4 + k % 2 * 2 + 1);  // half B
      }
      std::sort(expected.begin(), expected.end());
      const auto found = pixels.find({x, y});
      EXPECT_EQ(found == pixels.end() ? std::vector<int>{} : found->second, expected)
          << x << " " << y;
    }
  }
  for (const auto& group : groups) {
    for (const Sample& s : group) {
      std::set<int> of_pixel;
      for (const Sample& t : group) {
        if (t[0] == s[0] && t[1] == s[1]) {
          of_pixel.insert(t[2] / 12);
        }
      }
      EXPECT_EQ(of_pixel.size(), 1U) << "one window of each pixel";
    }
  }
}

}  // namespace
