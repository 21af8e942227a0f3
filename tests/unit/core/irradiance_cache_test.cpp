// Records of irradiance: gradients against finite differences of closed forms, the index against an
// exhaustive search.
#include "core/integrators/maps/irradiance_cache.h"

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace {

using core::HemisphereSample;
using core::Rgb;
using core::Vec3;

struct Vec3d {
  double x = 0, y = 0, z = 0;
};
Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3d unit(Vec3d a) {
  const double l = std::sqrt(dot(a, a));
  return {a.x / l, a.y / l, a.z / l};
}

/// Irradiance at p with normal n from a polygon of radiance 1 that is entirely above the horizon.
/// Source: Lambert 1760; PBR 4th ed., section 6.5.4.
double lambert(const std::vector<Vec3d>& polygon, Vec3d p, Vec3d n) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d a = unit(polygon[i] - p);
    const Vec3d b = unit(polygon[(i + 1) % polygon.size()] - p);
    sum += std::acos(dot(a, b)) * dot(unit(cross(a, b)), n);
  }
  return std::fabs(sum) / 2;
}

/// A ceiling at height 2 with radiance 1 between x = left and 1 and between y = -1 and 0.5.
double under_ceiling(double left, Vec3d p, Vec3d n) {
  return lambert({{left, -1, 2}, {1, -1, 2}, {1, 0.5, 2}, {left, 0.5, 2}}, p, n);
}

constexpr double kAwning = -0.2;
/// The same with a black awning at height 1 over x < kAwning, which hides the ceiling left of the
/// line through its edge.
double under_awning(Vec3d p, Vec3d n) { return under_ceiling(2 * kAwning - p.x, p, n); }

/// Radiance and distance from the origin, which faces up.
HemisphereSample seen(Vec3 d, bool has_awning) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  if (has_awning && d.x / d.z < static_cast<float>(kAwning)) {
    return {{}, 1 / d.z};
  }
  const float x = 2 * d.x / d.z;
  const float y = 2 * d.y / d.z;
  const bool is_lit = x > -1 && x < 1 && y > -1 && y < 0.5F;
  return is_lit ? HemisphereSample{Rgb(1), 2 / d.z} : HemisphereSample{{}, kNone};
}

core::HemisphereLight light(bool has_awning, int rays = 1 << 16) {
  const core::HemisphereGrid grid(rays);
  std::vector<HemisphereSample> samples;
  for (int i = 0; i < grid.size(); ++i) {
    samples.push_back(seen(grid.direction(i, {0.5F, 0.5F}), has_awning));
  }
  return core::gathered(grid, samples);
}

/// Central differences.
Vec3d differences(const std::function<double(Vec3d)>& f) {
  constexpr double h = 1e-4;
  return {(f({h, 0, 0}) - f({-h, 0, 0})) / (2 * h), (f({0, h, 0}) - f({0, -h, 0})) / (2 * h), 0};
}

double off(Vec3 found, Vec3d truth) {
  const Vec3d d = Vec3d{found.x, found.y, found.z} - truth;
  return std::sqrt(dot(d, d) / dot(truth, truth));
}

constexpr Vec3d kUp = {0, 0, 1};
/// 144 rings and 455 sectors: the position of an edge is known to about a cell, 1% of the patch's
/// width; errors along the edge average out.
constexpr double kCells = 0.02;

TEST(IrradianceGradients, TranslationalIsTheDerivativeOfTheClosedForm) {
  const core::HemisphereLight found = light(false);
  const Vec3d truth = differences([](Vec3d p) { return under_ceiling(-1, p, kUp); });
  EXPECT_NEAR(static_cast<double>(found.irradiance.g), under_ceiling(-1, {}, kUp), 0.005);
  EXPECT_LT(off(found.gradients.by_move[1], truth), kCells);
  // The planted fault: the opposite sign.
  EXPECT_GT(off(-found.gradients.by_move[1], truth), 1.9);
}

// The change of occlusion at an edge depends on the distance of the edge, not of the surface behind
// it.
TEST(IrradianceGradients, TranslationalAccountsForOccluders) {
  const core::HemisphereLight found = light(true);
  const Vec3d truth = differences([](Vec3d p) { return under_awning(p, kUp); });
  EXPECT_NEAR(static_cast<double>(found.irradiance.g), under_awning({}, kUp), 0.005);
  EXPECT_LT(off(found.gradients.by_move[1], truth), kCells);
  // The planted fault: an edge as far as the ceiling.
  const Vec3d wrong = differences([](Vec3d p) { return under_ceiling(2 * kAwning, p, kUp); });
  EXPECT_GT(off(found.gradients.by_move[1], wrong), 0.2);
}

TEST(IrradianceGradients, RotationalIsTheDerivativeOfTheClosedForm) {
  const core::HemisphereLight found = light(false);
  // About the axes x and y.
  const Vec3d truth = differences([](Vec3d angle) {
    return under_ceiling(-1, {}, unit({std::sin(angle.y), -std::sin(angle.x), 1}));
  });
  EXPECT_LT(off(found.gradients.by_turn[1], truth), kCells);
  EXPECT_GT(off(-found.gradients.by_turn[1], truth), 1.9);
}

TEST(IrradianceGradients, AreZeroForUniformLight) {
  const core::HemisphereGrid grid(1024);
  const std::vector<HemisphereSample> samples(static_cast<std::size_t>(grid.size()),
                                              {Rgb{1, 2, 3}, 0.5F});
  const core::HemisphereLight found = core::gathered(grid, samples);
  EXPECT_NEAR(found.irradiance.b, 3 * std::numbers::pi_v<float>, 1e-4F);
  EXPECT_NEAR(found.mean_distance_m, 0.5F, 1e-6F);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_LT(core::length(found.gradients.by_move[c]), 1e-5F);
    EXPECT_LT(core::length(found.gradients.by_turn[c]), 1e-4F);
  }
}

TEST(IrradianceGradients, CellsPartitionTheProjectedHemisphere) {
  const core::HemisphereGrid grid(200);
  Vec3 sum;
  float cosine2 = 0;
  for (int i = 0; i < grid.size(); ++i) {
    const Vec3 d = grid.direction(i, {0.5F, 0.5F});
    EXPECT_NEAR(core::length(d), 1, 1e-6F);
    sum += d;
    cosine2 += d.z * d.z / static_cast<float>(grid.size());
  }
  EXPECT_NEAR(sum.x, 0, 1e-4F);
  EXPECT_NEAR(sum.y, 0, 1e-4F);
  EXPECT_NEAR(cosine2, 0.5F, 1e-5F);  // mean of cos^2 with density cos / pi
}

core::IrradianceRecord record(Vec3 position, float radius_m, Rgb irradiance = Rgb(1)) {
  core::IrradianceRecord out;
  out.position = position;
  out.normal = {0, 0, 1};
  out.irradiance = irradiance;
  out.radius_m = radius_m;
  return out;
}

/// Irradiance with a constant gradient and the value 2 at the origin.
constexpr Vec3 kSlope = {0.5F, -0.25F, 0};
core::IrradianceRecord sloped(Vec3 position, float sign) {
  core::IrradianceRecord out = record(position, 2, Rgb(2 + core::dot(kSlope, position)));
  out.gradients.by_move.fill(kSlope * sign);
  return out;
}

/// Largest interpolation error around four records; along kSlope gradients make it exact.
float sloped_error(float sign) {
  core::IrradianceCache cache(0.5F);
  cache.insert(std::array{sloped({0, 0, 0}, sign), sloped({1, 0, 0}, sign), sloped({0, 1, 0}, sign),
                          sloped({1, 1, 0}, sign)});
  float worst = 0;
  for (float x = -0.3F; x < 1.3F; x += 0.1F) {
    for (float y = -0.3F; y < 1.3F; y += 0.1F) {
      const Vec3 p = {x, y, 0};
      const auto found = cache.find(p, {0, 0, 1}, 0);
      worst = std::max(worst, found ? std::fabs(found->g - 2 - core::dot(kSlope, p)) : 100.0F);
    }
  }
  return worst;
}

TEST(IrradianceCache, GradientsReproduceLinearIrradiance) {
  EXPECT_LT(sloped_error(1), 1e-5F);
  // The planted faults: no gradients, and the opposite sign.
  EXPECT_GT(sloped_error(0), 0.1F);
  EXPECT_GT(sloped_error(-1), 0.2F);
}

TEST(IrradianceCache, FindsNothingWithoutAGoodRecord) {
  core::IrradianceCache cache(0.5F);
  EXPECT_FALSE(cache.find({0, 0, 0}, {0, 0, 1}, 0));
  cache.insert(std::array{record({0, 0, 0}, 1)});
  EXPECT_TRUE(cache.find({0.49F, 0, 0}, {0, 0, 1}, 0));
  EXPECT_FALSE(cache.find({0.51F, 0, 0}, {0, 0, 1}, 0));    // error 0.51
  EXPECT_FALSE(cache.find({0, 0, 0}, {0, 0, 1}, 1));        // paths of another depth
  EXPECT_FALSE(cache.find({0, 0, 0}, {0.8F, 0, 0.6F}, 0));  // error 0.63
  EXPECT_TRUE(cache.find({0.1F, 0, 0.1F}, {0, 0, 1}, 0));
  EXPECT_FALSE(cache.find({0.1F, 0, -0.1F}, {0, 0, 1}, 0));  // the record is in front
  EXPECT_TRUE(cache.covers({0.3F, 0, 0}, {0, 0, 1}, 0));
  EXPECT_FALSE(cache.covers({0.4F, 0, 0}, {0, 0, 1}, 0));  // found, but not well covered
}

TEST(IrradianceCache, IndexFindsTheSameAsAnExhaustiveSearch) {
  constexpr float kTolerance = 0.4F;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> at(-3, 3);
  std::uniform_real_distribution<float> exponent(-2, 1);
  core::IrradianceCache cache(kTolerance);
  for (int round = 0; round < 5; ++round) {
    std::vector<core::IrradianceRecord> added;
    for (int i = 0; i < 200; ++i) {
      added.push_back(record({at(random), at(random), 0}, std::pow(10.0F, exponent(random)),
                             Rgb(1 + at(random) / 4)));
    }
    cache.insert(added);
  }
  ASSERT_EQ(cache.records().size(), 1000U);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = {at(random), at(random), 0};
    double sum = 0;
    double weights = 0;
    for (const core::IrradianceRecord& r : cache.records()) {
      const double error = static_cast<double>(core::length(p - r.position) / r.radius_m);
      const double weight = std::max(1 - error / static_cast<double>(kTolerance), 0.0);
      sum += weight * static_cast<double>(r.irradiance.g);
      weights += weight;
    }
    const auto here = cache.find(p, {0, 0, 1}, 0);
    if (weights > 1e-4) {
      ASSERT_TRUE(here);
      EXPECT_NEAR(static_cast<double>(here->g), sum / weights, 1e-3);
      ++found;
    } else if (weights == 0) {
      EXPECT_FALSE(here);
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_LT(found, 2000);
}

TEST(IrradianceCache, RadiusIsLimitedByThoseOfNeighbours) {
  core::IrradianceCache cache(0.5F);
  cache.insert(std::array{record({0, 0, 0}, 0.1F)});
  cache.insert(std::array{record({0.04F, 0, 0}, 10)});
  EXPECT_NEAR(cache.records()[1].radius_m, 0.14F, 1e-6F);
  cache.insert(std::array{record({0.03F, 0, 0}, 0.01F)});
  EXPECT_NEAR(cache.records()[0].radius_m, 0.04F, 1e-6F);
  EXPECT_NEAR(cache.records()[1].radius_m, 0.02F, 1e-6F);
}

TEST(IrradianceCache, RadiiAreLimitedByTheGradient) {
  core::IrradianceRecord steep = record({0, 0, 0}, 10, Rgb(3));
  steep.gradients.by_move.fill({6, 0, 0});
  core::IrradianceRecord limited = steep;
  core::limit_radius(limited, 0.1F, 5);
  EXPECT_NEAR(limited.radius_m, 0.5F, 1e-6F);  // doubles within half a metre
  EXPECT_EQ(limited.gradients.by_move[0].x, 6);
  limited = steep;
  core::limit_radius(limited, 2, 5);
  EXPECT_EQ(limited.radius_m, 2);
  EXPECT_NEAR(limited.gradients.by_move[0].x, 1.5F, 1e-6F);
  limited = record({0, 0, 0}, std::numeric_limits<float>::infinity());
  core::limit_radius(limited, 2, 5);
  EXPECT_EQ(limited.radius_m, 5);
}

}  // namespace
