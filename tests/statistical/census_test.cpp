// The census of particles against closed forms: a sun that a mirror folds onto a diffuse floor, and
// a closed sphere. Exact intervals of 200 small censuses cover at least 95 %. Each fault is
// planted, and is seen.
#include "core/integrators/census.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/statistics.h"
#include "core/render/picture/light_not_found.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/least_covered.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::CensusHits;
using core::LightCensus;
using core::LightRoute;
using core::Rgb;
using core::Vec3;

constexpr int kSeeds = 200;
const double kCoveredLeast = test_support::least_covered(kSeeds);
constexpr double kAlpha = 0.025;  // of each end
constexpr float kAlbedo = 0.7F;

/// A horizontal sun of `irradiance`, which a mirror at 45 degrees folds straight down onto a floor;
/// the camera looks down at the floor from below the mirror.
core::View folded_sun(float irradiance, const char* integrator = "path", float roughness = 0) {
  core::MaterialDescription mirror = test_support::mirror();
  mirror.name = "mirror";
  mirror.roughness = roughness;
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(kAlbedo)), mirror},
      {test_support::quad({-0.9F, 0, 0.5F}, {1.8F, 0, 0}, {0, 0, -1}, 0),
       test_support::quad({-0.95F, 3.15F, 0.5F}, {0, 0, -1}, {1.9F, -1.9F, 0}, 1)});
  scene.lights.push_back(
      test_support::directional({{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, {}}, Rgb(irradiance)));
  scene.lights[0].name = "sun";
  core::View view = test_support::view_of(std::move(scene), 32, 8);
  test_support::look_at(view, {0, 1, 0}, {0, 0, 0},
                        2 * std::atan(0.1F) * 180 / std::numbers::pi_v<float>);
  view.camera.up = Vec3{0, 0, -1};
  view.settings.integrator = integrator;
  view.settings.max_depth = 4;
  return view;
}

/// From inside a sphere that emits 1 and reflects half.
core::View closed_sphere() {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(1);
  core::View view = test_support::view_of(
      test_support::scene_of({lamp}, {test_support::sphere({}, 1, 48, true, 0)}), 32, 16);
  test_support::look_at(view, {0, 0, 0}, {0, 0, -1}, 40);
  view.settings.max_depth = 3;
  return view;
}

std::unique_ptr<LightCensus> census_of(const core::View& view, const core::Camera& camera,
                                       int particles, std::uint64_t stream = core::kCensusStream) {
  const core::FilmSettings& film = view.settings.film;
  auto census = std::make_unique<LightCensus>(
      core::IntegratorInput{view.scene->data(), view.environment.get(), view.settings, &camera},
      core::tile_rects({0, 0, film.width, film.height}), stream);
  census->trace(0, particles);
  return census;
}

core::Camera still_camera(const core::View& view) {
  auto camera = core::Camera::create(view.camera, {}, view.scene->summary().bounds,
                                     view.settings.film.width, view.settings.film.height);
  EXPECT_TRUE(camera);
  return *camera;
}

double hits_of(const LightCensus& census, LightRoute route) {
  const CensusHits hits = census.hits(0, route);
  return hits.open + hits.held;
}

/// Number of seeds whose exact interval of the tile's luminance covers `truth`.
int covered(core::View view, double truth, const std::vector<LightRoute>& routes, int particles) {
  const core::Camera camera = still_camera(view);
  int count = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    view.settings.seed = static_cast<std::uint64_t>(seed);
    const auto census = census_of(view, camera, particles);
    double hits = 0;
    for (const LightRoute route : routes) {
      hits += hits_of(*census, route);
    }
    const double unit = census->unit(0);
    count += unit * core::binomial_lower(hits, particles, kAlpha) <= truth &&
                     truth <= unit * core::binomial_upper(hits, particles, kAlpha)
                 ? 1
                 : 0;
  }
  return count;
}

constexpr LightRoute kFolded = {LightRoute::kCaustic, true, false};
constexpr double kFoldedLuminance = static_cast<double>(kAlbedo) / std::numbers::pi;

TEST(Census, CoversTheLightThatAMirrorFoldsOntoAFloor) {
  EXPECT_GE(covered(folded_sun(1), kFoldedLuminance, {kFolded}, 8192), kCoveredLeast);
}

TEST(Census, SeesParticlesThatWeighAFifthTooMuch) {
  EXPECT_LT(covered(folded_sun(1.2F), kFoldedLuminance, {kFolded}, 8192), kCoveredLeast);
}

TEST(Census, SeesRoutesThatAreMixedUp) {
  constexpr LightRoute kPlain = {LightRoute::kDirect, true, false};
  EXPECT_EQ(covered(folded_sun(1), kFoldedLuminance, {kPlain}, 1024), 0);
}

// Emitted light scatters once, twice and three times: 1/2 + 1/4 + 1/8. The facets of the sphere
// take less than 1/1000 of it.
TEST(Census, CoversTheLightOfAClosedSphere) {
  const std::vector<LightRoute> routes = {{LightRoute::kDirect, false, false},
                                          {LightRoute::kIndirect, false, false}};
  EXPECT_GE(covered(closed_sphere(), 0.875, routes, 8192), kCoveredLeast);
}

TEST(Census, SeesALostScatteringInAClosedSphere) {
  core::View view = closed_sphere();
  view.settings.max_depth = 2;
  EXPECT_LT(covered(view, 0.875, {{LightRoute::kDirect}, {LightRoute::kIndirect}}, 8192),
            kCoveredLeast);
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double sa = 0;
  double sb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i] / n;
    sb += b[i] / n;
  }
  double aa = 0;
  double bb = 0;
  double ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - sa) * (a[i] - sa);
    bb += (b[i] - sb) * (b[i] - sb);
    ab += (a[i] - sa) * (b[i] - sb);
  }
  return ab / std::sqrt(aa * bb);
}

/// Between the hits of a census and those of the particles of another stream.
double shared_noise(std::uint64_t other) {
  core::View view = folded_sun(1);
  const core::Camera camera = still_camera(view);
  std::vector<double> of_census;
  std::vector<double> of_other;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    view.settings.seed = static_cast<std::uint64_t>(seed);
    of_census.push_back(hits_of(*census_of(view, camera, 1024), kFolded));
    of_other.push_back(hits_of(*census_of(view, camera, 1024, other), kFolded));
  }
  return correlation(of_census, of_other);
}

// Four standard errors of a correlation of 0.
TEST(Census, SharesNoRandomNumbersWithThePicture) {
  const double limit = 4 / std::sqrt(static_cast<double>(kSeeds));
  for (const std::uint64_t stream : {std::uint64_t{0}, core::kLightStream, core::kPhotonStream}) {
    EXPECT_LT(std::fabs(shared_noise(stream)), limit);
  }
  EXPECT_GT(shared_noise(core::kCensusStream), limit);
}

// Otherwise a particle counts more than once, and the bound is approximate, as at plastics, metals
// and rough glass, whose lobes are not sampled in exact proportion.
TEST(Census, WeightsAtDiffuseAndClearSurfacesAreAtMostOne) {
  const std::set<std::string> exact = {"Lambert", "LambertColoured", "SmoothSolidGlass",
                                       "IndexMatched", "DimmedSmoothSolidGlass"};
  std::size_t found = 0;
  for (const test_support::BsdfCase& c : test_support::bsdf_cases()) {
    if (!exact.contains(c.name)) {
      continue;
    }
    ++found;
    test_support::Random random(7);
    float most = 0;
    constexpr int kSamples = 4000;
    for (int i = 0; i < kSamples; ++i) {
      const core::Bsdf bsdf = c.seen_from(test_support::random_hemisphere(random));
      const core::BsdfSample sample = bsdf.sample(random.uniform(), random.uniform_2d());
      most = std::max(most, core::max_component(sample.weight));
    }
    EXPECT_LE(most, 1 + 1e-5F) << c.name;
  }
  EXPECT_EQ(found, exact.size());
}

core::LightNotFound judged(const core::View& view, int samples, int particles = 1 << 16) {
  const auto picture = test_support::render(view, samples);
  const core::Camera camera = still_camera(view);
  const auto census = census_of(view, camera, particles);
  return core::light_not_found(*census, particles, *picture.film, view, 0.95);
}

/// The floor also sees a weak sky, so that pictures without the sun are not black.
core::View under_sky(const char* integrator, float roughness = 0) {
  core::View view = folded_sun(1, integrator, roughness);
  view.environment = test_support::constant_sky(Rgb(0.05F));
  return view;
}

TEST(LightNotFound, IsDetectedWhereAPathCannotHitTheSun) {
  const core::View view = under_sky("path");
  const double mean = static_cast<double>(test_support::render(view, 8).mean().g);
  const core::LightNotFound light = judged(view, 8);
  EXPECT_NEAR(light.detected * mean, kFoldedLuminance, 0.2 * kFoldedLuminance);
  EXPECT_GE(light.at_most, light.detected);
  EXPECT_EQ(light.tiles, std::vector<int>{0});
  EXPECT_EQ(
      light.reason,
      "The image lacks light of 'sun' by way of 'mirror'; path-caustics, bdpt or sppm finds it.");
  EXPECT_EQ(light.integrators, (std::vector<std::string>{"path-caustics", "bdpt", "sppm"}));
}

// Paths meet the sun in a narrow lobe by chance alone, whatever the few samples have found.
TEST(LightNotFound, BoundsLightOffNarrowLobes) {
  const auto bound = [](float roughness) {
    const core::View view = under_sky("path", roughness);
    const double mean = static_cast<double>(test_support::render(view, 8).mean().g);
    return judged(view, 8).at_most * mean / kFoldedLuminance;
  };
  for (const float roughness : {0.03F, 0.05F, 0.1F}) {
    EXPECT_GT(bound(roughness), 0.9) << roughness;
  }
  EXPECT_LT(bound(0.7F), 0.2);  // light samples find this
}

TEST(LightNotFound, NamesNoIntegratorThatMayNotRenderTheJob) {
  core::View view = under_sky("path");
  view.settings.spectral = true;
  const core::LightNotFound light = judged(view, 8);
  EXPECT_EQ(light.integrators, std::vector<std::string>());
  EXPECT_EQ(light.reason,
            "The image lacks light of 'sun' by way of 'mirror'; no integrator finds it "
            "in such a job.");
}

TEST(LightNotFound, IsNotDetectedWhereConnectionsFindIt) {
  const core::LightNotFound light = judged(under_sky("bdpt"), 8);
  EXPECT_EQ(light.detected, 0);
  EXPECT_TRUE(light.tiles.empty());
  EXPECT_LT(light.at_most, 0.05);
}

// A picture of half the light, as if its integrator had lost the rest.
TEST(LightNotFound, IsDetectedInAPictureThatIsTooDark) {
  const core::View view = closed_sphere();
  core::View dark = view;
  dark.settings.max_depth = 0;  // 1 of 1.875
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(0.5F);
  dark.scene = test_support::build(
      test_support::scene_of({lamp}, {test_support::sphere({}, 1, 48, true, 0)}));
  const auto picture = test_support::render(dark, 8);
  const core::Camera camera = still_camera(view);
  const auto census = census_of(view, camera, 1 << 16);
  const auto light = core::light_not_found(*census, 1 << 16, *picture.film, view, 0.95);
  EXPECT_NEAR(light.detected, (0.875 - 0.5) / 0.5, 0.15);
}

// Where the open half has met all light, the held one meets none of it: 0 of n particles, whose
// limit is 1 - alpha^(1 / n), with half of 1 - confidence for it and half for the test of tiles.
TEST(LightNotFound, HasTheLimitOfItsConfidence) {
  const core::View view = closed_sphere();
  const auto picture = test_support::render(view, 8);
  const core::Camera camera = still_camera(view);
  constexpr int kParticles = 1 << 14;
  const auto census = census_of(view, camera, kParticles);
  for (int r = 0; r < LightRoute::kCount; ++r) {
    const CensusHits hits = census->hits(0, LightRoute::at(r));
    ASSERT_TRUE(hits.open > 0 || hits.pictured == 0) << r;
  }
  const auto mean = static_cast<double>(core::luminance(picture.mean()));
  for (const auto& [confidence, alpha] : {std::pair(0.95, 0.025), std::pair(0.5, 0.25)}) {
    const core::LightNotFound light =
        core::light_not_found(*census, kParticles, *picture.film, view, confidence);
    EXPECT_TRUE(light.tiles.empty());
    const double limit = 1 - std::pow(alpha, 2.0 / kParticles);
    EXPECT_NEAR(light.at_most / (census->picture_unit() * limit / mean), 1, 1e-5) << confidence;
    EXPECT_EQ(light.confidence, confidence);
  }
}

TEST(LightNotFound, ShrinksWithTheNumberOfParticles) {
  const core::View view = under_sky("bdpt");
  const double few = judged(view, 8, 1 << 12).at_most;
  const double many = judged(view, 8, 1 << 16).at_most;
  EXPECT_LT(many, few / 4);
  EXPECT_GT(many, 0);
}

}  // namespace
