// Russian roulette by throughput: its rule, and the unchanged mean.
#include "core/transport/roulette.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/math/numbers.h"
#include "core/transport/scatter.h"
#include "tests/support/statistics.h"

namespace {

using core::continuation_probability;
using core::Rgb;
using test_support::Moments;
using test_support::Random;

core::PathState path_of(std::uint64_t& rays, Rgb beta, float pdf_bsdf) {
  core::PathState path = core::start_path(core::PathSampler(core::SamplerType::kSobol, 2, 0), rays);
  path.beta = beta;
  path.depth = 1;
  path.last.pdf_bsdf = pdf_bsdf;
  return path;
}

constexpr float kMatt = core::kInvPi;  ///< the maximum density of a Lambertian surface
constexpr float kGlossy = 5;
constexpr float kSmooth = 0;

TEST(Roulette, IsProportionalToThroughputOnDiffuseSurfacesAndSofterOnDarkOnes) {
  std::uint64_t rays = 0;
  const auto survive = [&](float beta) {
    return continuation_probability(path_of(rays, Rgb(beta), kMatt));
  };
  EXPECT_GE(survive(0.45F), 1);
  EXPECT_FLOAT_EQ(survive(0.36F), 0.8F);
  EXPECT_FLOAT_EQ(survive(0.225F), 0.5F);
  EXPECT_FLOAT_EQ(survive(0.04F), 0.2F);  // not 0.09
  EXPECT_FLOAT_EQ(survive(0.0001F), 0.01F);
}

TEST(Roulette, TakesTheFourthRootAfterAGlossyOrSmoothEvent) {
  std::uint64_t rays = 0;
  for (const float density : {kGlossy, kSmooth}) {
    EXPECT_GE(continuation_probability(path_of(rays, Rgb(0.45F), density)), 1);
    EXPECT_FLOAT_EQ(continuation_probability(path_of(rays, Rgb(0.45F / 16), density)), 0.5F);
  }
}

TEST(Roulette, UsesTheBrightestChannelWithoutTheSquaredIndexOfRefraction) {
  std::uint64_t rays = 0;
  core::PathState path = path_of(rays, {0.01F, -0.225F, 0.1F}, kMatt);
  EXPECT_FLOAT_EQ(continuation_probability(path), 0.5F);
  path.eta_scale = 1.5F;
  EXPECT_FLOAT_EQ(continuation_probability(path), 0.75F);
}

/// z of the radiance in a closed sphere with emission 1 - albedo: 1, by paths that end by roulette.
double sphere_z(float albedo, float pdf_bsdf, bool divides) {
  Random random(2);
  Moments out;
  std::uint64_t rays = 0;
  for (int i = 0; i < 300000; ++i) {
    core::PathState path = path_of(rays, Rgb(1), pdf_bsdf);
    float radiance = 0;
    for (int depth = 0; depth < 400; ++depth) {
      radiance += path.beta.g * (1 - albedo);
      path.beta *= albedo;
      const Rgb before = path.beta;
      if (!core::survives_roulette(path.beta, random.uniform(), continuation_probability(path))) {
        break;
      }
      if (!divides) {
        path.beta = before;
      }
    }
    out.add(static_cast<double>(radiance));
  }
  return out.z(1);
}

// Six tests at 4 sigma: a chance of 4e-4.
TEST(Roulette, KeepsTheMean) {
  for (const float density : {kMatt, kGlossy, kSmooth}) {
    for (const float albedo : {0.05F, 0.6F}) {
      EXPECT_LT(std::fabs(sphere_z(albedo, density, true)), 4) << albedo << ' ' << density;
    }
  }
}

TEST(Roulette, DetectsAMissingDivision) {
  for (const float density : {kMatt, kGlossy, kSmooth}) {
    EXPECT_GT(std::fabs(sphere_z(0.6F, density, false)), 4) << density;
  }
}

}  // namespace
