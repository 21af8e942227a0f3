// Holes of MASK: "alpha values less than the cutoff are transparent" (glTF 2.0, 3.9.4).
#include <gtest/gtest.h>

#include "core/scene/scene_data.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Vec3;

constexpr int kRays = 20'000;

/// Rays from all sides that fall on holes of a triangle whose vertices have this alpha.
int holes(float alpha, float cutoff) {
  core::MaterialDescription m;
  m.alpha_mode = core::AlphaMode::kMask;
  m.alpha_cutoff = cutoff;
  core::PrimitiveDescription triangle;
  triangle.positions = {{-1, -0.7F, 0.2F}, {1.1F, -0.9F, 0}, {0.1F, 1.3F, -0.3F}};
  triangle.indices = {0, 1, 2};
  triangle.colors.assign(3, {1, 1, 1, alpha});
  triangle.material = 0;
  const auto scene = test_support::build(test_support::scene_of({m}, {triangle}));
  const core::SceneData& data = scene->data();
  test_support::Random random(1);
  int found = 0;
  for (int i = 0; i < kRays; ++i) {
    const Vec3 target = {random.uniform() - 0.5F, random.uniform() - 0.5F, 0};
    core::Ray ray;
    ray.direction = test_support::random_hemisphere(random);
    ray.origin = target - ray.direction * 4.0F;
    core::RawHit hit;
    if (data.accel->intersect(ray, hit)) {
      found += data.coverage(hit, ray) < 1 ? 1 : 0;
    }
  }
  return found;
}

TEST(Holes, AlphaOfTheCutoffIsNone) {
  for (const float alpha : {0.5F, 0.25F, 1 / 3.0F, 0.1F, 0.75F, 1.0F}) {
    EXPECT_EQ(holes(alpha, alpha), 0) << alpha;
    // A part in 50 000 less is far beyond rounding.
    EXPECT_GT(holes(alpha * (1 - 2e-5F), alpha), kRays / 3) << alpha;
  }
}

}  // namespace
