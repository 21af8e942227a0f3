// Options of the estimators in whole images: settings that must have no effect give identical bits,
// the others have their intended effect, and means are unchanged. The sensitivity of the z-tests is
// shown by agreement_test.cpp (3% more light) and by the planted faults below.
#include <cmath>
#include <vector>

#include "core/light_samplers/light_sampler.h"
#include "core/sampling/mis.h"
#include "core/sampling/reservoir.h"
#include "core/sampling/warp.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::LightSamplerType;
using core::Rgb;
using core::RouletteType;
using core::SplittingType;
using core::Vec3;
using core::View;
using test_support::Moments;
using test_support::Picture;
using test_support::Random;

View box(int side) { return test_support::cornell_view(side, side, 40); }

std::vector<float> values(const Picture& picture) {
  std::vector<float> out;
  for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
    const Rgb c = core::pixel_value(picture.snapshot, p).mean;
    out.insert(out.end(), {c.r, c.g, c.b});
  }
  return out;
}

TEST(Options, OptionsWithoutEffectKeepEveryBit) {
  View view = box(24);
  view.wave_width = 0;  // waves support only the default options
  const std::vector<float> plain = values(test_support::render(view, 8));
  const auto same = [&](const View& other) {
    return values(test_support::render(other, 8)) == plain;
  };
  View threshold = view;
  threshold.settings.estimator.roulette = RouletteType::kThreshold;
  threshold.settings.estimator.roulette_delta = 0;
  EXPECT_TRUE(same(threshold));
  View split = view;
  split.settings.estimator.splitting = SplittingType::kFixed;
  split.settings.estimator.split_count = 1;
  EXPECT_TRUE(same(split));
  View resampled = view;
  resampled.settings.light_sampler = LightSamplerType::kRis;
  resampled.settings.light_candidates = 1;
  EXPECT_TRUE(same(resampled));
  // Nothing is transparent, and albedos are far from 1: analog absorption terminates paths.
  View dice = view;
  dice.settings.estimator.expected_values = false;
  EXPECT_FALSE(same(dice));
}

TEST(Options, BitsAreIndependentOfTheNumberOfThreads) {
  View view = box(40);
  view.settings.light_sampler = LightSamplerType::kRis;
  view.settings.estimator.roulette = RouletteType::kThreshold;
  view.settings.estimator.roulette_delta = 0.1F;
  view.settings.estimator.splitting = SplittingType::kFixed;
  view.settings.estimator.split_count = 3;
  view.settings.estimator.expected_values = false;
  EXPECT_EQ(values(test_support::render(view, 6, 1)), values(test_support::render(view, 6, 3)));
}

TEST(Options, HigherShadowRouletteThresholdTracesFewerShadowRays) {
  View view = box(24);
  view.settings.estimator.roulette = RouletteType::kThreshold;
  std::uint64_t before = ~std::uint64_t{0};
  for (const float delta : {0.0F, 0.01F, 0.1F, 1.0F}) {
    view.settings.estimator.roulette_delta = delta;
    const std::uint64_t rays = test_support::render(view, 8).progress.rays;
    EXPECT_LT(rays, before) << delta;
    before = rays;
  }
}

/// A floor under a point light; between them `panes` sheets that transmit half of the light
/// (BLEND).
View behind_panes(int panes) {
  core::MaterialDescription pane = test_support::lambert(Rgb(0));
  pane.alpha_mode = core::AlphaMode::kBlend;
  pane.base_alpha = 0.5F;
  pane.double_sided = true;
  std::vector<core::PrimitiveDescription> things = {
      test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)};
  for (int i = 0; i < panes; ++i) {
    things.push_back(test_support::quad({-9, 2.0F + 0.1F * static_cast<float>(i), 9}, {18, 0, 0},
                                        {0, 0, -18}, 1));
  }
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(0.5F)), pane}, things);
  scene.lights.push_back(test_support::directional(
      core::rotation({-std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)}), Rgb(core::kPi)));
  View view = test_support::view_of(std::move(scene), 16, 16);
  test_support::look_at(view, {0, 1, 0.2F}, {0, 0, 0}, 40);
  view.settings.max_depth = 1;
  return view;
}

// The radiance of a white sun of irradiance pi on albedo 1/2, through three panes: 1/2 (1/2)^3,
// exactly.
TEST(Options, ExpectedValuesRemoveTheNoiseOfPanes) {
  View view = behind_panes(3);
  const Picture factor = test_support::render(view, 16);
  EXPECT_NEAR(factor.mean().g, 0.0625F, 1e-6F);
  EXPECT_LT(factor.standard_error().g, 1e-7F);
  view.settings.estimator.expected_values = false;
  const Picture dice = test_support::render(view, 256);
  const auto error = static_cast<double>(dice.standard_error().g);
  EXPECT_GT(error, 1e-5);
  EXPECT_LT(std::fabs(static_cast<double>(dice.mean().g) - 0.0625), 4 * error);  // false alarm 6e-5
}

// A black pane of this alpha in front of a white sky: at 64 samples, two halves of 32 Sobol points,
// each pixel is within a sample of each half. Random numbers give a standard deviation of
// sqrt(0.3 * 0.7 / 64) = 0.057, which the second hole of the same segment must not have either.
TEST(Options, HolesAreStratified) {
  for (const char* const integrator : {"path", "bdpt"}) {
    for (const int panes : {1, 2}) {
      core::MaterialDescription pane = test_support::lambert(Rgb(0));
      pane.alpha_mode = core::AlphaMode::kBlend;
      pane.base_alpha = 0.3F;
      pane.double_sided = true;
      std::vector<core::PrimitiveDescription> things;
      for (int i = 0; i < panes; ++i) {
        things.push_back(
            test_support::quad({-9, -static_cast<float>(i), 9}, {18, 0, 0}, {0, 0, -18}, 0));
      }
      View view = test_support::view_of(
          test_support::build(test_support::scene_of({pane}, std::move(things))), 16, 16);
      test_support::look_at(view, {0, 1, 0.2F}, {0, 0, 0}, 40);
      view.environment = test_support::constant_sky({1, 1, 1});
      view.settings.integrator = integrator;
      const double expected = std::pow(0.7, panes);
      double squares = 0;
      const std::vector<float> seen = values(test_support::render(view, 64));
      for (const float value : seen) {
        const double error = static_cast<double>(value) - expected;
        squares += error * error;
      }
      EXPECT_LT(std::sqrt(squares / static_cast<double>(seen.size())), panes == 1 ? 0.02 : 0.03);
    }
  }
}

// Splitting keeps the random numbers of the camera and draws more of the others: if all noise of an
// image arises after the first surface, n continuations reduce its variance like n times the
// samples.
TEST(Options, SplittingReducesTheVarianceAfterTheFirstSurface) {
  View view = box(24);
  // the emitter is outside the view
  test_support::look_at(view, {0.5F, 0.5F, 1}, {0.5F, 0.2F, 0}, 30);
  view.settings.sampler = core::SamplerType::kIndependent;
  view.settings.max_depth = 3;
  const auto variance = [&view] {
    const auto e = static_cast<double>(test_support::render(view, 64).standard_error().g);
    return e * e;
  };
  const double plain = variance();
  view.settings.estimator.splitting = SplittingType::kFixed;
  view.settings.estimator.split_count = 4;
  // A small part of the variance is at edges and remains. Each estimate has 1728 squares: 1/2
  // instead of 1/4 is off by many standard errors.
  EXPECT_LT(variance(), 0.5 * plain);
}

enum class Fault { kNone, kForgetsTheSum, kBlindTarget, kCountsOneSample, kNoDivision };

/// Irradiance over pi under 16 emitters in a row, by light samples (RIS of 4 candidates, then
/// roulette of shadow rays) and BSDF samples, made of parts of the renderer. A wall hides half of
/// the floor's hemisphere, which the candidates do not consider.
Moments lamps(Fault fault, int samples) {
  std::vector<core::PrimitiveDescription> row;
  for (int i = 0; i < 16; ++i) {
    row.push_back(test_support::quad({-2 + 0.25F * static_cast<float>(i), -0.5F, 1}, {0, 1, 0},
                                     {0.2F, 0, 0}, 0));
  }
  const auto scene =
      test_support::build(test_support::scene_of({test_support::emitter(Rgb(1))}, row));
  const core::LightSampler lights(scene->data(), nullptr, core::LightPick::kTree);
  const core::MisRule mis;
  constexpr int kCandidates = 4;
  const auto cosine = [](Vec3 w) { return std::max(w.z, 0.0F) * core::kInvPi; };
  const auto open = [](Vec3 w) { return w.x < 0.2F; };
  struct Candidate {
    Vec3 wi;
    double value = 0;  // g / p
  };
  Random random(5);
  Moments out;
  for (int i = 0; i < samples; ++i) {
    core::WeightedReservoir<Candidate> reservoir(random.uniform_double());
    for (int k = 0; k < kCandidates; ++k) {
      const float pick = random.uniform();
      const auto light = lights.sample({}, {0, 0, 1}, pick, random.uniform_2d());
      if (!(light.pdf_solid_angle > 0)) {
        continue;
      }
      const float f = cosine(light.wi_world);
      const float w = mis.weight(kCandidates * light.pdf_solid_angle, f);
      const double g = static_cast<double>(f * light.radiance.g * w / light.pdf_solid_angle);
      const bool blind = fault == Fault::kBlindTarget && light.wi_world.x < -0.5F;
      reservoir.add({light.wi_world, g}, blind ? 0 : g);
    }
    double sum = 0;
    if (!reservoir.empty()) {
      double value = reservoir.sum() / kCandidates * reservoir.item().value / reservoir.weight();
      if (fault == Fault::kForgetsTheSum) {
        value = reservoir.item().value;
      }
      const double survive = std::min(1.0, value / 0.3);
      if (random.uniform_double() < survive && open(reservoir.item().wi)) {
        sum += value / (fault == Fault::kNoDivision ? 1 : survive);
      }
    }
    const Vec3 wi = core::cosine_hemisphere(random.uniform_2d());
    const Vec3 hit = wi * (1 / wi.z);
    const float x = (hit.x + 2) / 0.25F;
    if (std::fabs(hit.y) < 0.5F && x >= 0 && x < 16 && x - std::floor(x) < 0.8F && open(wi)) {
      const float y = (hit.y + 0.5F);
      const float across = (x - std::floor(x)) / 0.8F;
      const auto triangle = 2 * static_cast<std::uint32_t>(x) + (across > y ? 1U : 0U);
      const float pdf = lights.pdf_triangle(triangle, {}, {0, 0, 1}, length(hit), wi.z);
      const float counted = fault == Fault::kCountsOneSample ? 1.0F : kCandidates;
      sum += static_cast<double>(mis.weight(cosine(wi), counted * pdf));
    }
    out.add(sum);
  }
  return out;
}

/// The same by uniform points on the emitters, without resampling and roulette.
double lamps_truth() {
  double sum = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < 16; ++i) {
    for (int a = 0; a < kSteps; ++a) {
      for (int b = 0; b < kSteps; ++b) {
        const double x = -2 + 0.25 * i + 0.2 * (a + 0.5) / kSteps;
        const double y = -0.5 + (b + 0.5) / kSteps;
        const double d2 = x * x + y * y + 1;
        if (x / std::sqrt(d2) < 0.2) {
          sum += 0.2 / kSteps / kSteps / (d2 * d2);
        }
      }
    }
  }
  return sum / 3.14159265358979;
}

// 0.1% false alarms in total: z below 4 is 6e-5.
TEST(ResampledLights, HaveTheMeanOfTheLight) {
  const Moments m = lamps(Fault::kNone, 1000000);
  EXPECT_LT(std::fabs(m.z(lamps_truth())), 4) << m.mean << " for " << lamps_truth();
  EXPECT_LT(m.standard_error(), 1e-3 * m.mean);
}
TEST(ResampledLights, RejectsPlantedFaults) {
  const double truth = lamps_truth();
  for (const Fault fault :
       {Fault::kForgetsTheSum, Fault::kBlindTarget, Fault::kCountsOneSample, Fault::kNoDivision}) {
    EXPECT_GT(std::fabs(lamps(fault, 300000).z(truth)), 4) << static_cast<int>(fault);
  }
}

}  // namespace
