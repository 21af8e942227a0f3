#include "core/render/picture/split_pilot.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "core/samplers/dimensions.h"
#include "tests/support/scenes.h"

namespace {

using core::Camera;
using core::PathSample;
using core::PathSampler;
using core::Rgb;

TEST(BestSplitCount, IsThePowerOfTwoNextToTheRealOptimum) {
  for (const double ratio : {0.25, 1.0, 4.0, 9.0, 30.0}) {
    for (const double cost : {0.5, 1.0, 3.0}) {
      const core::SplitCosts costs = {
          .prefix_variance = 1, .branch_variance = ratio, .prefix_rays = 1, .branch_rays = cost};
      const double optimum =
          std::clamp(std::sqrt(ratio / cost), 1.0, static_cast<double>(core::kMeasuredSplitMost));
      const int best = core::best_split_count(costs);
      EXPECT_TRUE(best == 1 || best == 2 || best == 4 || best == 8);
      EXPECT_LT(std::abs(std::log2(best / optimum)), 1) << ratio << " " << cost;
    }
  }
}

TEST(BestSplitCount, IsBoundedAndOneIfNothingFollows) {
  EXPECT_EQ(core::best_split_count({0, 1, 1, 0.01}), core::kMeasuredSplitMost);
  EXPECT_EQ(core::best_split_count({1, 1, 1, 0}), 1);
  EXPECT_EQ(core::best_split_count({1, 0, 1, 3}), 1);
}

/// 10 + way * X + branch * Y, with X from the film position of the camera ray and Y from the random
/// numbers of the bounce; traces `rays` rays after the first surface.
class Product final : public core::Integrator {
 public:
  Product(float way, float branch, int rays, float exposure = 1)
      : way_(way), branch_(branch), rays_(rays), exposure_(exposure) {}
  PathSample trace(const Camera::CameraRay& ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override {
    rays += static_cast<std::uint64_t>(1 + rays_);
    PathSample out;
    const float x = 10000 * ray.ray.direction.x;
    const float y = sampler.get_4d(core::dimension_group(0, core::BounceGroup::kBsdf)).x;
    out.radiance = Rgb(exposure_ * (10 + way_ * (x - std::floor(x)) + branch_ * y));
    return out;
  }

 private:
  float way_;
  float branch_;
  int rays_;
  float exposure_;
};

// Both are uniform, so variances are proportional to the squared factors. 1024 pixels: each
// variance within a few percent.
TEST(MeasureSplit, FindsBothVariancesOfASeparableIntegrand) {
  core::CameraSettings pose;
  pose.position = core::Vec3{0, 0, 3};
  pose.target = core::Vec3{0, 0, 0};
  const auto camera = Camera::create(pose, {}, {}, 64, 64);
  ASSERT_TRUE(camera);
  core::RenderSettings settings;
  settings.film.width = settings.film.height = 64;
  for (const auto& [way, branch, rays] :
       {std::tuple{0.1F, 0.6F, 1}, std::tuple{0.2F, 0.6F, 4}, std::tuple{0.5F, 0.1F, 2}}) {
    const core::SplitCosts costs =
        *core::measure_split(*camera, Product(way, branch, rays), settings);
    EXPECT_NEAR(costs.branch_rays, rays, 1e-9);
    const auto ratio = static_cast<double>(branch * branch / (way * way));
    const double optimum =
        std::clamp(std::sqrt(ratio / rays), 1.0, static_cast<double>(core::kMeasuredSplitMost));
    EXPECT_LT(std::abs(std::log2(core::best_split_count(costs) / optimum)), 1)
        << way << " " << branch;
  }
}

TEST(MeasureSplit, IsIndependentOfExposure) {
  core::CameraSettings pose;
  pose.position = core::Vec3{0, 0, 3};
  pose.target = core::Vec3{0, 0, 0};
  const auto camera = Camera::create(pose, {}, {}, 64, 64);
  ASSERT_TRUE(camera);
  core::RenderSettings settings;
  settings.film.width = settings.film.height = 64;
  const core::SplitCosts usual = *core::measure_split(*camera, Product(0.2F, 0.6F, 4), settings);
  for (const float exposure : {1.0F / 1024, 1024.0F}) {
    const core::SplitCosts costs =
        *core::measure_split(*camera, Product(0.2F, 0.6F, 4, exposure), settings);
    // Powers of two: equal up to the rounding of sums.
    EXPECT_NEAR(costs.prefix_variance, usual.prefix_variance, 1e-9 * usual.prefix_variance);
    EXPECT_NEAR(costs.branch_variance, usual.branch_variance, 1e-9 * usual.branch_variance);
  }
}

TEST(MeasureSplit, IsReproducible) {
  core::View view = test_support::cornell_view(16, 16, 40);
  view.settings.estimator.splitting = core::SplittingType::kMeasured;
  const auto a = test_support::render(view, 4, 1);
  const auto b = test_support::render(view, 4, 2);
  EXPECT_EQ(a.progress.rays, b.progress.rays);
  EXPECT_EQ(a.mean().g, b.mean().g);
}

}  // namespace
