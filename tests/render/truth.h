/// Compares images with closed forms ("truths"): |z| < 4, and noise within a relative cap.
#pragma once

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace test_support {

struct Variant {
  std::string name;
  core::EstimatorSettings estimator;
  core::SamplerType sampler = core::SamplerType::kSobol;
  core::LightSamplerType light_sampler = core::LightSamplerType::kTree;
};

/// Every strategy, MIS rule, roulette, splitting, sampler and light sampler of the registries, with
/// defaults for the others, and strategies with every light sampler.
std::vector<Variant> variants();

/// Finds emitters only by chance.
inline bool is_blind(const Variant& v) {
  return v.estimator.strategy != core::Strategy::kMis &&
         v.estimator.strategy != core::Strategy::kLight;
}

/// Skips shadow rays at random where the contribution is small: the noise is by design, so only z
/// applies.
inline bool culls_shadow_rays(const Variant& v) {
  return v.estimator.roulette == core::RouletteType::kThreshold;
}

inline void apply(const Variant& v, core::View& view) {
  view.settings.estimator = v.estimator;
  view.settings.sampler = v.sampler;
  view.settings.light_sampler = v.light_sampler;
}

/// Expects the mean of the green channel to equal the truth: z below 4 (false alarm 6e-5), and a
/// standard error of at most half of the relative cap, so that an error of four caps fails and one
/// of two caps fails in every second image. noise: largest standard error instead, for strategies
/// that find small emitters only by chance. scene: relative error of the scene (round shapes made
/// of triangles).
inline void expect_truth(const Picture& picture, double truth, double cap, const std::string& what,
                         double scene = 0, double noise = 0) {
  const auto mean = static_cast<double>(picture.mean().g);
  const auto error = static_cast<double>(picture.standard_error().g);
  const double rounding = 3e-6 * truth;
  const double off = std::fabs(mean - truth);
  EXPECT_LT(off, 4 * error + rounding + scene * truth)
      << what << ": " << mean << " +- " << error << " for " << truth;
  EXPECT_LE(error, (noise > 0 ? noise : cap / 2) * truth) << what << " is too noisy for a decision";
  EXPECT_EQ(picture.progress.rejected_samples, 0U) << what;
}

}  // namespace test_support
