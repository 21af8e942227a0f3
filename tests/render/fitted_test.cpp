// Methods fitted to the samples of the image: optimal MIS weights and regression. Their control
// variates have mean 0, their coefficients are independent of the samples to which they apply,
// their error estimates are correct, and they reduce variance. agreement_test.cpp and
// irradiance_test.cpp, which cover all options, compare whole images with plain path tracing and
// with closed forms.
#include <cmath>
#include <vector>

#include "core/integrators/integrator.h"
#include "core/samplers/dimensions.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::ControlVariateType;
using core::FitSample;
using core::FitType;
using core::MisType;
using core::PathSample;
using core::ReplicateFit;
using core::Rgb;
using core::SamplerType;
using core::View;
using test_support::Moments;
using test_support::Picture;

constexpr double kPi = 3.14159265358979323846;

View optimal(View view) {
  view.settings.estimator.mis = MisType::kOptimal;
  return view;
}
View regression(View view) {
  view.settings.estimator.control_variate = ControlVariateType::kRegression;
  return view;
}

/// A square centred above the origin.
core::PrimitiveDescription square(float side_m, float height_m, int material) {
  return test_support::quad({-0.5F * side_m, height_m, -0.5F * side_m}, {side_m, 0, 0},
                            {0, 0, side_m}, material);
}

/// Irradiance at the origin, over pi, from such a square of radiance 1 at height 1: Lambert's
/// formula for its quarters.
double under_square(double side_m) {
  const double x = side_m / 2 / std::sqrt(1 + side_m * side_m / 4);
  return 4 / kPi * x * std::atan(x);
}

/// A floor seen only at the origin, under an emitter and its occluder.
View meter(const core::MaterialDescription& floor, const core::PrimitiveDescription& lamp,
           const std::vector<core::PrimitiveDescription>& before) {
  std::vector<core::PrimitiveDescription> things = {
      test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0), lamp};
  things.insert(things.end(), before.begin(), before.end());
  View view = test_support::view_of(
      test_support::scene_of({floor, test_support::emitter(Rgb(1)), test_support::lambert(Rgb(0))},
                             std::move(things)),
      16, 16);
  test_support::look_at(view, {-0.3F, 0.2F, 0.25F}, {0, 0, 0}, 0.001F);
  view.settings.max_depth = 1;
  view.settings.sampler = SamplerType::kIndependent;
  return view;
}

/// A unit square, optionally half occluded by a wall.
View meter(bool wall, const core::MaterialDescription& floor = test_support::lambert(Rgb(1))) {
  std::vector<core::PrimitiveDescription> before;
  if (wall) {
    before.push_back(test_support::quad({0, 0.5F, -1}, {1, 0, 0}, {0, 0, 2}, 2));
  }
  return meter(floor, square(1, 1, 1), before);
}
constexpr double kOpen = 0.7522747 / kPi;  // from a unit square at distance 1
constexpr double kHalf = kOpen / 2;        // by symmetry

/// Everything that a light sample or a BSDF sample can encounter: gloss, rough glass, a two-sided
/// emitter, a point light, an environment with black texels, a pane that transmits half of the
/// light, and a clear pane.
View zoo() {
  core::MaterialDescription plastic;
  plastic.metallic = 0;
  plastic.roughness = 0.6F;
  plastic.base_color = {0.2F, 0.5F, 0.8F};
  core::MaterialDescription glass = plastic;
  glass.transmission = 1;
  glass.roughness = 0.5F;
  glass.thickness = 1;
  auto lamp = test_support::emitter({4, 3, 2});
  lamp.double_sided = true;
  core::MaterialDescription pane = test_support::lambert({0.2F, 0.6F, 0.3F});
  pane.alpha_mode = core::AlphaMode::kBlend;
  pane.base_alpha = 0.5F;
  pane.double_sided = true;
  core::MaterialDescription clear = test_support::glass(1.5F, 0);
  clear.double_sided = true;
  core::SceneDescription scene =
      test_support::scene_of({plastic, glass, lamp, pane, clear},
                             {test_support::quad({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, 0),
                              test_support::sphere({0.6F, 0.6F, 0.5F}, 0.6F, 12, false, 1),
                              test_support::quad({-1, 2, -1.5F}, {2, 0, 0}, {0, 1, 0}, 2),
                              test_support::quad({-2, 1, -1}, {1.5F, 0, 0}, {0, 0, 2}, 3),
                              test_support::quad({0.5F, 1.5F, -1}, {1.5F, 0, 0}, {0, 0, 2}, 4)});
  core::PunctualLightDescription point;
  point.intensity = {2, 1, 1};
  point.to_world = core::translation({1.5F, 2, 1.5F});
  scene.lights.push_back(point);
  View view = test_support::view_of(std::move(scene), 32, 32);
  test_support::look_at(view, {0, 1.6F, 4}, {0, 0.7F, 0}, 45);
  view.environment = test_support::sky_map(16, 8, [](int x, int y) {
    return y == 2 && x < 4 ? Rgb(0) : Rgb(0.2F + 0.1F * static_cast<float>((x + y) % 3));
  });
  view.settings.max_depth = 4;
  view.settings.sampler = SamplerType::kIndependent;
  return view;
}

/// The paths of a view as an integrator returns them, before any fitting.
class Paths {
 public:
  explicit Paths(const View& view)
      : view_(view),
        integrator_(
            core::make_integrator({view.scene->data(), view.environment.get(), view.settings})),
        camera_(*core::Camera::create(view.camera, view.scene->summary().cameras,
                                      view.scene->summary().bounds, view.settings.film.width,
                                      view.settings.film.height)) {
    core::prepare_tracing_thread();
  }
  PathSample trace(int pixel, int sample) {
    const int x = pixel % view_.settings.film.width;
    const int y = pixel / view_.settings.film.width % view_.settings.film.height;
    core::PathSampler sampler(view_.settings.sampler, 2, view_.settings.seed);
    sampler.start(x, y, sample);
    const core::Vec4 u = sampler.get_4d(core::kCameraGroup);
    std::uint64_t rays = 0;
    return integrator_->trace(
        camera_.ray({static_cast<float>(x) + u.x, static_cast<float>(y) + u.y}, {u.z, u.w}),
        sampler, rays);
  }

 private:
  View view_;
  std::unique_ptr<const core::Integrator> integrator_;
  core::Camera camera_;
};

struct Controls {
  Moments right;
  Moments wrong;  ///< with the density of light samples 2% too large
};

Controls controls(const View& view, int samples) {
  Paths paths(view);
  Controls out;
  const int pixels = view.settings.film.width * view.settings.film.height;
  for (int p = 0; p < pixels; ++p) {
    for (int s = 0; s < samples; ++s) {
      const FitSample fit = paths.trace(p, s).fit;
      out.right.add(static_cast<double>(fit.control.g));
      out.wrong.add(static_cast<double>(fit.control.g + 0.02F * fit.x));
    }
  }
  return out;
}

// z above 4.5 in any of eight: false alarm 6e-5. With densities that are 2% off, the test rejects
// all of those of optimal weights.
TEST(Fitted, ControlsOfOptimalWeightsHaveMeanZero) {
  View split = zoo();
  split.settings.estimator.splitting = core::SplittingType::kFixed;
  split.settings.estimator.split_count = 3;
  View power = zoo();
  power.settings.light_sampler = core::LightSamplerType::kPower;
  View shallow = zoo();
  shallow.settings.max_depth = 1;
  core::MaterialDescription gold;
  gold.metallic = 1;
  gold.roughness = 0.2F;
  const std::pair<const char*, View> cases[] = {{"square", meter(false)},
                                                {"half hidden", meter(true)},
                                                {"gold", meter(true, gold)},
                                                {"zoo", zoo()},
                                                {"split", split},
                                                {"power", power},
                                                {"one event", shallow}};
  for (const auto& [name, view] : cases) {
    const Controls c = controls(
        optimal(view), 256 * 256 * 2 / (view.settings.film.width * view.settings.film.height));
    EXPECT_LT(std::fabs(c.right.z(0)), 4.5)
        << name << " " << c.right.mean << " +- " << c.right.standard_error();
    EXPECT_GT(std::fabs(c.wrong.z(0)), 4.5)
        << name << " " << c.wrong.mean << " +- " << c.wrong.standard_error();
    EXPECT_GT(c.right.standard_error(), 0) << name;
  }
}

TEST(Fitted, ControlsOfRegressionHaveMeanZero) {
  View resampled = zoo();
  resampled.settings.light_sampler = core::LightSamplerType::kRis;
  resampled.settings.light_candidates = 4;
  for (const View& view : {meter(true), zoo(), resampled}) {
    const Controls c = controls(
        regression(view), 256 * 256 * 2 / (view.settings.film.width * view.settings.film.height));
    EXPECT_LT(std::fabs(c.right.z(0)), 4.5) << c.right.mean << " +- " << c.right.standard_error();
    EXPECT_GT(c.right.standard_error(), 0);
    EXPECT_LT(c.right.standard_error(), 2e-3);
  }
}

struct Estimates {
  Moments crossed;  ///< coefficient of four paths, from four other paths
  Moments same;     ///< from the same paths: the fault
};

Estimates from_four_paths(const View& view, FitType type) {
  Paths paths(view);
  Estimates out;
  for (int trial = 0; trial < 60000; ++trial) {
    ReplicateFit fits[2];
    double radiance[2] = {};
    double control[2] = {};
    for (int k = 0; k < 8; ++k) {
      const PathSample s = paths.trace(trial % 256, 8 * (trial / 256) + k);
      fits[k % 2].add(s.fit);
      radiance[k % 2] += static_cast<double>(s.radiance.g) / 4;
      control[k % 2] += static_cast<double>(s.fit.control.g) / 4;
    }
    for (int half = 0; half < 2; ++half) {
      const auto c = [&](int of) {
        return static_cast<double>(core::fitted_coefficient(type, fits[of]).g);
      };
      out.same.add(radiance[half] + c(half) * control[half]);
      if (half == 0) {  // the two halves of a trial depend on each other
        out.crossed.add(radiance[half] + c(1) * control[half]);
      }
    }
  }
  return out;
}

// z above 4: false alarm 6e-5. Coefficients fitted to the samples to which they apply follow the
// noise.
void expect_cross_fitting_alone_keeps_the_mean(const View& view, FitType type, double truth) {
  const Estimates e = from_four_paths(view, type);
  EXPECT_LT(std::fabs(e.crossed.z(truth)), 4) << e.crossed.mean << " for " << truth;
  EXPECT_GT(std::fabs(e.same.z(truth)), 8) << e.same.mean << " for " << truth;
  std::printf("    four paths: crossed %+.2f %%, same %+.2f %%\n",
              100 * (e.crossed.mean / truth - 1), 100 * (e.same.mean / truth - 1));
}

TEST(Fitted, OnlyWeightsFromTheOtherHalfKeepTheMean) {
  expect_cross_fitting_alone_keeps_the_mean(optimal(meter(true)), FitType::kOptimalMis, kHalf);
}

// A square of side 4 behind one that hides its centre, so that many large samples are occluded.
TEST(Fitted, OnlyFactorsFromTheOtherHalfKeepTheMean) {
  View view =
      regression(meter(test_support::lambert(Rgb(1)), square(4, 1, 1), {square(1, 0.5F, 2)}));
  view.settings.estimator.strategy = core::Strategy::kLight;
  expect_cross_fitting_alone_keeps_the_mean(view, FitType::kRegression,
                                            under_square(4) - under_square(2));
}

struct Spread {
  Moments difference;  ///< variance estimated from the halves minus the squared error, over the
                       ///< truth squared
  Moments leaky;       ///< same, with a tenth of each half leaking into the other: the fault
  Moments square;
};

Spread spread(View view, double truth, int samples, int seeds) {
  Spread out;
  for (int seed = 0; seed < seeds; ++seed) {
    view.settings.seed = static_cast<std::uint64_t>(seed);
    const Picture picture = test_support::render(view, samples);
    for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
      const auto a = static_cast<double>(core::half_value(picture.snapshot, p, 0).mean.g) / truth;
      const auto b = static_cast<double>(core::half_value(picture.snapshot, p, 1).mean.g) / truth;
      const double error = (a + b) / 2 - 1;
      out.difference.add((a - b) * (a - b) / 4 - error * error);
      out.leaky.add(0.64 * (a - b) * (a - b) / 4 - error * error);
      out.square.add(error * error);
    }
  }
  return out;
}

// Although the halves learn from each other, their difference estimates the error: within 4
// standard errors, false alarm 6e-5 each.
TEST(Fitted, HalvesEstimateTheError) {
  for (const SamplerType sampler : {SamplerType::kIndependent, SamplerType::kSobol}) {
    for (View view : {optimal(meter(true)), regression(meter(true))}) {
      view.settings.sampler = sampler;
      const Spread s = spread(view, kHalf, 16, 64);
      EXPECT_LT(std::fabs(s.difference.z(0)), 4) << s.difference.mean << " of " << s.square.mean;
      EXPECT_LT(s.leaky.z(0), -4) << "a leak of a tenth is detected";
      EXPECT_LT(s.difference.standard_error(), 0.05 * s.square.mean);
    }
  }
}

/// Mean squared error of a pixel over the squared true value.
double error_of(const View& view, double truth, int samples) {
  return spread(view, truth, samples, 8).square.mean;
}

// Under a uniform sky f is a multiple of the BSDF's density, so a combination without noise exists.
// Only the first samples of each replicate do not know it yet: 4 of 128, and a few more that know
// it poorly. The sky is a map: a constant sky is sampled by the cosine, without noise for all.
TEST(Fitted, OptimalWeightsFindTheCombinationWithoutNoise) {
  View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(1))},
                             {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)}),
      16, 16);
  test_support::look_at(view, {-0.3F, 0.2F, 0.25F}, {0, 0, 0}, 0.001F);
  view.environment = test_support::sky_map(4, 2, [](int, int) { return Rgb(1); });
  view.settings.max_depth = 1;
  view.settings.sampler = SamplerType::kIndependent;
  View balance = view;
  balance.settings.estimator.mis = MisType::kBalance;
  const double ratio = error_of(optimal(view), 1, 256) / error_of(balance, 1, 256);
  EXPECT_LT(ratio, 0.1);
  std::printf("    sky: variance over the balance heuristic's: %.3f\n", ratio);
}

// At most 1.02 of the balance heuristic's variance; here over 2048 pixels, where the ratio has a
// standard error of 4%, so the limit is three standard errors above 1.02.
TEST(Fitted, OptimalWeightsAreNoWorseThanTheBalanceHeuristic) {
  for (const bool wall : {false, true}) {
    const double truth = wall ? kHalf : kOpen;
    View balance = meter(wall);
    balance.settings.estimator.mis = MisType::kBalance;
    const double ratio = error_of(optimal(meter(wall)), truth, 256) / error_of(balance, truth, 256);
    EXPECT_LT(ratio, 1.14);
    std::printf("    lamp, %s: variance over the balance heuristic's: %.3f\n",
                wall ? "half hidden" : "in the open", ratio);
  }
}

TEST(Fitted, RegressionRemovesTheVarianceOfTheClosedFormButNotOfShadows) {
  View open = meter(false);
  open.settings.estimator.strategy = core::Strategy::kLight;
  View hidden = meter(true);
  hidden.settings.estimator.strategy = core::Strategy::kLight;
  const double clear = error_of(regression(open), kOpen, 256) / error_of(open, kOpen, 256);
  const double half = error_of(regression(hidden), kHalf, 256) / error_of(hidden, kHalf, 256);
  EXPECT_LT(clear, 0.1);
  EXPECT_LT(half, 1.12);  // three standard errors above 1
  std::printf("    variance with regression over without: %.3f in the open, %.3f half hidden\n",
              clear, half);
}

}  // namespace
