// Emission sampling of lights: positions and directions against their densities, the power of all
// particles against closed forms, and the light they bring to a receiver against light sampling.
// Fewer than 60 p-values, each rejected below sidak(0.01, 60).
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "core/light_samplers/emission_sampler.h"
#include "core/light_samplers/emitted_light.h"
#include "core/light_samplers/light_sampler.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::EmissionSample;
using core::EmissionSampler;
using core::PunctualType;
using core::Rgb;
using core::Vec2;
using core::Vec3;
using test_support::Random;

constexpr double kPi = std::numbers::pi;
const double kLevel = test_support::sidak(0.01, 60);

constexpr float kInner = 0.3F;
constexpr float kOuter = 0.8F;

core::SceneDescription quad_scene(core::MaterialDescription material) {
  return test_support::scene_of({std::move(material)},
                                {test_support::quad({-2, 1, 0}, {0, 1.5F, 0}, {0.3F, 0, 1}, 0)});
}
const double kQuadArea = 1.5 * std::sqrt(1.09);

core::SceneDescription textured_scene() {
  auto material = test_support::emitter({4, 4, 4});
  material.double_sided = true;
  material.emissive_texture.image = 0;
  material.emissive_texture.nearest = true;
  core::SceneDescription scene = quad_scene(material);
  auto image = std::make_shared<core::Image>();
  image->width = 4;
  image->height = 1;
  image->channels = 3;
  for (const int texel : {255, 0, 255, 255}) {  // 1, 0, 1, 1 in linear colour
    image->bytes.insert(image->bytes.end(), 3, static_cast<std::byte>(texel));
  }
  scene.images.push_back(image);
  return scene;
}

/// Varies with both angles, and is dark in some directions.
std::shared_ptr<const core::IesProfile> uneven_profile() {
  core::IesProfile::Grid grid;
  grid.theta_rad = {0.1F, 0.5F, 1.2F, 1.5F};
  for (const double turn : {0.0, 0.2, 0.5, 1.0}) {
    grid.phi_rad.push_back(static_cast<float>(2 * kPi * turn));
  }
  grid.candela = {1, 5, 2, 0, 4, 0, 0, 3, 2, 7, 1, 0, 1, 5, 2, 0};
  return std::make_shared<const core::IesProfile>(std::move(grid));
}

/// A black floor, so that the scene has a bounding sphere of radius sqrt(2).
core::SceneDescription punctual_scene(PunctualType type, float range_m = 0) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0))}, {test_support::quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 0)});
  core::PunctualLightDescription light;
  light.type = type;
  light.intensity = {3, 3, 3};
  light.range_m = range_m;
  light.inner_cone_rad = kInner;
  light.outer_cone_rad = kOuter;
  light.to_world = core::rotation({std::sin(-0.6F), 0, 0, std::cos(-0.6F)});  // down, along -z
  light.to_world.t = {0.5F, 1.5F, 0.5F};
  if (type == PunctualType::kProfile) {
    light.profile = 0;
    scene.profiles = {uneven_profile()};
  }
  scene.lights.push_back(light);
  return scene;
}
constexpr double kDisk = 2 * kPi;  ///< pi r^2

core::SceneDescription dark_scene() {
  core::SceneDescription scene = punctual_scene(PunctualType::kPoint);
  scene.lights.clear();
  return scene;
}

float texel(int x, int y) { return static_cast<float>(1 + x % 5 + 3 * y); }

struct Lit {
  const char* name;
  std::shared_ptr<const core::Scene> scene;
  std::shared_ptr<const core::Environment> sky;
  double power;  ///< closed form
};

std::vector<Lit> lit_scenes() {
  using test_support::build;
  auto both = test_support::emitter({3, 3, 3});
  both.double_sided = true;
  const double ci = std::cos(static_cast<double>(kInner));
  const double co = std::cos(static_cast<double>(kOuter));
  double sky_power = 0;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      sky_power += static_cast<double>(texel(x, y)) * 2 * kPi / 16 *
                   (std::cos(kPi * y / 8) - std::cos(kPi * (y + 1) / 8));
    }
  }
  return {
      {"one-sided", build(quad_scene(test_support::emitter({3, 3, 3}))), nullptr,
       kPi * kQuadArea * 3},
      {"two-sided", build(quad_scene(both)), nullptr, 2 * kPi * kQuadArea * 3},
      {"textured", build(textured_scene()), nullptr, 2 * kPi * kQuadArea * 4 * 0.75},
      {"point", build(punctual_scene(PunctualType::kPoint)), nullptr, 4 * kPi * 3},
      // The integral of ((c - co) / (ci - co))^2 over the falloff and of 1 over the cap.
      {"spot", build(punctual_scene(PunctualType::kSpot)), nullptr,
       2 * kPi * 3 * ((ci - co) / 3 + 1 - ci)},
      {"profile", build(punctual_scene(PunctualType::kProfile)), nullptr,
       3 * uneven_profile()->lumens()},
      {"directional", build(punctual_scene(PunctualType::kDirectional)), nullptr, 3 * kDisk},
      {"sky", build(dark_scene()), test_support::constant_sky({2, 2, 2}), 2 * 4 * kPi * kDisk},
      {"map", build(dark_scene()),
       test_support::sky_map(
           16, 8, [](int x, int y) { return Rgb(texel(x, y)); }, 40),
       sky_power * kDisk},
  };
}

EmissionSample draw(const EmissionSampler& lights, Random& random) {
  const float u = random.uniform();
  const Vec2 position = random.uniform_2d();
  return lights.sample(u, position, random.uniform_2d());
}

double directions_p(const Lit& lit, float factor) {
  const EmissionSampler lights(lit.scene->data(), lit.sky.get());
  return test_support::chi2_sphere(
             [&](Random& r) -> std::optional<Vec3> { return draw(lights, r).ray.direction; },
             // A quad is two lights with the same density.
             [&](Vec3 w) { return factor * lights.pdf(0, {}, w).pdf_solid_angle; }, 200000, 4)
      .p_value;
}

TEST(EmissionChi2, DirectionsFollowTheDensity) {
  for (const Lit& lit : lit_scenes()) {
    if (lit.name != std::string("directional")) {
      EXPECT_GT(directions_p(lit, 1), kLevel) << lit.name;
    }
  }
}

TEST(EmissionChi2, DetectsADensityTwoPercentTooLarge) {
  for (const Lit& lit : lit_scenes()) {
    if (lit.name != std::string("directional")) {
      EXPECT_LT(directions_p(lit, 1.02F), kLevel) << lit.name;
    }
  }
}

/// Maps the origin to [0,1)^2, uniform if the origin is uniform on its light.
Vec2 unit_position(const core::SceneData& data, const EmissionSample& s) {
  if (s.light < data.triangle_lights.size()) {
    const core::TriangleLight& t = data.triangle_lights[s.light];
    const Vec3 n = cross(t.edge1, t.edge2);
    const float scale = 1 / dot(n, n);
    const Vec3 d = s.ray.origin - t.p0;
    const float b1 = dot(cross(d, t.edge2), n) * scale;
    const float b2 = dot(cross(t.edge1, d), n) * scale;
    return {(b1 + b2) * (b1 + b2), b1 / (b1 + b2)};
  }
  const core::Frame frame = core::frame_from_normal(s.ray.direction);
  const Vec3 d = frame.to_local(s.ray.origin - data.center) * (1 / data.radius_m);
  EXPECT_NEAR(d.z, -1, 1e-5);  // in front of the scene
  return {d.x * d.x + d.y * d.y, std::atan2(d.y, d.x) / (2 * core::kPi) + 0.5F};
}

TEST(EmissionChi2, PositionsAreUniform) {
  constexpr int kSamples = 100000;
  constexpr std::size_t kSide = 12;
  for (const Lit& lit : lit_scenes()) {
    const EmissionSampler lights(lit.scene->data(), lit.sky.get());
    Random random(8);
    std::vector<double> observed(kSide * kSide, 0.0);
    bool is_delta = false;
    for (int i = 0; i < kSamples && !is_delta; ++i) {
      const EmissionSample s = draw(lights, random);
      is_delta = s.is_delta_position;
      if (is_delta) {
        EXPECT_TRUE(s.ray.origin == (Vec3{0.5F, 1.5F, 0.5F})) << lit.name;
        EXPECT_EQ(s.pdf.pdf_area, 1);
        continue;
      }
      const Vec2 at = unit_position(lit.scene->data(), s);
      const auto cell = [](float x) {
        return std::min(static_cast<std::size_t>(std::max(x, 0.0F) * kSide), kSide - 1);
      };
      ++observed[cell(at.y) * kSide + cell(at.x)];
    }
    if (!is_delta) {
      const std::vector<double> expected(observed.size(), kSamples / double{kSide * kSide});
      EXPECT_GT(test_support::chi2(observed, expected).p_value, kLevel) << lit.name;
    }
  }
}

TEST(Emission, SampleReportsTheDensitiesOfPdf) {
  for (const Lit& lit : lit_scenes()) {
    const EmissionSampler lights(lit.scene->data(), lit.sky.get());
    Random random(9);
    for (int i = 0; i < 1000; ++i) {
      const EmissionSample s = draw(lights, random);
      const core::EmissionPdf pdf = lights.pdf(s.light, s.ray.origin, s.ray.direction);
      EXPECT_GT(s.pdf.pdf_area * s.pdf.pdf_solid_angle, 0) << lit.name;
      EXPECT_EQ(s.pdf.prob_light, pdf.prob_light);
      EXPECT_EQ(s.pdf.pdf_solid_angle, pdf.pdf_solid_angle);
      EXPECT_EQ(s.pdf.pdf_area, pdf.pdf_area);
    }
  }
}

/// Balls beside the receiver, over it, and around everything: its points lie in some of them.
void aim_at_balls(EmissionSampler& emission) {
  std::vector<float> lights(emission.size());
  lights.front() = 3;
  lights.back() = 1;
  emission.aim({{{0, 0.1F, -0.2F}, 0.3F, 0.25F},
                {{0.5F, 0.3F, 0.2F}, 0.4F, 0.25F},
                {{0.2F, 0.5F, 0.1F}, 3, 0.25F}},
               lights);
}

// All but a few rays on the edge of a ball, which rounding moves across it. A ray beside the
// emitting side has no light.
TEST(Emission, AimedSamplesReportTheDensitiesOfPdf) {
  for (const Lit& lit : lit_scenes()) {
    EmissionSampler lights(lit.scene->data(), lit.sky.get());
    aim_at_balls(lights);
    Random random(9);
    int apart = 0;
    for (int i = 0; i < 1000; ++i) {
      const EmissionSample s = draw(lights, random);
      const core::EmissionPdf pdf = lights.pdf(s.light, s.ray.origin, s.ray.direction);
      EXPECT_GT(s.pdf.pdf_area * s.pdf.pdf_solid_angle, 0) << lit.name;
      EXPECT_EQ(s.pdf.prob_light, pdf.prob_light);
      const float ratio =
          s.pdf.pdf_area * s.pdf.pdf_solid_angle / (pdf.pdf_area * pdf.pdf_solid_angle);
      apart += std::fabs(ratio - 1) > 1e-4F ? 1 : 0;
    }
    EXPECT_LE(apart, 2) << lit.name;
  }
}

test_support::Moments power_of(const EmissionSampler& lights) {
  Random random(10);
  test_support::Moments power;
  for (int i = 0; i < 100000; ++i) {
    power.add(static_cast<double>(draw(lights, random).weight().g));
  }
  return power;
}

TEST(Emission, ParticlesCarryThePowerOfTheLights) {
  for (const Lit& lit : lit_scenes()) {
    const auto power = power_of(EmissionSampler(lit.scene->data(), lit.sky.get()));
    // Float rounding per particle, which is the same for all if all weights are equal; texels of
    // the map are weighted at their centre, which is off by at most 1e-3.
    EXPECT_NEAR(power.mean, lit.power, 4 * power.standard_error() + 1e-4 * lit.power) << lit.name;
  }
}

core::SceneDescription all_lights() {
  core::SceneDescription scene = textured_scene();
  for (const PunctualType type :
       {PunctualType::kPoint, PunctualType::kSpot, PunctualType::kDirectional}) {
    scene.lights.push_back(punctual_scene(type, 3).lights[0]);
  }
  return scene;
}

TEST(Emission, SelectsLightsByTheirPower) {
  const auto scene = test_support::build(all_lights());
  const auto sky = test_support::constant_sky({0.1F, 0.1F, 0.1F});
  const EmissionSampler lights(scene->data(), sky.get());
  const auto powers = core::light_powers(scene->data(), sky.get());
  double total = 0;
  for (const float power : powers) {
    total += static_cast<double>(power);
  }
  constexpr int kSamples = 100000;
  std::vector<double> observed(powers.size(), 0.0);
  std::vector<double> expected;
  for (std::uint32_t i = 0; i < powers.size(); ++i) {
    expected.push_back(static_cast<double>(powers[i]) / total * kSamples);
    EXPECT_NEAR(lights.pdf(i, {}, {0, 1, 0}).prob_light * kSamples, expected.back(), 0.1);
  }
  Random random(11);
  for (int i = 0; i < kSamples; ++i) {
    ++observed[draw(lights, random).light];
  }
  EXPECT_GT(test_support::chi2(observed, expected).p_value, kLevel);
}

// A float cannot resolve fractions of the total below 2^-24.
TEST(Emission, SamplesAnEmitterInTheSceneOfASun) {
  core::SceneDescription description = all_lights();
  description.lights.back().intensity = Rgb(1e15F);
  const auto scene = test_support::build(std::move(description));
  const EmissionSampler lights(scene->data(), nullptr);
  for (std::uint32_t i = 0; i < 4; ++i) {
    EXPECT_GT(lights.pdf(i, {}, {0, 1, 0}).prob_light, 0.5e-6F);
  }
}

/// A square that faces up, and its unoccluded incident power [W].
struct Receiver {
  Vec3 corner;
  float side = 0.6F;
};

test_support::Moments received_from_particles(const EmissionSampler& lights, Receiver r,
                                              const std::function<float(float)>& bend) {
  Random random(12);
  test_support::Moments sum;
  for (int i = 0; i < 400000; ++i) {
    const EmissionSample s = draw(lights, random);
    const float t = (r.corner.y - s.ray.origin.y) / s.ray.direction.y;
    const Vec3 at = s.ray.origin + s.ray.direction * t;
    const bool meets = s.ray.direction.y < 0 && t > 0 && at.x >= r.corner.x &&
                       at.x < r.corner.x + r.side && at.z >= r.corner.z &&
                       at.z < r.corner.z + r.side;
    sum.add(meets ? static_cast<double>(s.weight().g * lights.range_factor(s.light, t) *
                                        bend(-s.ray.direction.y))
                  : 0.0);
  }
  return sum;
}

test_support::Moments received_by_light_sampling(const core::LightSampler& lights, Receiver r) {
  Random random(13);
  test_support::Moments sum;
  for (int i = 0; i < 400000; ++i) {
    const Vec2 u = random.uniform_2d();
    const Vec3 at = r.corner + Vec3{u.x * r.side, 0, u.y * r.side};
    const float pick = random.uniform();
    const auto s = lights.sample(at, {0, 1, 0}, pick, random.uniform_2d());
    sum.add(
        s.pdf_solid_angle > 0 && s.wi_world.y > 0
            ? static_cast<double>(s.radiance.g * s.wi_world.y / s.pdf_solid_angle * r.side * r.side)
            : 0.0);
  }
  return sum;
}

double difference_z(const Lit& lit, const std::function<float(float)>& bend,
                    const std::function<void(EmissionSampler&)>& aim = {}) {
  const Receiver receiver = {{-0.3F, 0.1F, -0.4F}};
  EmissionSampler emission(lit.scene->data(), lit.sky.get());
  if (aim) {
    aim(emission);
  }
  const core::LightSampler lights(lit.scene->data(), lit.sky.get(), core::LightPick::kUniform);
  const auto a = received_from_particles(emission, receiver, bend);
  const auto b = received_by_light_sampling(lights, receiver);
  return (a.mean - b.mean) / std::hypot(a.standard_error(), b.standard_error());
}

std::vector<Lit> receivers_lights() {
  std::vector<Lit> scenes = lit_scenes();
  scenes.push_back({"point with a range",
                    test_support::build(punctual_scene(PunctualType::kPoint, 2)), nullptr, 0});
  return scenes;
}

TEST(Emission, DeliversTheIrradianceOfLightSampling) {
  for (const Lit& lit : receivers_lights()) {
    const double z = difference_z(lit, [](float) { return 1.0F; });
    EXPECT_GT(test_support::two_sided_p(z), kLevel) << lit.name;
  }
}

// Radius and distance of the eyes are those of four disks.
TEST(Emission, DeliversTheSameWhereItIsAimed) {
  const auto at = [](Vec3 eye) {
    return [eye](EmissionSampler& emission) { emission.aim(eye, 0.1F); };
  };
  const std::array<std::function<void(EmissionSampler&)>, 3> aims = {
      at({0.5F, 0.3F, 0.2F}), at({0, 0.2F, -0.1F}), aim_at_balls};
  for (const Lit& lit : receivers_lights()) {
    for (const auto& aim : aims) {
      const double z = difference_z(
          lit, [](float) { return 1.0F; }, aim);
      EXPECT_GT(test_support::two_sided_p(z), kLevel) << lit.name;
      const double bent = difference_z(
          lit, [](float cosine) { return cosine; }, aim);
      EXPECT_LT(test_support::two_sided_p(bent), kLevel) << lit.name;
    }
  }
}

// Weights of n disks are at most n times those of one; near the eye they are as small as the
// smallest disk: 2^-2(n-1) of the scene's, n times. Half the radius around the eye gets a quarter
// of the sun's power; with the density of one disk it would not.
TEST(Emission, AimsDistantLightsWithBoundedWeights) {
  const auto scene = test_support::build(punctual_scene(PunctualType::kDirectional));
  EmissionSampler lights(scene->data(), nullptr);
  const auto disk = static_cast<float>(kDisk);
  const Vec3 eye = {0, 0.2F, 0};
  lights.aim(eye, 0.1F);  // sqrt(2) / 2^3 = 0.18 is the least above 0.1
  constexpr float kDisks = 4;
  Random random(14);
  float least = 1e9F;
  float most = 0;
  test_support::Moments within;
  test_support::Moments wrong;
  for (int i = 0; i < 100000; ++i) {
    const EmissionSample s = draw(lights, random);
    least = std::min(least, 1 / (s.pdf.pdf_area * disk));
    most = std::max(most, 1 / (s.pdf.pdf_area * disk));
    const Vec3 to = s.ray.origin - eye;
    const Vec3 d = s.ray.direction;
    const bool is_inside = core::length(to - d * core::dot(to, d)) <= std::sqrt(2.0F) / 2;
    within.add(is_inside ? static_cast<double>(s.weight().g) : 0.0);
    wrong.add(is_inside ? 3.0 * kDisk : 0.0);
  }
  EXPECT_LE(most, kDisks * 1.0001F);
  EXPECT_NEAR(least, kDisks / (1 + 4 + 16 + 64), 1e-4F);
  EXPECT_NEAR(within.mean, 3 * kDisk / 4, 4 * within.standard_error());
  EXPECT_GT(std::fabs(wrong.mean - 3 * kDisk / 4), 20 * wrong.standard_error());
}

TEST(Emission, DetectsAnExtraCosineAtTheReceiver) {
  for (const Lit& lit : receivers_lights()) {
    const double z = difference_z(lit, [](float cosine) { return cosine; });
    EXPECT_LT(test_support::two_sided_p(z), kLevel) << lit.name;
  }
}

}  // namespace
