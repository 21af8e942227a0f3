// Convergence rates of the error with the number of samples.
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/samplers/path_sampler.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::PathSampler;
using core::SamplerType;
using core::Vec4;

struct Integrand {
  std::function<double(Vec4)> f;
  double truth = 0;
};

// Integrands of the first two of four dimensions, and a smooth one of all four.
Integrand smooth_2d() {
  return {[](Vec4 u) {
            return std::exp(static_cast<double>(u.x)) * std::exp(static_cast<double>(u.y));
          },
          (std::exp(1.0) - 1) * (std::exp(1.0) - 1)};
}
Integrand disk() {
  return {[](Vec4 u) { return static_cast<double>(u.x * u.x + u.y * u.y) < 1 ? 1.0 : 0.0; },
          0.785398163397448};
}
Integrand smooth_4d() {
  return {[](Vec4 u) { return std::exp(static_cast<double>(u.x + u.y + u.z + u.w)); },
          std::pow(std::exp(1.0) - 1, 4)};
}

double rmse(SamplerType type, const Integrand& g, int n) {
  double sum = 0;
  constexpr int kReplicates = 200;
  PathSampler sampler(type, 2, 4);
  for (int r = 0; r < kReplicates; ++r) {
    double mean = 0;
    for (int s = 0; s < n; ++s) {
      sampler.start(r, 7, 2 * s);
      mean += g.f(sampler.get_4d(3));
    }
    mean /= n;
    sum += (mean - g.truth) * (mean - g.truth);
  }
  return std::sqrt(sum / kReplicates);
}

double slope_of(SamplerType type, const Integrand& g) {
  std::vector<double> x;
  std::vector<double> y;
  for (int n = 16; n <= 1024; n *= 2) {
    x.push_back(std::log(n));
    y.push_back(std::log(rmse(type, g, n)));
  }
  const double s = test_support::slope(x, y);
  std::printf("    slope %.3f\n", s);
  return s;
}

// The standard error of each log rmse of 200 is 0.05, that of a slope over 16..1024 is 0.014.
TEST(Convergence, ErrorOfIndependentSamplesHalvesAtFourTimesTheCost) {
  EXPECT_NEAR(slope_of(SamplerType::kIndependent, smooth_2d()), -0.5, 0.05);
  EXPECT_NEAR(slope_of(SamplerType::kIndependent, disk()), -0.5, 0.05);
}

TEST(Convergence, SobolConvergesFasterForSmootherIntegrands) {
  EXPECT_NEAR(slope_of(SamplerType::kSobol, smooth_2d()), -1.5, 0.1);
  EXPECT_NEAR(slope_of(SamplerType::kSobol, disk()), -0.75, 0.08);
  EXPECT_LT(slope_of(SamplerType::kSobol, smooth_4d()), -1.2);
}

// Relative to independent points, at 1,024 points: 570 times in 2-D smooth, 5.7 on the disk.
TEST(Convergence, SobolGainsTheMeasuredFactor) {
  const double smooth = rmse(SamplerType::kIndependent, smooth_2d(), 1024) /
                        rmse(SamplerType::kSobol, smooth_2d(), 1024);
  const double edge =
      rmse(SamplerType::kIndependent, disk(), 1024) / rmse(SamplerType::kSobol, disk(), 1024);
  std::printf("    gain %.0f smooth, %.1f disk\n", smooth, edge);
  EXPECT_GT(smooth, 300);
  EXPECT_NEAR(edge, 5.7, 1.5);
}

// A whole image of soft light, including edges and corners. The error is the standard deviation of
// images with different seeds, relative to their mean.
double relative_spread(core::View view, int samples) {
  constexpr int kSeeds = 8;
  std::vector<test_support::Moments> pixels;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    view.settings.seed = seed;
    const auto film = test_support::render(view, samples).snapshot;
    pixels.resize(film.pixel_count());
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      pixels[p].add(static_cast<double>(core::pixel_value(film, p).mean.g));
    }
  }
  double sum = 0;
  for (const auto& p : pixels) {
    sum += p.variance() / (p.mean * p.mean + 0.01);
  }
  return std::sqrt(sum / static_cast<double>(pixels.size()));
}

TEST(Convergence, ImageUnderASoftLightConvergesFasterThanTheSquareRoot) {
  core::View view = test_support::cornell_view(48, 48, 40);
  view.settings.max_depth = 1;
  const auto fall = [&view](SamplerType type) {
    view.settings.sampler = type;
    std::vector<double> x;
    std::vector<double> y;
    for (int samples = 8; samples <= 128; samples *= 2) {
      x.push_back(std::log(samples));
      y.push_back(std::log(relative_spread(view, samples)));
    }
    const double s = test_support::slope(x, y);
    std::printf("    slope %.3f, error %.4f to %.4f\n", s, std::exp(y.front()), std::exp(y.back()));
    return s;
  };
  EXPECT_NEAR(fall(SamplerType::kIndependent), -0.5, 0.03);
  // Edges of shadows and objects, in the four dimensions of a point on the film and one on the
  // emitter: the error of an edge in d dimensions falls as N^-(1/2 + 1/2d) (He and Wang 2015), here
  // as -0.625; smooth parts fall faster.
  EXPECT_LT(fall(SamplerType::kSobol), -0.625 + 0.03);
}

}  // namespace
