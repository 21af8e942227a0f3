// The z-tests of this folder can fail: small estimators made of parts of the renderer, correct and
// with a planted fault.
#include <numbers>

#include "core/bsdf/bsdf.h"
#include "core/light_samplers/light_sampler.h"
#include "core/sampling/mis.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::Bsdf;
using core::Rgb;
using core::Vec3;
using test_support::Moments;
using test_support::Random;

enum class Fault { kNone, kNoCosine, kPdfTooLarge, kWeightsNotOne, kNoLightPmf };

/// Irradiance over pi below a unit square of radiance 1 at distance 1: light and BSDF sampling
/// combined.
Moments direct_light(Fault fault, int samples) {
  const auto scene = test_support::build(
      test_support::scene_of({test_support::emitter(Rgb(1))},
                             {test_support::quad({-0.5F, -0.5F, 1}, {0, 1, 0}, {1, 0, 0}, 0)}));
  const core::LightSampler lights(scene->data(), nullptr, core::LightPick::kTree);
  const Bsdf bsdf({.f0 = {0, 0, 0}, .f90 = 0}, {0, 0, 1}, {0, 0, 1});
  const core::MisRule power = {core::MisType::kPower, 2};
  const core::MisRule balance = {core::MisType::kBalance, 1};
  const auto value = [&](Vec3 wi) {
    const float f = bsdf.evaluate(wi).value_cos.g;
    return fault == Fault::kNoCosine ? f / wi.z : f;
  };
  Random random(1);
  Moments out;
  for (int i = 0; i < samples; ++i) {
    float sum = 0;
    const float pick = random.uniform();
    const auto light = lights.sample({}, {0, 0, 1}, pick, random.uniform_2d());
    if (light.pdf_solid_angle > 0) {
      float pdf_light = light.pdf_solid_angle * (fault == Fault::kPdfTooLarge ? 1.02F : 1.0F);
      if (fault == Fault::kNoLightPmf) {
        pdf_light *= 2;  // two triangles, each selected with probability 1/2
      }
      sum += value(light.wi_world) * light.radiance.g / pdf_light *
             power.weight(pdf_light, bsdf.evaluate(light.wi_world).pdf_solid_angle);
    }
    const float lobe = random.uniform();
    const auto s = bsdf.sample(lobe, random.uniform_2d());
    if (s.pdf_solid_angle > 0) {
      const Vec3 hit = s.wi_local * (1 / s.wi_local.z);
      if (std::fabs(hit.x) < 0.5F && std::fabs(hit.y) < 0.5F) {
        const std::uint32_t triangle =
            0;  // both are equal, and from below each is selected with probability 1/2
        float pdf_light = lights.pdf_triangle(triangle, {}, {0, 0, 1}, length(hit), s.wi_local.z);
        if (fault == Fault::kNoLightPmf) {
          pdf_light *= 2;
        }
        const core::MisRule& rule = fault == Fault::kWeightsNotOne ? balance : power;
        sum += value(s.wi_local) / s.pdf_solid_angle * rule.weight(s.pdf_solid_angle, pdf_light);
      }
    }
    out.add(static_cast<double>(sum));
  }
  return out;
}

constexpr double kTruth = 0.7522747 / std::numbers::pi;

TEST(PlantedBug, DirectLightWithoutAFaultPasses) {
  const Moments m = direct_light(Fault::kNone, 1000000);
  EXPECT_LT(std::fabs(m.z(kTruth)), 4) << m.mean;
  EXPECT_NEAR(m.mean, kTruth, 1e-3 * kTruth);
}

TEST(PlantedBug, RejectsAMissingCosine) {
  EXPECT_GT(std::fabs(direct_light(Fault::kNoCosine, 1000000).z(kTruth)), 4);
}
TEST(PlantedBug, RejectsADensityTwoPercentTooLarge) {
  EXPECT_GT(std::fabs(direct_light(Fault::kPdfTooLarge, 1000000).z(kTruth)), 4);
}
TEST(PlantedBug, RejectsWeightsThatDoNotSumToOne) {
  EXPECT_GT(std::fabs(direct_light(Fault::kWeightsNotOne, 1000000).z(kTruth)), 4);
}
TEST(PlantedBug, RejectsAMissingLightProbability) {
  EXPECT_GT(std::fabs(direct_light(Fault::kNoLightPmf, 1000000).z(kTruth)), 4);
}

/// A closed sphere of albedo 1/2 and emission 1/2: radiance 1, by paths that end by roulette.
Moments roulette(bool divides, int samples) {
  const Bsdf bsdf({.base_color = {0.5F, 0.5F, 0.5F}, .f0 = {0, 0, 0}, .f90 = 0}, {0, 0, 1},
                  {0, 0, 1});
  Random random(2);
  Moments out;
  for (int i = 0; i < samples; ++i) {
    float beta = 1;
    float radiance = 0;
    for (int depth = 0; depth < 200; ++depth) {
      radiance += beta * 0.5F;
      const float lobe = random.uniform();
      beta *= bsdf.sample(lobe, random.uniform_2d()).weight.g;
      const float survive = std::min(beta / 0.5F, 1.0F);
      if (random.uniform() >= survive) {
        break;
      }
      beta /= divides ? survive : 1.0F;
    }
    out.add(static_cast<double>(radiance));
  }
  return out;
}

TEST(PlantedBug, RouletteWithoutAFaultPasses) {
  EXPECT_LT(std::fabs(roulette(true, 300000).z(1)), 4);
}
TEST(PlantedBug, RejectsRouletteThatDoesNotDivide) {
  EXPECT_GT(std::fabs(roulette(false, 300000).z(1)), 4);
}

}  // namespace
