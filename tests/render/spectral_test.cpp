// Spectral images: white stays white, one bounce equals that in RGB, several match the spectra,
// bits are independent of threads. z-tests have a limit of 4.5 standard deviations, a false alarm
// rate of 7e-6 each.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/color/wavelengths.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;
using core::Wavelengths;
using test_support::Picture;

constexpr double kSigmas = 4.5;

core::View inside_sphere(const core::MaterialDescription& material) {
  core::View view = test_support::view_of(
      test_support::scene_of({material}, {test_support::sphere({0, 0, 0}, 1, 8, true, 0)}), 16, 16);
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  view.settings.spectral = true;
  return view;
}

core::View outside_sphere(const core::MaterialDescription& material) {
  core::View view = test_support::view_of(
      test_support::scene_of({material}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}), 16,
      16);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 20);  // the ball fills the image
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.spectral = true;
  return view;
}

/// Mean over the wavelengths of spectrum(values), as a colour.
template <typename Spectrum>
Rgb expected(Spectrum&& spectrum) {
  constexpr int kSteps = 5000;
  std::array<double, 3> sum{};
  for (int i = 0; i < kSteps; ++i) {
    const Wavelengths at((static_cast<float>(i) + 0.5F) / kSteps);
    const Rgb color = at.color(spectrum(at));
    for (int c = 0; c < 3; ++c) {
      sum[static_cast<std::size_t>(c)] += static_cast<double>(color[c]) / kSteps;
    }
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

/// The largest difference in standard errors, minus the tolerance of the geometry.
double largest_z(const Picture& picture, Rgb truth, double slack = 1e-5) {
  double z = 0;
  for (int c = 0; c < 3; ++c) {
    const double off =
        std::fabs(static_cast<double>(picture.mean()[c]) - static_cast<double>(truth[c]));
    z = std::max(z, (off - slack) / static_cast<double>(picture.standard_error()[c]));
  }
  return z;
}

TEST(Spectral, OneBounceHasTheColorOfRgb) {
  const Rgb albedo = {0.7F, 0.3F, 0.1F};
  core::View view = outside_sphere(test_support::lambert(albedo));
  view.settings.max_depth = 1;
  const Picture picture = test_support::render(view, 256);
  EXPECT_LT(largest_z(picture, albedo), kSigmas);
  for (int c = 0; c < 3; ++c) {
    EXPECT_LT(picture.standard_error()[c], 2e-3F);
  }
  // The planted fault: one part in a hundred.
  EXPECT_GT(largest_z(picture, albedo * 1.01F), kSigmas);
}

TEST(Spectral, ManyBouncesOfGreyEqualThoseOfRgb) {
  core::MaterialDescription lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = {0.5F, 0.3F, 0.1F};
  core::View view = inside_sphere(lamp);
  view.settings.max_depth = 32;
  const Picture picture = test_support::render(view, 128);
  EXPECT_LT(largest_z(picture, {1, 0.6F, 0.2F}), kSigmas);  // L_e / (1 - rho)
  EXPECT_GT(largest_z(picture, {1, 0.6F, 0.21F}), kSigmas);
}

TEST(Spectral, ManyBouncesOfColorFollowItsSpectrum) {
  const Rgb albedo = {0.8F, 0.4F, 0.2F};
  core::MaterialDescription lamp = test_support::lambert(albedo);
  lamp.emissive = Rgb(0.3F);
  core::View view = inside_sphere(lamp);
  view.settings.max_depth = 48;
  const Rgb truth = expected([&](const Wavelengths& at) {
    const Rgb rho = at.values(albedo);
    return Rgb{0.3F / (1 - rho.r), 0.3F / (1 - rho.g), 0.3F / (1 - rho.b)};
  });
  const Picture picture = test_support::render(view, 64);
  EXPECT_LT(largest_z(picture, truth, 1e-4), kSigmas);
  // In RGB it would be 0.3 / (1 - rho): for a spectrum that is known only by the colour of one
  // reflection, many reflections have another colour.
  EXPECT_GT(largest_z(picture, {1.5F, 0.5F, 0.375F}, 1e-4), kSigmas);
}

TEST(Spectral, AbsorptionMatchesTheColorAtTheGivenDistance) {
  core::MaterialDescription m = test_support::lambert(Rgb(1));
  m.metallic = 0;
  m.roughness = 0;
  m.transmission = 1;
  m.ior = 1;  // no refraction
  m.specular = 0;
  m.thickness = 1;
  m.attenuation_color = {0.6F, 0.3F, 0.2F};
  m.attenuation_distance = 2;
  core::View view = test_support::view_of(
      test_support::scene_of({m}, {test_support::sphere({0, 0, 0}, 1, 64, false, 0)}), 4, 4);
  test_support::look_at(view, {0, 0, 30}, {0, 0, 0}, 0.2F);  // 2 m through the centre
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 4;
  view.settings.spectral = true;
  EXPECT_LT(largest_z(test_support::render(view, 1024), m.attenuation_color, 2e-3), kSigmas);
}

TEST(Spectral, LosslessDispersiveBallsAreInvisible) {
  for (const float roughness : {0.0F, 0.5F}) {
    core::MaterialDescription m = test_support::lambert(Rgb(1));
    m.metallic = 0;
    m.roughness = roughness;
    m.transmission = 1;
    m.ior = 1.5F;
    m.specular = 1;
    m.thickness = 1;
    m.dispersion = 2;
    core::View view = outside_sphere(m);
    view.settings.max_depth = 128;
    const Picture picture = test_support::render(view, 64);
    // Tables of energy compensation: the same tolerance as for RGB (furnace_test.cpp).
    EXPECT_LT(largest_z(picture, Rgb(1), roughness > 0 ? 2e-2 : 1e-3), kSigmas) << roughness;
    EXPECT_LT(core::max_component(picture.standard_error()), 2e-2F) << roughness;
    EXPECT_EQ(picture.progress.rejected_samples, 0U);
  }
}

TEST(Spectral, BitsDoNotDependOnThreads) {
  core::SceneDescription scene = test_support::cornell();
  scene.materials[0].dispersion = 0.5F;
  core::View view = test_support::view_of(std::move(scene), 40, 40);
  view.settings.spectral = true;
  const std::string one = test_support::render(view, 8, 1).film->digest();
  EXPECT_EQ(test_support::render(view, 8, 3).film->digest(), one);
  view.settings.spectral = false;
  EXPECT_NE(test_support::render(view, 8, 1).film->digest(), one);
}

TEST(Spectral, AuxiliaryLayersEqualThoseOfRgb) {
  core::View view = test_support::view_of(test_support::cornell(), 24, 24);
  const Picture colors = test_support::render(view, 4);
  view.settings.spectral = true;
  const Picture spectral = test_support::render(view, 4);
  for (std::size_t i = 0; i < colors.snapshot.aux.size(); ++i) {
    EXPECT_EQ(colors.snapshot.aux[i].albedo, spectral.snapshot.aux[i].albedo) << i;
  }
}

TEST(Spectral, DirectEqualsPathAtDepthOne) {
  core::View view = test_support::view_of(test_support::cornell(), 24, 24);
  view.settings.spectral = true;
  view.settings.max_depth = 1;
  view.wave_width = 0;  // direct has no waves, which round differently
  const std::string path = test_support::render(view, 8).film->digest();
  view.settings.integrator = "direct";
  EXPECT_EQ(test_support::render(view, 8).film->digest(), path);
}

}  // namespace
