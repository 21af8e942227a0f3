// Guide layers for denoisers: the first rough surface behind mirrors and glass, from samples
// independent of both halves.
#include "core/render/picture/feature_pass.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/samplers/streams.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;
using test_support::quad;

core::FeaturePicture features_of(const core::View& view) {
  auto made = core::feature_pass(view, core::parallel_for(2));
  EXPECT_TRUE(made && *made);
  return std::move(**made);
}

/// Seen from 2 m in front of the origin, a few pixels wide: all rays are along -z.
core::View small_view(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  test_support::look_at(view, {0, 0, 2}, {0, 0, 0}, 0.1F);
  return view;
}

/// 4 m wide, at height z, facing the camera or away from it.
core::PrimitiveDescription wall(float z, bool faces_camera, int material) {
  return faces_camera ? quad({-2, -2, z}, {4, 0, 0}, {0, 4, 0}, material)
                      : quad({-2, -2, z}, {0, 4, 0}, {4, 0, 0}, material);
}

void expect_surface(const core::FeaturePicture& f, Rgb albedo, float normal_z, float depth_m) {
  for (std::size_t i = 0; i < f.depth_m.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(f.albedo[static_cast<std::size_t>(c)][i], albedo[c], 0.01F);
    }
    EXPECT_NEAR(f.normal[2][i], normal_z, 1e-3F);
    EXPECT_NEAR(f.depth_m[i], depth_m, 1e-3F);
    EXPECT_EQ(f.emission[0][i], 0);
    EXPECT_NEAR(f.albedo_variance[i] + f.normal_variance[i] + f.depth_variance[i], 0, 1e-5F);
  }
}

TEST(FeaturePass, ShowsTheFirstRoughSurface) {
  const core::View view = small_view(test_support::scene_of(
      {test_support::lambert({0.8F, 0.4F, 0.2F})}, {wall(0, true, 0), wall(-1, true, 0)}));
  expect_surface(features_of(view), {0.8F, 0.4F, 0.2F}, 1, 2);
}

TEST(FeaturePass, ContinuesFromAMirror) {
  core::MaterialDescription mirror;
  mirror.base_color = {0.5F, 0.5F, 0.5F};
  mirror.roughness = 0;
  const core::View view = small_view(test_support::scene_of(
      {test_support::lambert({0.8F, 0.4F, 0.2F}), mirror}, {wall(0, true, 1), wall(3, false, 0)}));
  expect_surface(features_of(view), {0.4F, 0.2F, 0.1F}, -1, 2 + 3);
}

TEST(FeaturePass, ContinuesThroughGlass) {
  core::MaterialDescription glass = test_support::lambert({1, 1, 1});
  glass.roughness = 0;
  glass.transmission = 1;
  const core::View view = small_view(test_support::scene_of(
      {test_support::lambert({0.8F, 0.4F, 0.2F}), glass}, {wall(0, true, 1), wall(-3, true, 0)}));
  expect_surface(features_of(view), {0.8F, 0.4F, 0.2F}, 1, 2 + 3);
}

TEST(FeaturePass, ShowsTheSkyWithoutASurface) {
  core::View view =
      small_view(test_support::scene_of({test_support::lambert({1, 1, 1})}, {wall(9, false, 0)}));
  view.environment = test_support::constant_sky({1, 2, 3});
  const core::FeaturePicture f = features_of(view);
  EXPECT_FLOAT_EQ(f.emission[2][0], 3);
  EXPECT_EQ(f.depth_m[0], 0);
  EXPECT_EQ(f.albedo[0][0], 0);
}

/// An emitter whose edges cross pixels: light and feature have the same expected values, and their
/// noise depends on the sample positions.
core::View lamp_view(std::uint64_t seed) {
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::emitter({1, 1, 1})},
                             {quad({-1, -0.7F, 0}, {1.7F, 0.4F, 0}, {-0.3F, 1, 0}, 0)}),
      48, 32);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 45);
  view.settings.seed = seed;
  return view;
}

/// Sum of the products of the errors of the features of seeds 1 to 5 and of one half of the images
/// of picture_seed(), over the standard deviation of that sum.
template <typename PictureSeed>
double connection(int half, const PictureSeed& picture_seed) {
  std::vector<double> truth;
  constexpr int kOthers = 60;
  for (int k = 0; k < kOthers; ++k) {
    const auto f = features_of(lamp_view(100 + static_cast<std::uint64_t>(k)));
    truth.resize(f.depth_m.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      truth[i] += static_cast<double>(f.emission[0][i]) / kOthers;
    }
  }
  double sum = 0;
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto f = features_of(lamp_view(seed));
    const auto picture = test_support::render(lamp_view(picture_seed(seed)), 32);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double product =
          (static_cast<double>(f.emission[0][i]) - truth[i]) *
          (static_cast<double>(core::half_value(picture.snapshot, i, half).mean.r) - truth[i]);
      sum += product;
      squares += product * product;
    }
  }
  return sum / std::sqrt(squares);
}

// A standard normal deviate each: beyond 3.3 once in a thousand.
TEST(FeaturePass, IsIndependentOfBothHalves) {
  const auto own = [](std::uint64_t seed) { return seed; };
  EXPECT_LT(std::fabs(connection(0, own)), 3.3);
  EXPECT_LT(std::fabs(connection(1, own)), 3.3);
}

// An image whose first half uses the stream of the features.
TEST(FeaturePass, DetectsSamplesSharedWithAHalf) {
  EXPECT_GT(connection(0, [](std::uint64_t seed) { return seed | core::kFeatureStream; }), 5);
}

// Two walls side by side whose edge crosses some of the pixels.
TEST(FeaturePass, FollowsMorePathsOnlyWhereFeaturesScatter) {
  const core::View view = small_view(test_support::scene_of(
      {test_support::lambert({0.8F, 0.4F, 0.2F}), test_support::lambert({0.2F, 0.4F, 0.8F})},
      {quad({-2, -2, 0}, {2.0004F, 0, 0}, {0, 4, 0}, 0),
       quad({0.0004F, -2, 0}, {2, 0, 0}, {0, 4, 0}, 1)}));
  const auto few = core::feature_pass(view, core::parallel_for(2), core::kQuickFeatureSamples);
  ASSERT_TRUE(few && *few);
  const core::FeaturePicture made = features_of(view);
  std::size_t steady = 0;
  for (std::size_t i = 0; i < made.depth_m.size(); ++i) {
    const bool is_steady = (*few)->albedo_variance[i] <= 2.5e-5F;
    steady += is_steady ? 1 : 0;
    EXPECT_EQ(made.albedo_variance[i] == (*few)->albedo_variance[i], is_steady) << i;
  }
  EXPECT_GT(steady, 0U);
  EXPECT_LT(steady, made.depth_m.size());
}

TEST(FeaturePass, BitsAreIndependentOfTheNumberOfThreads) {
  const core::View view = lamp_view(1);
  const auto one = core::feature_pass(view, core::parallel_for(1));
  const auto many = core::feature_pass(view, core::parallel_for(5));
  ASSERT_TRUE(one && many);
  EXPECT_EQ((*one)->emission, (*many)->emission);
  EXPECT_EQ((*one)->depth_variance, (*many)->depth_variance);
}

}  // namespace
