// Procedural light: position of the sun, radiance of sky and studios, the sun as a light.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/path/catcher.h"
#include "core/lights/made_environment.h"
#include "core/lights/sky.h"
#include "core/lights/studio.h"
#include "core/settings/choices.h"
#include "tests/support/statistics.h"

namespace {

using core::EnvironmentSettings;
using core::Rgb;
using core::SunSettings;
using core::Vec3;
using test_support::Random;

constexpr double kPi = std::numbers::pi;

// Golden, Colorado, 2003-10-17 12:30:30 at UTC-7.
constexpr SunSettings kGolden = {39.742476, -105.1786, 1066419030};
// Berlin, 2026-06-21 12:00 UTC.
constexpr SunSettings kBerlin = {52.52, 13.405, 1782043200};

// Source: Reda and Andreas, Solar Position Algorithm for Solar Radiation Applications, NREL 2008,
// table A5.1: declination and elevation seen from the surface, azimuth; the elevation without
// refraction. Ours is geocentric: parallax is at most 0.0024 degrees.
TEST(SunPosition, MatchesThePublishedExample) {
  const core::SunPosition sun = core::sun_position(kGolden);
  EXPECT_NEAR(sun.declination_degrees, -9.31434, 0.01);
  EXPECT_NEAR(sun.elevation_degrees, 39.872046, 0.01);
  EXPECT_NEAR(sun.azimuth_degrees, 194.34024, 0.01);
  EXPECT_NEAR(sun.distance_au, 0.9965422974, 1e-4);
  SunSettings mirrored = kGolden;
  mirrored.longitude_degrees = -mirrored.longitude_degrees;  // the effect of a wrong sign
  EXPECT_GT(std::fabs(core::sun_position(mirrored).elevation_degrees - 39.872046), 1);
}

// Source: Meeus, Astronomical Algorithms, example 25.a: 1992 October 13, 0h (a minute of dynamical
// time is negligible).
TEST(SunPosition, HasTheDeclinationOfMeeusExample) {
  EXPECT_NEAR(core::sun_position({0, 0, 718934400}).declination_degrees, -7.78507, 0.005);
}

TEST(SunPosition, DirectionsHaveNorthAtMinusZAndEastAtX) {
  const Vec3 afternoon = core::sun_direction(core::sun_position(kGolden));
  EXPECT_GT(afternoon.z, 0.5F);   // south
  EXPECT_LT(afternoon.x, -0.1F);  // slightly west
  EXPECT_NEAR(static_cast<double>(afternoon.y), std::sin(39.872046 * kPi / 180), 2e-4);
}

/// The mean over the sphere, by points on a spiral: a different quadrature from that of maps and
/// presets.
template <typename Radiance>
double spiral_mean(const Radiance& radiance) {
  constexpr int kPoints = 400'000;
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double y = 1 - 2 * (i + 0.5) / kPoints;
    const double level = std::sqrt(1 - y * y);
    const double phi = i * kPi * (3 - std::sqrt(5.0));
    sum += radiance(Vec3{static_cast<float>(level * std::cos(phi)), static_cast<float>(y),
                         static_cast<float>(level * std::sin(phi))});
  }
  return sum / kPoints;
}

TEST(Studios, HaveThePowerOfAWhiteEnvironment) {
  for (const auto& row : core::environment_presets()) {
    const core::Studio studio(row.value);
    EXPECT_NEAR(spiral_mean([&](Vec3 d) { return static_cast<double>(studio.radiance(d).g); }), 1,
                2e-3)
        << row.name;
    EnvironmentSettings settings;
    settings.preset = row.value;
    const auto made = core::make_environment(settings);
    ASSERT_TRUE(made);
    EXPECT_NEAR(static_cast<double>((*made)->power_luminance()), 4 * kPi, 0.05) << row.name;
  }
}

// A diffuse surface of albedo 1 has the radiance E / pi (Lambert): the brightest one that is seen
// from the front becomes 1. By the points of a spiral, not those of the product's quadrature.
TEST(Studios, FrontExposureMakesTheBrightestWhiteOne) {
  constexpr int kPoints = 8000;
  std::vector<Vec3> directions;
  for (int i = 0; i < kPoints; ++i) {
    const double y = 1 - 2 * (i + 0.5) / kPoints;
    const double level = std::sqrt(1 - y * y);
    const double phi = i * kPi * (3 - std::sqrt(5.0));
    directions.push_back({static_cast<float>(level * std::cos(phi)), static_cast<float>(y),
                          static_cast<float>(level * std::sin(phi))});
  }
  for (const auto& row : core::environment_presets()) {
    const core::Studio studio(row.value);
    std::vector<double> light;
    for (const Vec3 d : directions) {
      light.push_back(static_cast<double>(studio.radiance(d).g));
    }
    std::vector<double> irradiance;  // over pi
    for (std::size_t n = 0; n < directions.size(); n += 10) {
      double sum = 0;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        sum += light[i] * std::max(0.0, static_cast<double>(dot(directions[n], directions[i])));
      }
      irradiance.push_back(sum * 4 / kPoints);  // 4 pi / (pi kPoints)
    }
    for (const Vec3 camera : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{0.8F, 0.6F, 0}}) {
      double brightest = 0;
      for (std::size_t n = 0; n < irradiance.size(); ++n) {
        if (dot(directions[10 * n], camera) >= 0) {
          brightest = std::max(brightest, irradiance[n]);
        }
      }
      const double stops = static_cast<double>(studio.exposure_stops(camera));
      EXPECT_NEAR(brightest * std::exp2(stops), 1, 0.03) << row.name << camera.x << camera.z;
    }
    // Its mean radiance is 1, so that some side has more.
    EXPECT_LT(studio.exposure_stops({0, 0, 1}), 0) << row.name;
  }
}

TEST(Studio, ExposureTurnsWithTheLight) {
  constexpr auto kRim = core::EnvironmentPreset::kRim;
  const core::Studio studio(kRim);
  // Turned by a quarter counter-clockwise seen from above, the front is +x and the back is -x.
  EXPECT_NEAR(core::studio_exposure_stops(kRim, 90, {1, 0, 0}), studio.exposure_stops({0, 0, 1}),
              1e-4F);
  EXPECT_NEAR(core::studio_exposure_stops(kRim, 90, {-1, 0, 0}), studio.exposure_stops({0, 0, -1}),
              1e-4F);
  EXPECT_GT(studio.exposure_stops({0, 0, 1}), studio.exposure_stops({0, 0, -1}) + 0.3F);
}

TEST(Sky, IrradianceOfAHorizontalSurfaceMatchesTheIntegral) {
  const core::Sky sky(core::sun_position(kBerlin));
  double sky_light = 0;
  {
    const double theta[2] = {0, kPi / 2};
    const double phi[2] = {0, 2 * kPi};
    sky_light = test_support::integrate_2d(
        [&](double t, double p) {
          const Vec3 d = {static_cast<float>(std::sin(t) * std::cos(p)),
                          static_cast<float>(std::cos(t)),
                          static_cast<float>(std::sin(t) * std::sin(p))};
          return static_cast<double>(sky.radiance(d).g) * std::cos(t) * std::sin(t);
        },
        theta, phi, 1e-3, 2, 6);
  }
  const auto radius = static_cast<double>(sky.sun().angular_radius_rad);
  const double sun_light = static_cast<double>(sky.sun().radiance.g) * kPi * radius * radius *
                           static_cast<double>(sky.sun().direction.y);
  const auto level = static_cast<double>(sky.irradiance().g);
  EXPECT_NEAR(level, sky_light + sun_light, 5e-3 * level);
  // the difference is detectable
  EXPECT_GT(std::fabs(level - sky_light - 0.98 * sun_light), 5e-3 * level);
  EnvironmentSettings settings;
  settings.sun = kBerlin;
  const auto made = core::make_environment(settings);
  ASSERT_TRUE(made);
  EXPECT_NEAR(static_cast<double>(core::level_irradiance(**made, 1).g), level, 5e-3 * level);
  // Clear noon in summer: 90 to 110 klx in total, 10 to 25 of them from the sky. Source: CIE
  // 108-1994, Guide to Recommended Practice of Daylight Measurement; Littlefair, Lighting Research
  // and Technology 17, 1985.
  EXPECT_GT(level, 80e3);
  EXPECT_LT(level, 115e3);
}

/// Horizontal illuminance of a clear sky and the sun. Source: IES Recommended Practice RP-21 (IES
/// Lighting Handbook): direct normal 127.5 exp(-0.21 / sin h) klx, clear sky 0.8 + 15.5 sqrt(sin h)
/// klx. Real skies differ by their haze: 12%.
TEST(Sky, LightsLevelGroundWithThePublishedIlluminance) {
  for (const double hours : {8.0, 10.0, 12.0}) {
    const core::SunPosition sun = core::sun_position({40, 0, 1782000000 + hours * 3600});
    const double sine = std::sin(sun.elevation_degrees * kPi / 180);
    const double published =
        1000 * (127.5 * std::exp(-0.21 / sine) * sine + 0.8 + 15.5 * std::sqrt(sine));
    const auto lux = static_cast<double>(luminance(core::Sky(sun).irradiance()));
    EXPECT_NEAR(lux, published, 0.12 * published) << sun.elevation_degrees;
  }
}

TEST(Sky, HasNoSunAfterSunset) {
  EnvironmentSettings settings;
  settings.sun = kBerlin;
  settings.sun->unix_seconds += 12 * 3600;
  const auto made = core::make_environment(settings);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().where, "/environment/sun/time");
}

/// A sky with a gradient, and a sun wide enough for a test.
std::shared_ptr<const core::Environment> wide_sun(float rotation_degrees) {
  core::Image map;
  map.width = 16;
  map.height = 8;
  map.channels = 3;
  map.type = core::PixelType::kF32;
  map.bytes.resize(map.value_count() * sizeof(float));
  auto* value = reinterpret_cast<float*>(map.bytes.data());
  for (std::size_t i = 0; i < map.value_count(); ++i) {
    value[i] = 1 + 0.05F * static_cast<float>(i / 3 % 16);
  }
  const core::SunDisc sun = {normalize(Vec3{0.3F, 0.8F, 0.5F}), Rgb(30), 0.35F};
  EnvironmentSettings settings;
  settings.rotation_degrees = rotation_degrees;
  return *core::Environment::create(&map, settings, &sun);
}

double wide_sun_p(float rotation_degrees, core::SkyDensity density, float too_much) {
  const auto sky = wide_sun(rotation_degrees);
  return test_support::chi2_sphere(
             [&](Random& r) {
               return std::optional<Vec3>(sky->sample(r.uniform_2d(), density).wi_world);
             },
             [&](Vec3 w) {
               const bool is_sun = !is_black(sky->sun_radiance(w));
               return sky->pdf_solid_angle(w, density) * (is_sun ? too_much : 1.0F);
             },
             100'000, 5, {.depth_least = 2, .depth_most = 7})
      .p_value;
}

TEST(EnvironmentSun, SamplesFollowTheDensity) {
  constexpr double kLevel = 0.0005;  // 0.1% over both
  EXPECT_GT(wide_sun_p(77, core::SkyDensity::kRadiance, 1), kLevel);
  EXPECT_GT(wide_sun_p(77, core::SkyDensity::kCompensated, 1), kLevel);
  EXPECT_LT(wide_sun_p(77, core::SkyDensity::kRadiance, 1.05F), kLevel);  // a planted fault
}

TEST(EnvironmentSun, SamplesHaveTheRadianceAndThePowerOfTheirDirections) {
  const auto sky = wide_sun(30);
  Random random(9);
  test_support::Moments power;
  int suns = 0;
  for (int i = 0; i < 100'000; ++i) {
    const core::EnvironmentSample s = sky->sample(random.uniform_2d());
    ASSERT_GT(s.pdf_solid_angle, 0);
    power.add(static_cast<double>(luminance(s.radiance) / s.pdf_solid_angle));
    if (i % 16 == 0) {
      EXPECT_EQ(luminance(s.radiance), luminance(sky->radiance(s.wi_world)));
      EXPECT_NEAR(s.pdf_solid_angle, sky->pdf_solid_angle(s.wi_world), 1e-4F * s.pdf_solid_angle);
    }
    suns += is_black(sky->sun_radiance(s.wi_world)) ? 0 : 1;
  }
  EXPECT_LT(std::fabs(power.z(static_cast<double>(sky->power_luminance()))), 4);
  EXPECT_GT(suns, 10'000);
}

TEST(EnvironmentBlur, KeepsUniformLightAndSpreadsTheSun) {
  EnvironmentSettings tent;
  tent.preset = core::EnvironmentPreset::kTent;
  const auto soft = *core::make_environment(tent);
  const double mean = spiral_mean([&](Vec3 d) { return static_cast<double>(soft->blurred(d).g); });
  EXPECT_NEAR(mean, 1, 0.02);  // the lobe is normalised at its end, not at its start
  EnvironmentSettings noon;
  noon.sun = kBerlin;
  const auto sunny = *core::make_environment(noon);
  EXPECT_LT(sunny->blurred(sunny->sun_world()).g, sunny->background(sunny->sun_world()).g);
  EXPECT_GT(sunny->blurred(sunny->sun_world()).g, 5 * sunny->blurred(-sunny->sun_world()).g);
}

}  // namespace
