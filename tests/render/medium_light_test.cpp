// Light of an emitter in a medium: distances sampled for it, and single scattering against the
// integral along the ray. z-tests have a limit of 4 standard errors, a false alarm rate of 6e-5
// each.
#include <array>
#include <cmath>
#include <numbers>

#include "core/integrators/integrator.h"
#include "core/render/task/settle.h"
#include "core/samplers/path_sampler.h"
#include "core/sampling/equiangular.h"
#include "core/transport/medium_sample.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Moments;
using test_support::Random;

constexpr Vec3 kEye = {0, 0.2F, 4};
constexpr Vec3 kAhead = {0, 0, -1};
constexpr double kWall = 6;  // metres in front of the camera
constexpr Vec3 kLamp = {0.3F, 0.6F, 1};

TEST(Equiangular, SamplesFollowTheDensity) {
  constexpr int kSamples = 100000;
  const core::Equiangular other({}, {0, 0, 1}, 1, 7, {0.5F, 0, 3});
  for (const Vec3 point : {Vec3{0.5F, 0, 3}, Vec3{0.01F, 0, 3}, Vec3{2, 1, -4}, Vec3{0, 300, 900},
                           Vec3{0, 0.1F, 1}, Vec3{3, 0, 7}}) {
    const core::Equiangular distances({}, {0, 0, 1}, 1, 7, point);
    ASSERT_TRUE(distances.is_possible());
    std::array<double, 24> seen{};
    std::array<double, 24> expected{};
    std::array<double, 24> wrong{};
    Random random(3);
    for (int i = 0; i < kSamples; ++i) {
      const float t = distances.sample(random.uniform());
      ASSERT_GE(t, 1);
      ASSERT_LE(t, 7);
      ++seen[std::min(static_cast<std::size_t>((t - 1) * 4), seen.size() - 1)];
    }
    constexpr int kSteps = 2000;
    for (std::size_t cell = 0; cell < seen.size(); ++cell) {
      for (int k = 0; k < kSteps; ++k) {
        const float t =
            1 + (static_cast<float>(cell) + (static_cast<float>(k) + 0.5F) / kSteps) / 4;
        expected[cell] += kSamples * static_cast<double>(distances.pdf_m(t)) / (4 * kSteps);
        wrong[cell] += kSamples * static_cast<double>(other.pdf_m(t)) / (4 * kSteps);
      }
    }
    EXPECT_GT(test_support::chi2(seen, expected).p_value, 6e-5) << point.y << " " << point.z;
    if (!(point == Vec3{0.5F, 0, 3})) {
      EXPECT_LT(test_support::chi2(seen, wrong).p_value, 6e-5) << "another point is rejected";
    }
  }
  EXPECT_FALSE(core::Equiangular({}, {0, 0, 1}, 1, 7, {0, 0, 3}).is_possible());
  EXPECT_FALSE(core::Equiangular({}, {0, 0, 1}, 2, 2, {1, 0, 3}).is_possible());
}

core::FogSettings haze(float scattering, float falloff) {
  return {
      .scattering = Rgb(scattering), .absorption = Rgb(0.3F), .g = 0.5F, .height_falloff = falloff};
}

/// Light of an emitter of 1 W/sr along one ray through fog, up to a black wall.
Moments lamp_in(const core::FogSettings& fog, bool aims) {
  core::SceneDescription description = test_support::scene_of(
      {test_support::lambert({})}, {test_support::quad({-20, -20, -2}, {40, 0, 0}, {0, 40, 0}, 0)});
  core::PunctualLightDescription lamp;
  lamp.to_world = core::translation(kLamp);
  description.lights.push_back(lamp);
  const auto scene = test_support::build(std::move(description));
  core::RenderSettings settings;
  settings.fog = fog;
  const auto integrator = core::make_integrator({scene->data(), nullptr, settings, nullptr, aims});
  core::Camera::CameraRay ray;
  ray.ray.origin = kEye;
  ray.ray.direction = kAhead;
  core::PathSampler sampler(core::SamplerType::kIndependent, 2, 5, 0);
  std::uint64_t rays = 0;
  Moments light;
  for (int i = 0; i < 20000; ++i) {
    sampler.start(i % 1024, i / 1024, 0);
    light.add(static_cast<double>(integrator->trace(ray, sampler, rays).radiance.g));
  }
  return light;
}

/// Single scattering of the emitter's light towards the camera, by quadrature.
double scattered_once(const core::FogSettings& fog) {
  const auto extinction = static_cast<double>(fog.scattering.g + fog.absorption.g);
  const auto falloff = static_cast<double>(fog.height_falloff);
  const auto g = static_cast<double>(fog.g);
  const double x = -static_cast<double>(kLamp.x);
  const double y = static_cast<double>(kEye.y) - static_cast<double>(kLamp.y);
  const double here = std::exp(-falloff * static_cast<double>(kEye.y));  // constant along the ray
  double sum = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double t = kWall * (i + 0.5) / kSteps;
    const double z = static_cast<double>(kEye.z) - static_cast<double>(kLamp.z) - t;
    const double r2 = x * x + y * y + z * z;
    const double r = std::sqrt(r2);
    // Mean density between the two heights.
    const double mean = falloff > 0 ? here * std::expm1(falloff * y) / (falloff * y) : 1;
    const double cosine = z / r;  // between the direction of the light and the reversed ray
    const double base = 1 + g * g - 2 * g * cosine;
    const double phase = (1 - g * g) / (4 * std::numbers::pi * base * std::sqrt(base));
    sum += static_cast<double>(fog.scattering.g) * here * phase / r2 *
           std::exp(-extinction * (here * t + mean * r)) * kWall / kSteps;
  }
  return sum;
}

// Scattering is so rare that double scattering, 1e-4 times a few metres of single scattering, is
// negligible.
TEST(MediumLight, SingleScatteringMatchesTheIntegral) {
  for (const float falloff : {0.0F, 0.7F}) {
    for (const bool aims : {false, true}) {
      core::FogSettings fog = haze(1e-4F, falloff);
      const double truth = scattered_once(fog);
      const Moments light = lamp_in(fog, aims);
      EXPECT_LT(std::fabs(light.mean - truth), 4 * light.standard_error() + 1e-3 * truth)
          << light.mean << " for " << truth << ", falloff " << falloff;
      EXPECT_LT(light.standard_error(), 5e-2 * truth);
      fog.g = 0.3F;
      EXPECT_GT(std::fabs(lamp_in(fog, aims).mean - truth),
                4 * light.standard_error() + 1e-3 * truth)
          << "another g is rejected";
    }
  }
}

// One path in 150 scatters, but each light sample places a vertex in the medium.
TEST(MediumLight, EquiangularSamplingReducesVarianceInThinFog) {
  core::FogSettings fog = haze(1e-3F, 0);
  fog.absorption = Rgb(0);
  EXPECT_LT(8 * lamp_in(fog, true).standard_error(), lamp_in(fog, false).standard_error());
}

enum class Fault { kNone, kBothInFull, kRangeTooLong };

/// The same with one distance of each kind, weighted by the balance heuristic, made of parts of the
/// renderer; three extinctions.
std::array<Moments, 3> both_kinds(Fault fault, int count) {
  core::Medium medium;
  medium.sigma_s = {0.1F, 0.5F, 1};
  medium.sigma_t = {0.2F, 0.7F, 2};
  constexpr float kLength = 6;
  core::PathSampler sampler(core::SamplerType::kIndependent, 2, 5, 0);
  Random random(4);
  std::array<Moments, 3> out;
  const Vec3 lamp = kLamp - kEye;
  const float reach = fault == Fault::kRangeTooLong ? 1.5F * kLength : kLength;
  const core::Equiangular drawn({}, kAhead, 0, kLength, lamp);
  const core::Equiangular weighed({}, kAhead, 0, reach, lamp);
  for (int i = 0; i < count; ++i) {
    sampler.start(i % 1024, i / 1024, 0);
    std::uint64_t rays = 0;
    core::PathState path{.sampler = sampler, .rays = rays};
    path.ray.direction = kAhead;
    const core::MediumStretch stretch(path, &medium, kLength);
    Rgb sum;
    const auto falloff = [&](Vec3 p) { return 1 / length_squared(p - lamp); };
    const core::MediumSample step = stretch.sample(path);
    if (step.scatterer != nullptr) {
      const auto at = stretch.at(step.distance_m);
      const float pdf = weighed.pdf_m(step.distance_m);
      const float weight = fault == Fault::kBothInFull ? 1.0F : at.pdf_m / (at.pdf_m + pdf);
      sum += step.weight * (falloff(at.point) * weight);
    }
    const float t = drawn.sample(random.uniform());
    const auto at = stretch.at(t);
    const float pdf = weighed.pdf_m(t);
    const float weight = fault == Fault::kBothInFull ? 1.0F : pdf / (at.pdf_m + pdf);
    sum += medium.sigma_s * at.passed * (falloff(at.point) * at.density * weight / pdf);
    for (int c = 0; c < 3; ++c) {
      out[static_cast<std::size_t>(c)].add(static_cast<double>(sum[c]));
    }
  }
  return out;
}

double worst_z(const std::array<Moments, 3>& of) {
  const std::array<double, 3> sigma_s = {0.1, 0.5, 1};
  const std::array<double, 3> sigma_t = {0.2, 0.7, 2};
  const Vec3 lamp = kLamp - kEye;
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    double truth = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double t = 6 * (i + 0.5) / kSteps;
      const double z = t + static_cast<double>(lamp.z);
      const double r2 = static_cast<double>(lamp.x * lamp.x + lamp.y * lamp.y) + z * z;
      truth += sigma_s[c] * std::exp(-sigma_t[c] * t) / r2 * 6 / kSteps;
    }
    worst = std::max(worst, std::fabs(of[c].z(truth)));
  }
  return worst;
}

TEST(MediumLight, BothDistanceStrategiesCombineToTheMean) {
  EXPECT_LT(worst_z(both_kinds(Fault::kNone, 40000)), 4);
}
TEST(MediumLight, RejectsWeightsThatDoNotSumToOne) {
  EXPECT_GT(worst_z(both_kinds(Fault::kBothInFull, 40000)), 4);
}
TEST(MediumLight, RejectsADensityOfAnotherRange) {
  EXPECT_GT(worst_z(both_kinds(Fault::kRangeTooLong, 40000)), 4);
}

// Without aim one path of some hundreds scatters here, so most pixels of a pilot see no light.
TEST(PaysToAim, AtALampInThinFogWhateverThePhaseFunction) {
  for (const float g : {-0.6F, 0.0F, 0.9F}) {
    for (const float scattering : {1e-3F, 1e-2F}) {
      core::SceneDescription scene =
          test_support::scene_of({test_support::lambert({})},
                                 {test_support::quad({-20, -20, -2}, {40, 0, 0}, {0, 40, 0}, 0)});
      core::PunctualLightDescription lamp;
      lamp.to_world = core::translation(kLamp);
      scene.lights.push_back(lamp);
      core::View view = test_support::view_of(std::move(scene), 16, 16);
      test_support::look_at(view, kEye, kEye + kAhead, 40);
      view.settings.fog = {.scattering = Rgb(scattering), .absorption = Rgb(0), .g = g};
      ASSERT_TRUE(core::measure(view));
      EXPECT_TRUE(view.measured->aims_in_media) << g << " " << scattering;
    }
  }
}

}  // namespace
