// Directions to lights against the density that MIS uses. About 30 p-values, each rejected below
// sidak(0.01, 60) = 1.7e-4.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/light_samplers/light_sampler.h"
#include "core/settings/choices.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Environment;
using core::LightPick;
using core::LightSampler;
using core::Rgb;
using core::Vec3;
using test_support::Random;

/// The ways in which the light samplers of the registry pick a light, each once, with a name.
std::vector<std::pair<LightPick, std::string_view>> picks() {
  std::vector<std::pair<LightPick, std::string_view>> out;
  for (const auto& type : core::light_samplers()) {
    const LightPick pick = core::light_pick(type.value);
    if (std::none_of(out.begin(), out.end(),
                     [pick](const auto& one) { return one.first == pick; })) {
      out.emplace_back(pick, type.name);
    }
  }
  return out;
}

const double kLevel = test_support::sidak(0.01, 60);

/// Uses cells of half a texel of a map of width x height. In a cell the density times sin(theta) is
/// constant, so its mass is exact; the density is evaluated at two points of the cell.
double environment_p(const Environment& environment, int width, int height,
                     double rotation_degrees = 0,
                     core::SkyDensity density = core::SkyDensity::kRadiance) {
  const int columns = 2 * width;
  const int rows = 2 * height;
  constexpr double kPi = std::numbers::pi;
  constexpr int kSamples = 300000;
  const double turn = rotation_degrees * kPi / 180;
  std::vector<double> observed(static_cast<std::size_t>(columns * rows), 0.0);
  std::vector<double> expected(observed.size(), 0.0);
  Random random(3);
  for (int i = 0; i < kSamples; ++i) {
    const auto s = environment.sample(random.uniform_2d(), density);
    EXPECT_GT(s.pdf_solid_angle, 0);
    // A map rotated counter-clockwise seen from above: phi in the map is phi in the world plus the
    // rotation (z is south).
    const double phi =
        std::atan2(static_cast<double>(s.wi_world.z), static_cast<double>(s.wi_world.x)) + turn;
    const double u = 0.5 + phi / (2 * kPi);
    const double r =
        std::hypot(static_cast<double>(s.wi_world.x), static_cast<double>(s.wi_world.z));
    const double v = std::atan2(r, static_cast<double>(s.wi_world.y)) / kPi;
    const auto column =
        static_cast<std::size_t>((u - std::floor(u)) * columns) % static_cast<std::size_t>(columns);
    const auto row =
        std::min(static_cast<std::size_t>(v * rows), static_cast<std::size_t>(rows - 1));
    ++observed[row * static_cast<std::size_t>(columns) + column];
  }
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      double mass[2];
      for (int k = 0; k < 2; ++k) {
        const double theta = kPi * (row + 0.3 + 0.4 * k) / rows;
        const double phi = 2 * kPi * ((column + 0.6 - 0.2 * k) / columns - 0.5) - turn;
        const Vec3 d = {static_cast<float>(std::sin(theta) * std::cos(phi)),
                        static_cast<float>(std::cos(theta)),
                        static_cast<float>(std::sin(theta) * std::sin(phi))};
        mass[k] = static_cast<double>(environment.pdf_solid_angle(d, density)) * std::sin(theta) *
                  2 * kPi * kPi / (columns * rows);
      }
      if (width > 1) {
        EXPECT_NEAR(mass[0], mass[1], 1e-4 * mass[0] + 1e-12);
      }
      expected[static_cast<std::size_t>(row * columns + column)] =
          0.5 * (mass[0] + mass[1]) * kSamples;
    }
  }
  return test_support::chi2(observed, expected).p_value;
}

double constant_sky_p() {
  const auto sky = test_support::constant_sky({1, 1, 1});
  return test_support::chi2_sphere(
             [&](Random& r) { return std::optional<Vec3>(sky->sample(r.uniform_2d()).wi_world); },
             [&](Vec3 w) { return sky->pdf_solid_angle(w); }, 300000, 3)
      .p_value;
}

TEST(EnvironmentChi2, SamplesFollowTheDensity) {
  using test_support::sky_map;
  EXPECT_GT(constant_sky_p(), kLevel);
  EXPECT_GT(
      environment_p(
          *sky_map(16, 8, [](int x, int y) { return Rgb(static_cast<float>(1 + x + 3 * y)); }), 16,
          8),
      kLevel);
  const auto sun = [](int x, int y) { return x == 20 && y == 9 ? Rgb(5000) : Rgb(0.3F); };
  EXPECT_GT(environment_p(*sky_map(64, 32, sun), 64, 32), kLevel);
  EXPECT_GT(environment_p(*sky_map(64, 32, sun, 77), 64, 32, 77), kLevel);
  const auto zenith = [](int, int y) { return y == 0 ? Rgb(1000) : Rgb(0.1F); };
  EXPECT_GT(environment_p(*sky_map(64, 32, zenith), 64, 32), kLevel);
  EXPECT_GT(environment_p(*sky_map(512, 256, zenith), 512, 256), kLevel);
  EXPECT_GT(environment_p(*sky_map(8, 4,
                                   [](int x, int) {
                                     return x == 3 ? Rgb{0, 1, 0} : Rgb{};
                                   }),
                          8, 4),
            kLevel);
}

TEST(EnvironmentChi2, CompensatedSamplesFollowTheirDensity) {
  const auto slope = test_support::sky_map(
      16, 8, [](int x, int y) { return Rgb(static_cast<float>(1 + x + 3 * y)); }, 77);
  EXPECT_GT(environment_p(*slope, 16, 8, 77, core::SkyDensity::kCompensated), kLevel);
  const auto sky = test_support::sky_map(
      16, 8, [](int x, int y) { return y == 3 && x == 5 ? Rgb(1000) : Rgb(1); });
  // The mean is about 13, and the rest of the map is below half of it.
  EXPECT_EQ(sky->pdf_solid_angle({0, 0.8F, 0.6F}, core::SkyDensity::kCompensated), 0);
  EXPECT_GT(sky->pdf_solid_angle({0, 0.8F, 0.6F}), 0);
}

TEST(EnvironmentChi2, DetectsAMapRotatedTheOtherWay) {
  const auto sun = [](int x, int y) { return x == 20 && y == 9 ? Rgb(5000) : Rgb(0.3F); };
  EXPECT_LT(environment_p(*test_support::sky_map(64, 32, sun, 77), 64, 32, -77), kLevel);
}

// sample() returns the radiance that a ray in that direction finds: a bright light never has the
// density of a dark texel.
TEST(EnvironmentSample, RadianceAndDensityAreConsistent) {
  for (const int bright_row : {0, 1, 300, 511}) {
    const auto map = test_support::sky_map(1024, 512, [&](int x, int y) {
      return y == bright_row && x % 8 == 3 ? Rgb(1e5F) : Rgb(1);
    });
    Random random(5);
    test_support::Moments ratio;
    for (int i = 0; i < 400000; ++i) {
      const auto s = map->sample(random.uniform_2d());
      ASSERT_GT(s.pdf_solid_angle, 0);
      ratio.add(static_cast<double>(core::luminance(s.radiance) / s.pdf_solid_angle));
    }
    // Radiance is proportional to density up to the variation of sin(theta) over a texel: every
    // sample is near the mean.
    const double power = static_cast<double>(map->power_luminance());
    EXPECT_NEAR(ratio.mean, power, 2e-3 * power) << bright_row;
    EXPECT_LT(std::sqrt(ratio.variance()), 0.6 * power) << bright_row;
  }
}

TEST(EnvironmentSample, IntegralIsTheSumOverTexels) {
  const auto map = test_support::sky_map(
      32, 16, [](int x, int y) { return Rgb(static_cast<float>((x * 7 + y * 5) % 11)); });
  double sum = 0;
  for (int y = 0; y < 16; ++y) {
    const double solid =
        2 * std::numbers::pi / 32 *
        (std::cos(std::numbers::pi * y / 16) - std::cos(std::numbers::pi * (y + 1) / 16));
    for (int x = 0; x < 32; ++x) {
      sum += solid * ((x * 7 + y * 5) % 11);
    }
  }
  EXPECT_NEAR(map->power_luminance(), sum, 1e-4 * sum);
}

/// Triangles at different distances, one above another, one two-sided, one seen from behind; also a
/// point light (delta).
core::SceneDescription lights_scene(bool punctual) {
  auto both = test_support::emitter({3, 3, 3});
  both.double_sided = true;
  core::SceneDescription scene = test_support::scene_of(
      {test_support::emitter({5, 4, 1}), both, test_support::lambert(Rgb(0.5F))},
      {test_support::quad({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, 0),              // above, faces down
       test_support::quad({-0.4F, 1, -0.4F}, {0.8F, 0, 0}, {0, 0, 0.8F}, 0),  // in front of it
       test_support::quad({1.5F, 0.2F, -1}, {0, 1, 0}, {0, 0, 2}, 1),   // two-sided, to the side
       test_support::quad({-1.5F, 0.2F, -1}, {0, 0, 2}, {0, 1, 0}, 0),  // faces +x
       test_support::quad({-3, 0, 3}, {0, 2, 0}, {6, 0, 0}, 0),         // faces away from the point
       test_support::quad({-5, -1, -5}, {0, 0, 10}, {10, 0, 0}, 2)});
  if (punctual) {
    core::PunctualLightDescription light;
    light.to_world = core::translation({0.3F, 0.8F, 0.2F});
    scene.lights.push_back(light);
  }
  return scene;
}

template <typename Lights>
float density(const core::SceneData& data, const Lights& lights, Vec3 point, Vec3 normal, Vec3 wi) {
  float sum = lights.pdf_environment(wi, point, normal);
  for (std::uint32_t i = 0; i < data.triangle_lights.size(); ++i) {
    const core::TriangleLight& t = data.triangle_lights[i];
    const float facing = -dot(t.normal, wi);
    if (facing == 0 || (facing < 0 && !t.two_sided)) {
      continue;
    }
    // Moeller and Trumbore.
    const Vec3 p = cross(wi, t.edge2);
    const float det = dot(t.edge1, p);
    const Vec3 from = point - t.p0;
    const float u = dot(from, p) / det;
    const Vec3 q = cross(from, t.edge1);
    const float v = dot(wi, q) / det;
    const float distance = dot(t.edge2, q) / det;
    if (det != 0 && u >= 0 && v >= 0 && u + v <= 1 && distance > 0) {
      sum += lights.pdf_triangle(i, point, normal, distance, std::fabs(facing));
    }
  }
  return sum;
}

TEST(LightSamplerChi2, DirectionsFollowTheDensityThatMisUses) {
  const auto sky = test_support::sky_map(
      16, 8, [](int x, int y) { return Rgb(static_cast<float>(1 + x % 3 + y)); });
  const auto plain = test_support::constant_sky(Rgb(2));
  for (const auto& [pick, name] : picks()) {
    for (const int lights_more : {0, 1, 2, 3, 4}) {
      const bool punctual = lights_more > 0;
      const bool environment = lights_more > 1;
      const bool constant = lights_more > 2;  // is sampled over the hemisphere
      const bool by_cosine = lights_more == 3;
      const auto scene = test_support::build(lights_scene(punctual));
      const core::MisLightSampler lights(
          scene->data(), environment ? (constant ? plain : sky).get() : nullptr, pick,
          by_cosine ? core::SkyDensity::kCompensated : core::SkyDensity::kRadiance);
      for (const Vec3 normal : {Vec3{0, 1, 0}, Vec3{}}) {
        const Vec3 point = {0.1F, 0, -0.2F};
        const auto report = test_support::chi2_sphere(
            [&](Random& r) -> std::optional<Vec3> {
              const float u_pick = r.uniform();
              const auto s = lights.sample(point, normal, u_pick, r.uniform_2d());
              if (!(s.pdf_solid_angle > 0) || s.is_delta) {
                return std::nullopt;
              }
              return s.wi_world;
            },
            [&](Vec3 w) { return density(scene->data(), lights, point, normal, w); }, 100000, 4,
            {.rows = 14, .columns = 16, .depth_least = 3, .depth_most = 8});
        EXPECT_GT(report.p_value, kLevel)
            << name << (punctual ? " punctual" : "") << (environment ? " sky" : "")
            << (constant ? " constant" : "") << (by_cosine ? " cosine" : "") << " normal "
            << normal.y;
      }
    }
  }
}

/// A dim emitter overhead, under a sky: p-value of directions from the tree against the densities
/// for MIS, evaluated `asked` metres above the shading point of the samples.
double p_of_share(float lamp, float asked) {
  const auto scene = test_support::build(
      test_support::scene_of({test_support::emitter(Rgb(lamp))},
                             {test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 0)}));
  const auto sky = test_support::constant_sky(Rgb(1));
  const LightSampler lights(scene->data(), sky.get(), LightPick::kTree);
  const Vec3 normal = {0, 1, 0};
  return test_support::chi2_sphere(
             [&](Random& r) -> std::optional<Vec3> {
               const float u_pick = r.uniform();
               const auto s = lights.sample({}, normal, u_pick, r.uniform_2d());
               return s.pdf_solid_angle > 0 ? std::optional(s.wi_world) : std::nullopt;
             },
             [&](Vec3 w) {
               return density(scene->data(), lights, {}, normal, w) -
                      lights.pdf_environment(w, {}, normal) +
                      lights.pdf_environment(w, {0, asked, 0}, normal);
             },
             200000, 4, {.rows = 14, .columns = 16, .depth_least = 3, .depth_most = 8})
      .p_value;
}

TEST(LightSamplerChi2, ProbabilityOfTheSkyIsThatOfThePoint) {
  for (const float lamp : {1e-4F, 0.02F, 1.0F, 300.0F}) {
    EXPECT_GT(p_of_share(lamp, 0), kLevel) << lamp;
  }
}

TEST(LightSamplerChi2, DetectsTheProbabilityOfAnotherPoint) {
  EXPECT_LT(p_of_share(1, -30), kLevel);
}

/// Fraction of samples of the sky at a point below an emitter of this radiance.
double share_of_sky(float lamp, float sky_radiance) {
  const auto scene = test_support::build(
      test_support::scene_of({test_support::emitter(Rgb(lamp))},
                             {test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 0)}));
  const auto sky = test_support::constant_sky(Rgb(sky_radiance));
  const LightSampler lights(scene->data(), sky.get(), LightPick::kTree);
  // A constant sky is sampled evenly over the hemisphere.
  const float density = lights.pdf_environment({0, 1, 0}, {}, {0, 1, 0});
  return 2 * std::numbers::pi * static_cast<double>(density);
}

TEST(LightSampler, NearlyBlackEmitterLeavesTheSamplesToTheSky) {
  EXPECT_GT(share_of_sky(1e-6F, 1), 0.999);
  EXPECT_LT(share_of_sky(1e6F, 1), 0.001);
}

// Occlusion is unknown: an emitter with a few percent of the light may be the only visible one.
TEST(LightSampler, FaintEmitterOrSkyKeepsTwoFifthsOfTheSamples) {
  EXPECT_NEAR(share_of_sky(0.1F, 1), 0.6, 1e-6);
  EXPECT_NEAR(share_of_sky(30, 1), 0.4, 1e-6);
}

TEST(LightSamplerChi2, DetectsADensityTwoPercentTooLarge) {
  const auto scene = test_support::build(lights_scene(false));
  const LightSampler lights(scene->data(), nullptr, LightPick::kUniform);
  const auto report = test_support::chi2_sphere(
      [&](Random& r) -> std::optional<Vec3> {
        const float u_pick = r.uniform();
        const auto s = lights.sample({}, {}, u_pick, r.uniform_2d());
        return s.pdf_solid_angle > 0 ? std::optional(s.wi_world) : std::nullopt;
      },
      [&](Vec3 w) { return 1.02F * density(scene->data(), lights, {}, {}, w); }, 500000, 4);
  EXPECT_LT(report.p_value, kLevel);
}

// The density that sample() reports equals the density that a BSDF sample would get there.
TEST(LightSampler, TypesThatReuseSamplesPickByTheTree) {
  using core::LightSamplerType;
  EXPECT_EQ(core::light_pick(LightSamplerType::kUniform), LightPick::kUniform);
  EXPECT_EQ(core::light_pick(LightSamplerType::kPower), LightPick::kPower);
  for (const auto type :
       {LightSamplerType::kTree, LightSamplerType::kRis, LightSamplerType::kRestir}) {
    EXPECT_EQ(core::light_pick(type), LightPick::kTree);
  }
  EXPECT_EQ(core::light_reuse(LightSamplerType::kTree), core::LightReuse::kNone);
  EXPECT_EQ(core::light_reuse(LightSamplerType::kRis), core::LightReuse::kResample);
  EXPECT_EQ(core::light_reuse(LightSamplerType::kRestir), core::LightReuse::kShare);
}

TEST(LightSampler, SampleReportsTheDensityOfPdfTriangle) {
  const auto scene = test_support::build(lights_scene(false));
  for (const auto& [pick, name] : picks()) {
    const LightSampler lights(scene->data(), nullptr, pick);
    Random random(6);
    int outer = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 point = {random.uniform() - 0.5F, 0.1F, random.uniform() - 0.5F};
      const float u_pick = random.uniform();
      const auto s = lights.sample(point, {0, 1, 0}, u_pick, random.uniform_2d());
      if (!(s.pdf_solid_angle > 0)) {
        continue;
      }
      // Several lights may lie along one direction: the sampled one is among them.
      const float all = density(scene->data(), lights, point, {0, 1, 0}, s.wi_world);
      if (all < s.pdf_solid_angle * 0.999F) {
        ++outer;  // on an edge that the intersection misses
      }
    }
    EXPECT_LT(outer, 10) << name;
  }
}

/// 300 small emitters of very different power and direction.
core::LightTree tree_of(int count, std::vector<core::LightBounds>& bounds) {
  Random random(9);
  for (int i = 0; i < count; ++i) {
    core::LightBounds b;
    const Vec3 at = {10 * random.uniform(), 10 * random.uniform(), 10 * random.uniform()};
    b.box.add(at);
    b.box.add(at + Vec3{random.uniform(), random.uniform(), random.uniform()} * 0.3F);
    b.axis =
        normalize(Vec3{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F});
    b.cos_theta_o = 1;
    b.cos_theta_e = i % 5 == 0 ? -1.0F : 0.0F;
    b.power = std::exp(3 * static_cast<float>(random.normal()));
    b.two_sided = i % 7 == 0;
    bounds.push_back(b);
  }
  return core::LightTree(bounds);
}

struct Pick {
  std::uint32_t light;
  float prob_light;
};
Pick pick_one(const core::LightTree& tree, Vec3 point, Vec3 normal, float u) {
  const auto picks = tree.pick(core::Mask<1>::of(1), core::Vec3s<1>(point), core::Vec3s<1>(normal),
                               core::Floats<1>(u));
  return {static_cast<std::uint32_t>(picks.light.v[0]), picks.prob_light.v[0]};
}

TEST(LightTree, ProbabilitiesSumToOneAndEqualTheFrequencies) {
  std::vector<core::LightBounds> bounds;
  const core::LightTree tree = tree_of(300, bounds);
  Random random(10);
  for (int round = 0; round < 12; ++round) {
    const Vec3 point = {12 * random.uniform() - 1, 12 * random.uniform() - 1,
                        12 * random.uniform() - 1};
    const Vec3 normal = round % 3 == 0
                            ? Vec3{}
                            : normalize(Vec3{random.uniform() - 0.5F, random.uniform() - 0.5F,
                                             random.uniform() - 0.5F});
    constexpr int kPicks = 200000;
    std::vector<double> observed(301, 0.0);
    std::vector<double> expected(301, 0.0);
    double sum = 0;
    for (std::uint32_t i = 0; i < 300; ++i) {
      const double p = static_cast<double>(tree.prob_light(point, normal, i));
      expected[i] = p * kPicks;
      sum += p;
    }
    for (int i = 0; i < kPicks; ++i) {
      const Pick pick = pick_one(tree, point, normal, random.uniform());
      if (pick.prob_light > 0) {
        ++observed[pick.light];
        ASSERT_NEAR(pick.prob_light, tree.prob_light(point, normal, pick.light), 1e-6F);
      } else {
        ++observed[300];
      }
    }
    // If a branch was taken whose children are both invisible, the sum is below 1: the remainder
    // has its own cell.
    EXPECT_LE(sum, 1 + 1e-5);
    expected[300] = std::max(1 - sum, 0.0) * kPicks;
    if (expected[300] < 2) {
      EXPECT_NEAR(sum, 1, 1e-5);
      expected[300] = observed[300];
    }
    EXPECT_GT(test_support::chi2(observed, expected).p_value, kLevel) << round;
  }
}

TEST(LightTree, NoLightThatIlluminatesThePointIsLeftOut) {
  const auto scene = test_support::build(lights_scene(true));
  const auto& data = scene->data();
  Random random(11);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 point = {3 * random.uniform() - 1.5F, 3 * random.uniform() - 0.5F,
                        3 * random.uniform() - 1.5F};
    const Vec3 normal =
        normalize(Vec3{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F});
    const auto light = static_cast<std::uint32_t>(random.bits() % data.triangle_lights.size());
    const auto& t = data.triangle_lights[light];
    const core::Vec2 b = {0.9F * random.uniform(), 0.05F};
    const Vec3 to = t.p0 + t.edge1 * b.x + t.edge2 * b.y - point;
    const Vec3 wi = normalize(to);
    if (dot(wi, normal) > 0.01F &&
        (t.two_sided ? std::fabs(dot(wi, t.normal)) : -dot(wi, t.normal)) > 0.01F) {
      ASSERT_GT(data.light_tree.prob_light(point, normal, light), 0);
    }
  }
}

/// Profiles that each emit into one cone, in trees with other lights.
TEST(LightTree, NoProfileThatIlluminatesThePointIsLeftOut) {
  std::vector<std::unique_ptr<core::IesProfile>> profiles;
  std::vector<core::PunctualLight> lights;
  std::vector<core::LightBounds> bounds;
  Random random(13);
  for (int i = 0; i < 12; ++i) {
    core::IesProfile::Grid grid;
    const float reach = 0.2F * static_cast<float>(1 + i);
    grid.theta_rad = {0, 0.5F * reach, reach};
    grid.phi_rad = {0, 6.2831855F};
    grid.candela = {3, 2, static_cast<float>(i % 2), 3, 2, static_cast<float>(i % 2)};
    profiles.push_back(std::make_unique<core::IesProfile>(std::move(grid)));
    core::PunctualLightDescription light;
    light.type = core::PunctualType::kProfile;
    light.to_world = core::rotation(
        {std::sin(0.3F * static_cast<float>(i)), 0, 0, std::cos(0.3F * static_cast<float>(i))});
    light.to_world.t = {random.uniform(), random.uniform(), random.uniform()};
    lights.push_back(core::punctual_light(light, profiles.back().get()));
    bounds.push_back(core::light_bounds(lights.back()));
  }
  const core::LightTree tree(bounds);
  int lit = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 point = {4 * random.uniform() - 2, 4 * random.uniform() - 2,
                        4 * random.uniform() - 2};
    for (std::uint32_t light = 0; light < lights.size(); ++light) {
      Vec3 wi;
      float distance_m = 0;
      if (!is_black(lights[light].arriving(point, wi, distance_m))) {
        ++lit;
        ASSERT_GT(tree.prob_light(point, {}, light), 0) << light;
      }
    }
  }
  EXPECT_GT(lit, 50000);
}

TEST(LightTree, ScalesTo300000Lights) {
  std::vector<core::LightBounds> bounds;
  const core::LightTree tree = tree_of(300000, bounds);
  Random random(12);
  int nothing = 0;
  for (int i = 0; i < 1000; ++i) {
    const Pick pick = pick_one(tree, {5, 5, 5}, {0, 1, 0}, random.uniform());
    if (!(pick.prob_light > 0)) {
      ++nothing;
      continue;
    }
    ASSERT_NEAR(tree.prob_light({5, 5, 5}, {0, 1, 0}, pick.light), pick.prob_light,
                1e-4F * pick.prob_light);
  }
  EXPECT_LT(nothing, 100) << "selections that end where no light can illuminate the point";
}

}  // namespace
