// The irradiance meter: truths 1, 4, 6 and 7 for incident light at a point, its intervals, and sums
// that are a function of the job. Scenes are exact or state their error.
#include "core/render/picture/meter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/lights/made_environment.h"
#include "core/lights/sun_position.h"
#include "core/render/picture/unsampled_light.h"
#include "core/settings/light_shares.h"
#include "tests/support/least_covered.h"
#include "tests/support/scenes.h"

namespace {

using core::MeterReading;
using core::Rgb;
using core::Vec3;

constexpr double kPi = std::numbers::pi;

core::PrimitiveDescription square() {
  return test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1);
}

core::View stage(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), 32, 32);
  test_support::look_at(view, {0.3F, 0.4F, 0.5F}, {0, 0, 0}, 0.001F);
  view.settings.max_depth = 1;
  view.settings.meter.points = {{{0, 0, 0}, {0, 1, 0}}};
  return view;
}

core::View stage(std::vector<core::PrimitiveDescription> parts) {
  return stage(test_support::scene_of(
      {test_support::lambert(Rgb(1)), test_support::emitter(Rgb(1))}, std::move(parts)));
}

MeterReading measure(const core::View& view, int samples) {
  const core::Meter meter({view.scene->data(), view.environment.get(), view.settings});
  core::MeterChunk chunk;
  EXPECT_TRUE(meter.render(0, chunk, samples, {}));
  EXPECT_EQ(chunk.rejected_samples, 0U);
  return core::meter_readings(core::meter_points(view.settings.meter), {chunk}).at(0);
}

/// The half width of an interval is 2.13 standard errors; 4 of them are exceeded by chance in 1 of
/// 850 (Student, 15 degrees). scene: relative error of round shapes made of triangles.
bool is_truth(const MeterReading& reading, double truth, double scene = 0) {
  const double error = (reading.illuminance - reading.low) / 2.131449546;
  const double off = std::fabs(reading.illuminance - truth);
  return off <= 4 * error + (scene + 3e-6) * truth && error < 1.5e-3 * truth;
}

/// The reading of sums of one sample each, given for the 16 randomisations.
MeterReading reading_of(const std::vector<double>& sums) {
  core::MeterChunk chunk;
  chunk.samples = 1;
  chunk.sums.resize(sums.size());
  for (std::size_t r = 0; r < sums.size(); ++r) {
    chunk.sums[r] = {sums[r], sums[r], sums[r]};
  }
  return core::meter_readings({{{0, 0, 0}, {0, 1, 0}}}, {chunk}).at(0);
}

// Of 16 normal numbers, one makes up more than half of the squares about their mean with
// probability 16 P(B > 8/15) = 0.0212, B having the beta distribution (1/2, 7) (Thompson 1935).
TEST(Meter, MarksReadingsThatRestOnOneRandomisation) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(5, 0.5);
  constexpr int kReadings = 4000;
  int marked = 0;
  std::vector<double> sums(core::kMeterReplicates);
  for (int i = 0; i < kReadings; ++i) {
    std::generate(sums.begin(), sums.end(), [&] { return normal(random); });
    marked += reading_of(sums).unreliable ? 1 : 0;
  }
  const double deviation = std::sqrt(0.0212 * (1 - 0.0212) / kReadings);
  EXPECT_NEAR(static_cast<double>(marked) / kReadings, 0.0212, 4 * deviation);
  sums.front() += 10;  // a rare bright path
  EXPECT_TRUE(reading_of(sums).unreliable);
  EXPECT_TRUE(reading_of(std::vector<double>(16, 0.0)).unreliable) << "no path has found light";
  EXPECT_FALSE(reading_of(std::vector<double>(16, 1.0)).unreliable) << "free of noise";
}

constexpr int kEventReadings = 400;

/// Fraction of the intervals that hold the truth if, beside Gaussian noise, 1,024 paths meet `rate`
/// events on average that carry `light` each. path_light: of meter_readings().
double covered(double rate, double light, double path_light) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(1, 0.02);
  std::poisson_distribution<int> events(rate / core::kMeterReplicates);
  constexpr int kPaths = 64;  // of each randomisation
  int inside = 0;
  for (int i = 0; i < kEventReadings; ++i) {
    core::MeterChunk chunk;
    chunk.samples = kPaths;
    for (int r = 0; r < core::kMeterReplicates; ++r) {
      const double sum = kPaths * normal(random) + light * events(random);
      chunk.sums.push_back({sum, sum, sum});
    }
    const MeterReading reading =
        core::meter_readings({{{0, 0, 0}, {0, 1, 0}}}, {chunk}, path_light).at(0);
    const double truth = 1 + rate * light / (kPaths * core::kMeterReplicates);
    inside += reading.low <= truth && truth <= reading.high ? 1 : 0;
  }
  return static_cast<double>(inside) / kEventReadings;
}

// 400 intervals of 95%: fewer than the least fraction with a probability of 0.3%. An event is
// 100 / 1024 of the reading, so that one missing is far outside of the Gaussian interval. The
// planted fault: a bound of 0 for the light of a path. The closed forms are in
// tests/unit/core/interval_test.cpp.
TEST(Meter, IntervalsHoldForRareEvents) {
  const double least = test_support::least_fraction(kEventReadings);
  for (const double rate : {0.2, 1.0, 4.0, 20.0}) {
    EXPECT_GE(covered(rate, 100, 100), least) << rate;
  }
  EXPECT_GE(covered(0, 100, 0), least) << "Gaussian noise alone";
  EXPECT_LT(covered(0.2, 100, 0), 0.5);
  EXPECT_LT(covered(1, 100, 0), 0.8);
}

TEST(Meter, TellsWhatOnePathCanCarryThroughGlass) {
  core::MaterialDescription glass;
  glass.transmission = 1;
  glass.roughness = 0;
  const auto with = [](core::MaterialDescription material) {
    return core::unsampled_path_light(stage(test_support::scene_of(
        {test_support::lambert(Rgb(1)), test_support::emitter(Rgb(7)), material},
        {square(), test_support::sphere({2, 1, 0}, 0.5F, 8, false, 2)})));
  };
  EXPECT_NEAR(with(glass), 7 * kPi, 1e-4);
  core::MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = 0.3F;  // alpha 0.09: a peak of 97 times that of a diffuse surface
  EXPECT_GT(with(metal), 0);
  metal.roughness = 0.6F;  // 6 times
  EXPECT_EQ(with(metal), 0);
  EXPECT_EQ(with(test_support::lambert(Rgb(0.5F))), 0) << "light sampling finds all light";
}

TEST(Meter, MeasuresASquareADiskAndASphere) {
  struct Light {
    const char* name;
    core::PrimitiveDescription part;
    double truth;
  };
  const Light lights[] = {
      {"square", square(), 0.7522747},
      {"disk", test_support::disk({0, 1, 0}, 0.5F, 1), kPi / 5},
      {"sphere", test_support::sphere({0, 1, 0}, 0.5F, 100, false, 1), kPi / 4}};
  for (const Light& light : lights) {
    const MeterReading reading = measure(stage({light.part}), 2048);
    EXPECT_TRUE(is_truth(reading, light.truth, 2e-4))
        << light.name << ": " << reading.illuminance << " to " << reading.high;
    EXPECT_FALSE(is_truth(reading, 1.01 * light.truth, 2e-4)) << "1 % more is detected";
    EXPECT_EQ(reading.samples, 2048 * core::kMeterReplicates);
  }
}

TEST(Meter, MeasuresOnlyTheSideThatItFaces) {
  core::View view = stage({square()});
  view.settings.meter.points[0].normal = {0, -3, 0};
  EXPECT_EQ(measure(view, 16).illuminance, 0);
}

TEST(Meter, MeasuresAConstantSkyAndACosineSky) {
  core::View view = stage({test_support::quad({50, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0)});
  view.environment = test_support::constant_sky(Rgb(2));
  EXPECT_TRUE(is_truth(measure(view, 64), 2 * kPi));
  constexpr int kRows = 512;  // cos at the centre of the rows: an error of 1e-6
  view.environment = test_support::sky_map(16, kRows, [](int, int row) {
    return Rgb(std::max(0.0F, std::cos((static_cast<float>(row) + 0.5F) * core::kPi / kRows)));
  });
  const MeterReading reading = measure(view, 1024);
  EXPECT_TRUE(is_truth(reading, 2 * kPi / 3, 2e-4)) << reading.illuminance;
}

TEST(Meter, MeasuresTheLuxOfPunctualLightsWithoutNoise) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(1))}, {test_support::quad({50, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0),
                                        test_support::quad({-50, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0)});
  core::PunctualLightDescription point;
  point.intensity = Rgb(30);
  point.to_world.t = {3, 4, 0};
  scene.lights.push_back(point);
  core::View view = stage(scene);
  view.environment = nullptr;
  EXPECT_NEAR(measure(view, 2).illuminance, 30.0 * (4.0 / 5.0) / 25.0, 1e-5);
  core::FogSettings fog;
  fog.absorption = Rgb(0.1F);
  view.settings.fog = fog;  // absorption only; the bounding sphere contains the whole segment
  EXPECT_NEAR(measure(view, 2).illuminance, 30.0 * (4.0 / 5.0) / 25.0 * std::exp(-0.5), 1e-5);
  view.settings.max_depth = 0;
  view.settings.fog.reset();
  EXPECT_EQ(measure(view, 2).illuminance, 0) << "the point is on a surface";
}

/// Sun, sky and a lamp of the file in one unit. Source of the sun's illuminance: IES Recommended
/// Practice RP-21, 127.5 exp(-0.21 / sin h) sin h + 0.8 + 15.5 sqrt(sin h) klx; skies differ by
/// their haze, 12%.
TEST(Meter, AddsTheSunAndALampInLux) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(1))}, {test_support::quad({50, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0)});
  core::View view = stage(scene);
  core::EnvironmentSettings noon;
  noon.sun = {40, 0, 1782043200};  // 2026-06-21T12:00:00Z
  view.environment = *core::make_environment(noon);
  const double sine = std::sin(core::sun_position(*noon.sun).elevation_degrees * kPi / 180);
  const double published =
      1000 * (127.5 * std::exp(-0.21 / sine) * sine + 0.8 + 15.5 * std::sqrt(sine));
  const double sun = measure(view, 1024).illuminance;
  EXPECT_NEAR(sun, published, 0.12 * published);
  scene.lights.push_back(
      test_support::directional({{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {}}, Rgb(50'000)));
  core::View both = stage(scene);
  both.environment = view.environment;
  EXPECT_NEAR(measure(both, 1024).illuminance, sun + 50'000, 0.01 * sun);
}

// Truth 1: the wall of a closed sphere, albedo and emission 1/2, receives a radiance of 1; after k
// scattering events 1 - 2^-k of it, including the one at the meter.
TEST(Meter, MeasuresInterreflectionInAClosedSphere) {
  core::MaterialDescription wall = test_support::lambert(Rgb(0.5F));
  wall.emissive = Rgb(0.5F);
  const auto scene =
      test_support::scene_of({wall}, {test_support::sphere({0, 0, 0}, 1, 48, true, 0)});
  core::View view = stage(scene);
  view.settings.meter.points = {{{0, -0.5F, 0}, {0.3F, 1, 0.2F}}};
  for (const int depth : {1, 2, 3, 64}) {
    view.settings.max_depth = depth;
    const double truth = kPi * (1 - std::pow(0.5, depth));
    const MeterReading reading = measure(view, 2048);
    EXPECT_TRUE(is_truth(reading, truth))
        << depth << ": " << reading.illuminance << " to " << reading.high << " for " << truth;
    if (depth < 4) {
      EXPECT_FALSE(is_truth(reading, kPi * (1 - std::pow(0.5, depth + 1)))) << "one more bounce";
    }
  }
}

constexpr int kMeters = 800;

/// The fraction of kMeters meters with different seeds whose interval contains the true value.
double coverage(double width) {
  core::View view = stage({square()});
  int held = 0;
  for (int i = 0; i < kMeters; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i);
    const MeterReading reading = measure(view, 4);
    const double half = (reading.high - reading.illuminance) * width;
    held += std::fabs(reading.illuminance - 0.7522747) <= half ? 1 : 0;
  }
  return static_cast<double>(held) / kMeters;
}

// Each bound fails by chance with a probability of 0.3%.
TEST(Meter, IntervalsContainTheTruthInNinetyFivePercent) {
  const double least = test_support::least_fraction(kMeters);
  const double held = coverage(1);
  EXPECT_GE(held, least);
  EXPECT_LE(held, test_support::most_fraction(kMeters));
  EXPECT_LT(coverage(0.7), least) << "narrower intervals are detected";
}

core::View box() {
  core::View view = test_support::view_of(test_support::cornell(), 40, 40);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.settings.meter.points = {{{0.5F, 0.001F, 0.5F}, {0, 1, 0}}};
  view.settings.meter.plane = {{0.1F, 0.5F, 0.1F}, {0, 0, 0.8F}, {0.8F, 0, 0}, 7, 5};
  return view;
}

bool same(const std::vector<core::MeterChunk>& a, const std::vector<core::MeterChunk>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.samples == y.samples && x.sums == y.sums;
  });
}

TEST(Meter, IsIndependentOfThreadsAndSlices) {
  const core::View view = box();
  const auto one = test_support::render(view, 24, 1).film->meter();
  ASSERT_EQ(one.size(), 3U) << "36 points";
  EXPECT_TRUE(same(one, test_support::render(view, 24, 4).film->meter()));
  const core::Meter meter({view.scene->data(), view.environment.get(), view.settings});
  for (int chunk = 0; chunk < 3; ++chunk) {
    core::MeterChunk parts;
    for (const int last : {5, 6, 24}) {
      ASSERT_TRUE(meter.render(chunk, parts, last, {}));
    }
    EXPECT_EQ(parts.sums, one[static_cast<std::size_t>(chunk)].sums);
  }
  core::View other = view;
  other.settings.seed = 7;
  EXPECT_FALSE(same(one, test_support::render(other, 24, 1).film->meter()));
  other = view;
  other.settings.first_replicate = 2;
  EXPECT_FALSE(same(one, test_support::render(other, 24, 1).film->meter()));
}

TEST(Meter, DoesNotChangeTheImage) {
  core::View view = box();
  const auto with = test_support::render(view, 8).film->digest();
  view.settings.meter = {};
  EXPECT_EQ(with, test_support::render(view, 8).film->digest());
}

TEST(Meter, CellsOfAPlaneFollowThePointsRowByRow) {
  const auto points = core::meter_points(box().settings.meter);
  ASSERT_EQ(points.size(), 36U);
  const auto near = [](const core::Place& a, Vec3 b) { return length(a.rounded() - b) < 1e-6F; };
  EXPECT_TRUE(near(points[1].position, {0.18F, 0.5F, 0.1F + 0.4F / 7}));
  EXPECT_TRUE(near(points[2].position, {0.18F, 0.5F, 0.1F + 1.2F / 7}));
  EXPECT_TRUE(near(points[35].position, {0.82F, 0.5F, 0.9F - 0.4F / 7}));
  EXPECT_TRUE(near(points[1].normal, {0, 1, 0}));
}

// The layer is the irradiance on the floor, independent of the floor's colour.
TEST(IrradianceLayer, ShowsTheIrradianceOnTheFirstSurface) {
  core::View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert({0.2F, 0.5F, 0}), test_support::emitter(Rgb(1))},
          {square(), test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)}),
      32, 32);
  test_support::look_at(view, {0.3F, 0.4F, 0.5F}, {0, 0, 0}, 0.001F);
  view.settings.max_depth = 1;
  const auto plain = test_support::render(view, 64);
  view.settings.film.shares = {*core::light_share("irradiance")};
  const auto picture = test_support::render(view, 64);
  for (std::size_t i = 0; i < plain.snapshot.pixels.size(); ++i) {
    ASSERT_NEAR(plain.snapshot.pixels[i].mean_g, picture.snapshot.pixels[i].mean_g, 1e-5F)
        << "the image is unchanged, up to the rounding of paths in lanes";
  }
  test_support::Picture share = picture;
  share.snapshot = *core::share_of(picture.snapshot, "irradiance");
  const auto mean = [&share](auto channel) {
    return static_cast<double>(channel(share.mean())) * core::kLumensPerWatt;
  };
  const double error = static_cast<double>(share.standard_error().g) * core::kLumensPerWatt;
  for (const double value : {mean([](Rgb c) { return c.r; }), mean([](Rgb c) { return c.b; })}) {
    EXPECT_NEAR(value, 0.7522747, 4 * error + 1e-5);
    EXPECT_LT(error, 1e-3);
  }
}

TEST(IrradianceLayer, IsRecordedByEveryIntegratorWithCameraPaths) {
  const core::LightShare share = *core::light_share("irradiance");
  for (const core::IntegratorEntry& row : core::integrators()) {
    EXPECT_EQ(core::keeps_share(row, share), row.prepass_bytes == nullptr) << row.name;
  }
}

}  // namespace
