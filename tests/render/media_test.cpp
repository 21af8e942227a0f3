// Scattering media: closed forms (truths 11 and 12), the phase function, fog.
#include <array>
#include <numbers>

#include "core/media/fog.h"
#include "core/render/task/settle.h"
#include "core/samplers/path_sampler.h"
#include "core/transport/medium_sample.h"
#include "tests/render/truth.h"
#include "tests/support/milk.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::expect_truth;
using test_support::milk;
using test_support::Moments;
using test_support::Random;

core::View ball(const core::MaterialDescription& material) {
  core::View view = test_support::view_of(
      test_support::scene_of({material}, {test_support::sphere({0, 0, 0}, 1, 16, false, 0)}), 12,
      12);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);  // the ball fills the image
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 64;
  return view;
}

TEST(HenyeyGreenstein, SamplesFollowTheDensity) {
  constexpr int kSamples = 200000;
  for (const float g : {-0.7F, 0.0F, 5e-4F, 0.3F, 0.9F}) {
    Random random(3);
    Moments cosine;
    Moments ratio;  // uniform density over this one: its mean is 1
    const Vec3 before = normalize(Vec3{0.3F, -0.5F, 0.8F});
    for (int i = 0; i < kSamples; ++i) {
      const Vec3 after = core::sample_henyey_greenstein(before, g, random.uniform_2d());
      cosine.add(static_cast<double>(dot(before, after)));
      if (g > -0.75F && g < 0.75F) {
        ratio.add(0.25 * std::numbers::inv_pi /
                  static_cast<double>(core::henyey_greenstein(dot(before, after), g)));
      }
    }
    EXPECT_LT(std::fabs(cosine.z(static_cast<double>(g))), 4) << g;
    EXPECT_GT(std::fabs(cosine.z(static_cast<double>(g) + 0.02)), 4) << "another g is rejected";
    if (ratio.n > 0) {
      EXPECT_LT(std::fabs(ratio.z(1)), 4) << g;
    }
  }
}

// Truth 11: nothing is lost, so nothing is visible.
TEST(MediumFurnace, LosslessBallsAreInvisible) {
  struct Case {
    float mean_free_path_m;
    float g;
    float ior;
  };
  for (const Case& c :
       {Case{1, 0, 1}, Case{0.25F, 0.8F, 1}, Case{0.5F, -0.5F, 1}, Case{0.5F, 0, 1.3F}}) {
    const auto picture = test_support::render(ball(milk(1, c.mean_free_path_m, c.g, c.ior)), 320);
    const std::string what = std::to_string(c.mean_free_path_m) + " m, g " + std::to_string(c.g) +
                             ", ior " + std::to_string(c.ior);
    expect_truth(picture, 1, 4e-3, what);
  }
  core::MaterialDescription holes = milk(1, 0.5F, 0, 1.3F);
  holes.alpha_mode = core::AlphaMode::kBlend;
  holes.base_alpha = 0.5F;
  expect_truth(test_support::render(ball(holes), 320), 1, 4e-3, "holes");
}

TEST(MediumFurnace, ExtinctionPerChannelStaysWhite) {
  core::MaterialDescription m = milk(1, 1);
  m.attenuation_color = {std::exp(-0.2F), std::exp(-1.0F), std::exp(-4.0F)};
  const auto picture = test_support::render(ball(m), 512);
  for (int c = 0; c < 3; ++c) {
    EXPECT_LT(std::fabs(picture.mean()[c] - 1), 4 * picture.standard_error()[c] + 1e-5F) << c;
    EXPECT_LT(picture.standard_error()[c], 5e-3F) << c;
  }
}

TEST(MediumFurnace, StrategiesAgree) {
  for (const auto strategy : {core::Strategy::kLight, core::Strategy::kBsdf}) {
    core::View view = ball(milk(1, 0.5F, 0.4F));
    view.settings.estimator.strategy = strategy;
    expect_truth(test_support::render(view, 320), 1, 1e-2, "strategy");
  }
}

TEST(MediumFurnace, AbsorbingMediumIsDarker) {
  const auto picture = test_support::render(ball(milk(0.9F, 0.5F)), 64);
  EXPECT_LT(picture.mean().g, 0.95F) << "the furnace test can fail";
}

enum class Fault { kNone, kEndUnweighted, kWrongExtinction };

/// Light that leaves a ball with three extinctions, by random walks made of parts of the renderer.
std::array<Moments, 3> walks(Fault fault, int count) {
  core::Medium medium;
  medium.sigma_t = medium.sigma_s = {0.3F, 1, 3};
  if (fault == Fault::kWrongExtinction) {
    medium.sigma_t = medium.sigma_t * 1.05F;
  }
  core::PathSampler sampler(core::SamplerType::kIndependent, 2, 5, 0);
  Random random(4);
  std::array<Moments, 3> out;
  for (int i = 0; i < count; ++i) {
    sampler.start(i % 1024, i / 1024, 0);
    std::uint64_t rays = 0;
    core::PathState path{.sampler = sampler, .rays = rays};
    path.ray.origin = {};
    path.ray.direction = {0, 0, 1};
    for (int k = 0; k < 400; ++k, ++path.depth) {
      const float along = -dot(path.ray.origin, path.ray.direction);
      const float to_edge =
          along + std::sqrt(std::max(
                      1 - length_squared(path.ray.origin + path.ray.direction * along), 0.0F));
      const auto step = core::sample_medium(path, &medium, to_edge);
      const bool is_end = step.scatterer == nullptr;
      path.beta *= is_end && fault == Fault::kEndUnweighted ? Rgb(1) : step.weight;
      if (is_end) {
        break;
      }
      path.ray.origin = path.ray.origin + path.ray.direction * step.distance_m;
      path.ray.direction =
          core::sample_henyey_greenstein(path.ray.direction, 0, random.uniform_2d());
    }
    for (int c = 0; c < 3; ++c) {
      out[static_cast<std::size_t>(c)].add(static_cast<double>(path.beta[c]));
    }
  }
  return out;
}

double worst_z(const std::array<Moments, 3>& of) {
  return std::max({std::fabs(of[0].z(1)), std::fabs(of[1].z(1)), std::fabs(of[2].z(1))});
}

TEST(MediumWalk, LosesNoEnergy) { EXPECT_LT(worst_z(walks(Fault::kNone, 40000)), 4); }
TEST(MediumWalk, RejectsAMissingWeightAtTheEnd) {
  EXPECT_GT(worst_z(walks(Fault::kEndUnweighted, 40000)), 4);
}
TEST(MediumWalk, RejectsExtinctionAboveScattering) {
  EXPECT_GT(worst_z(walks(Fault::kWrongExtinction, 40000)), 4);
}

/// A homogeneous medium behind a plane, wide and deep enough to count as infinite, at normal view.
core::View deep_medium(float albedo) {
  std::vector<core::PrimitiveDescription> sides;
  constexpr float kHalf = 60;
  const auto side = [&](Vec3 corner, Vec3 a, Vec3 b) {
    sides.push_back(test_support::quad(corner, a, b, 0));
  };
  const Vec3 x = {2 * kHalf, 0, 0};
  const Vec3 y = {0, kHalf, 0};
  const Vec3 z = {0, 0, 2 * kHalf};
  const Vec3 low = {-kHalf, -kHalf, -kHalf};
  side(low + y, z, x);
  side(low, x, z);
  side(low, z, y);
  side(low + x, y, z);
  side(low, y, x);
  side(low + z, x, y);
  core::View view =
      test_support::view_of(test_support::scene_of({milk(albedo, 1)}, std::move(sides)), 8, 8);
  test_support::look_at(view, {0, 1, 0}, {0, 0, 0}, 1);
  view.camera.up = Vec3{0, 0, 1};
  view.environment = test_support::constant_sky({1, 1, 1});
  return view;
}

// Truth 12: reflectance of a semi-infinite medium at normal view under uniform illumination, which
// equals the albedo for normal incidence. The planted fault: an albedo that is 0.005 higher.
TEST(DeepMedium, ReflectsAccordingToTheHFunction) {
  struct Case {
    float albedo;
    double truth;
    int samples;
  };
  for (const Case& c : {Case{0.5F, 0.11523, 4096}, Case{0.8F, 0.28525, 2048},
                        Case{0.9F, 0.41495, 2048}, Case{0.99F, 0.75272, 512}}) {
    expect_truth(test_support::render(deep_medium(c.albedo), c.samples), c.truth, 1e-2,
                 std::to_string(c.albedo));
    const auto other = test_support::render(deep_medium(c.albedo + 0.005F), c.samples);
    EXPECT_GT(static_cast<double>(other.mean().g) - c.truth,
              4 * static_cast<double>(other.standard_error().g))
        << c.albedo;
  }
}

core::FogSettings haze(float scattering, float absorption, float falloff = 0) {
  return {.scattering = Rgb(scattering),
          .absorption = Rgb(absorption),
          .g = 0.3F,
          .height_falloff = falloff};
}

TEST(Fog, DepthIsTheIntegralOfTheDensity) {
  const core::Fog fog(haze(0.4F, 0.1F, 0.7F), {0.5F, 1, 0}, 3);
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const Vec3 origin = {4 * random.uniform() - 2, 4 * random.uniform() - 1,
                         4 * random.uniform() - 2};
    const Vec3 direction = core::sample_henyey_greenstein({0, 1, 0}, 0, random.uniform_2d());
    const float distance = 6 * random.uniform();
    double sum = 0;
    constexpr int kSteps = 20000;
    for (int k = 0; k < kSteps; ++k) {
      const float t = distance * (static_cast<float>(k) + 0.5F) / kSteps;
      const Vec3 at = origin + direction * t;
      if (length(at - Vec3{0.5F, 1, 0}) < 3) {
        sum += std::exp(-0.7 * static_cast<double>(at.y)) * static_cast<double>(distance) / kSteps;
      }
    }
    const float depth = fog.depth(origin, direction, distance);
    EXPECT_NEAR(static_cast<double>(depth), sum, 1e-3 * sum + 2e-3);
    const float half = 0.5F * depth;
    if (half > 1e-3F) {
      const float at = fog.distance(origin, direction, half);
      EXPECT_NEAR(fog.depth(origin, direction, at), half, 1e-3F * half);
      EXPECT_LT(at, distance);
    }
  }
}

/// Depth of fog below height h on the way down, and up from there, from the closed form in double.
TEST(Fog, IsAsDeepFromAnyHeightAsItsIntegral) {
  constexpr double kFalloff = 1;
  constexpr float kRadius = 1e8F;  // longer than all rays
  const core::Fog fog(haze(0, 1, static_cast<float>(kFalloff)), {0, 0, 0}, kRadius);
  for (const float height : {1.0F, 30.0F, 85.0F, 88.0F, 100.0F, 1e3F, 1e5F}) {
    for (const float slant : {1.0F, 0.5F, 0.01F}) {
      SCOPED_TRACE(testing::Message() << height << " m, slant " << slant);
      const float across = std::sqrt(1 - slant * slant);
      const float length = height / slant;
      const auto steepness = static_cast<double>(slant) * kFalloff;
      const double whole = -std::expm1(-static_cast<double>(height) * kFalloff) / steepness;
      const core::Vec3 above = {0, height, 0};
      const core::Vec3 below = core::Vec3{across, -slant, 0} * length + above;
      const auto down = static_cast<double>(fog.depth(above, {across, -slant, 0}, length));
      const auto up = static_cast<double>(fog.depth(below, {-across, slant, 0}, length));
      // Heights of 1e5 m are rounded to 0.008 m, and so are depths below them.
      const double tolerance = whole * (1e-4 + 1.2e-7 * static_cast<double>(height + length));
      EXPECT_NEAR(down, whole, tolerance);
      EXPECT_NEAR(up, whole, tolerance);
      for (const double part : {1e-3, 0.5, 0.99}) {
        // Solves (e^{steepness s} - 1) e^{-falloff h} / steepness = part of the whole.
        const double depth = part * whole;
        const double x = std::log(steepness * depth) + kFalloff * static_cast<double>(height);
        const double reached =
            (x > 0 ? x + std::log1p(std::exp(-x)) : std::log1p(std::exp(x))) / steepness;
        const auto at = static_cast<double>(
            fog.distance(above, {across, -slant, 0}, static_cast<float>(depth)));
        EXPECT_NEAR(at, reached, 1e-3 * reached + 1e-5 / steepness);
      }
    }
  }
}

core::View in_fog(const core::FogSettings& fog, const core::MaterialDescription& material) {
  core::View view = test_support::view_of(
      test_support::scene_of({material},
                             {test_support::quad({-2, -1, 2}, {4, 0, 0}, {0, 0, -4}, 0)}),
      12, 12);
  test_support::look_at(view, {0, 0.5F, 4}, {0, -0.5F, 0}, 40);
  view.settings.fog = fog;
  view.settings.max_depth = 64;
  return view;
}

TEST(Fog, LosslessFogIsWhiteUnderAWhiteSky) {
  for (const float falloff : {0.0F, 0.8F}) {
    core::View view = in_fog(haze(0.5F, 0, falloff), test_support::lambert(Rgb(1)));
    view.environment = test_support::constant_sky({1, 1, 1});
    expect_truth(test_support::render(view, 512), 1, 4e-3, std::to_string(falloff));
    view.settings.fog = haze(0.5F, 0.02F, falloff);
    EXPECT_LT(test_support::render(view, 32).mean().g, 0.99F) << "the furnace test can fail";
  }
}

TEST(Fog, AbsorbingFogFollowsBeerLambert) {
  core::View view = in_fog(haze(0, 0.4F), test_support::emitter(Rgb(2)));
  test_support::look_at(view, {0, 1, 0}, {0, -1, 0}, 1);
  view.camera.up = Vec3{0, 0, 1};
  view.settings.max_depth = 1;
  expect_truth(test_support::render(view, 4), 2 * std::exp(-0.8), 1e-3, "2 m of fog",
               5e-5);  // half a degree off axis the path is longer
}

// Single scattering between a point light and the camera has no closed form; instead, strategies
// and samplers that share only the scene must agree.
TEST(Fog, StrategiesAgreeOnAnEmitterInFog) {
  core::SceneDescription scene = test_support::cornell();
  core::View view = test_support::view_of(std::move(scene), 12, 12);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.settings.fog = haze(0.6F, 0.2F, 0.5F);
  view.settings.max_depth = 4;
  const auto both = test_support::render(view, 512);
  for (const auto strategy : {core::Strategy::kLight, core::Strategy::kBsdf}) {
    view.settings.estimator.strategy = strategy;
    const auto one = test_support::render(view, 2048);
    const float z = (one.mean().g - both.mean().g) /
                    std::hypot(one.standard_error().g, both.standard_error().g);
    EXPECT_LT(std::fabs(z), 4) << one.mean().g << " and " << both.mean().g;
  }
  view.settings.estimator.strategy = core::Strategy::kMis;
  view.settings.fog = haze(0.6F, 0.4F, 0.5F);
  const auto other = test_support::render(view, 512);
  EXPECT_GT((both.mean().g - other.mean().g) /
                std::hypot(other.standard_error().g, both.standard_error().g),
            4)
      << "more absorption is detected";
}

TEST(Media, AreRefusedByIntegratorsThatDoNotSupportThem) {
  const auto message = [](const core::View& view) {
    const auto renderer = test_support::settled_renderer(view);
    return renderer ? std::string() : renderer.error().message;
  };
  core::View view = ball(milk(0.9F, 1));
  EXPECT_EQ(message(view), "");
  for (const char* name :
       {"direct", "light-trace", "mlt", "sppm", "photon-map", "irradiance-cache"}) {
    view.settings.integrator = name;
    EXPECT_NE(message(view).find("scattering in the scene"), std::string::npos) << name;
  }
  view.settings.integrator = "path";
  view.settings.estimator.control_variate = core::ControlVariateType::kAnalytic;
  EXPECT_NE(message(view).find("a medium that scatters"), std::string::npos);
}

TEST(Media, BitsDoNotDependOnThreads) {
  core::View view = in_fog(haze(0.5F, 0.1F), test_support::lambert(Rgb(0.8F)));
  view.environment = test_support::constant_sky({1, 1, 1});
  EXPECT_EQ(test_support::render(view, 4, 1).film->digest(),
            test_support::render(view, 4, 2).film->digest());
}

}  // namespace
