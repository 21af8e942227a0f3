/// Tests whether two estimators have the same expected image: compares images of 16 seeds with
/// images of 16 other seeds, in all channels.
///
/// One rule decides for every test and for every planted fault: agrees(). It combines three tests:
/// Welch's t of the whole image, which detects a small error of all the light; Welch's t of each
/// block, which detects a large error in one place; and the sum of the blocks' squared z, which
/// detects many errors of both signs. Blocks are not independent: a light path splats to several
/// of them, and all of Metropolis share one normalisation. Therefore the sum is compared with
/// itself after permutations of the seeds, which is valid for equal means even if the variances
/// differ, because both groups have the same size (Janssen 1997, "Studentized permutation tests for
/// non-i.i.d. hypotheses"). Agreement.RaisesAsManyFalseAlarmsAsItStates counts false alarms.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/support/scenes.h"

namespace test_support {

inline constexpr int kAgreementSeeds = 16;
inline constexpr std::size_t kBlocksAcross = 4;
inline constexpr std::size_t kBlocks = kBlocksAcross * kBlocksAcross;

/// Sums over the blocks of one image, [3 * block + channel], and last over the whole image.
using BlockSums = std::array<double, 3 * (kBlocks + 1)>;
/// A row for each seed.
using Blocks = std::vector<BlockSums>;

/// Renders a square view with seeds first_seed, first_seed + 1, ...
Blocks blocks_of(core::View view, int first_seed, int samples);
/// The light of paths that end at the camera: all that integrators add to the film by splats.
inline constexpr const char* kSplats = "splats";
/// The same for layers bounce:N, light:NAME and st:S,T, which it records, or kSplats; last for the
/// image.
std::vector<Blocks> layers_of(core::View view, int first_seed, int samples,
                              const std::vector<std::string>& layers);
/// A row for each replicate of one film; samples of each.
Blocks replicates_of(core::View view, int replicates, int samples);
/// a + factor * b, seed by seed: plants faults.
Blocks plus(Blocks a, double factor, const Blocks& b);

/// Smallest p-values over the channels (and blocks), multiplied by their number.
struct Agreement {
  double image = 1;
  double block = 1;
  double squares = 1;
  double error = 0;  ///< relative standard error of the difference of the images, largest channel
  /// p-value of all three.
  double p() const;
};
Agreement compare(const Blocks& a, const Blocks& b);

/// 0.1% false alarms over all comparisons of a test.
bool agrees(const Agreement& a, int comparisons);

/// Relative standard error above which a comparison does not count.
inline constexpr double kErrorMost = 0.005;
/// Expects agreement and an error of at most kErrorMost, which it prints.
void expect_agreement(const Agreement& a, int comparisons, const std::string& name);

}  // namespace test_support
