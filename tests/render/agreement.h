/// Tests whether two estimators have the same expected image: compares blocks of images of 16 seeds
/// with 16 other seeds by Welch's t-test. The p-values of all blocks are uniform
/// (Kolmogorov-Smirnov), and none is too small.
#pragma once

#include <vector>

#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace test_support {

inline constexpr int kAgreementSeeds = 16;
inline constexpr int kBlocksAcross = 4;
inline constexpr std::size_t kBlocks = kBlocksAcross * kBlocksAcross;

/// Sums of each block in each of three channels, over the seeds.
using Blocks = std::vector<Moments>;

/// Renders a square view with seeds first_seed, first_seed + 1, ...
Blocks blocks_of(core::View view, int first_seed, int samples);

struct Agreement {
  double least_p = 1;
  double ks = 1;
};
/// One channel alone: channels of one block are correlated.
Agreement compare(const Blocks& a, const Blocks& b, std::size_t channel = 1);

}  // namespace test_support
