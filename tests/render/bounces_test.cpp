// Truth 19 for each path length: `path` and `bdpt` have the same expected light of each number of
// scattering events.
#include <gtest/gtest.h>

#include "tests/render/agreement.h"
#include "tests/render/agreement_scenes.h"

namespace {

using test_support::agrees;
using test_support::Blocks;
using test_support::compare;
using test_support::expect_agreement;
using test_support::layers_of;
using test_support::plus;

constexpr int kSide = 16;

struct Case {
  const char* name;
  core::View view;
  int path_samples;
  int bdpt_samples;
};
std::vector<Case> cases() {
  // Without the point light, around which single scattering has infinite variance in `path`.
  core::View fog = test_support::fog_in_box(kSide, {0.2F, 0.4F, 0.6F});
  fog.scene = test_support::box(kSide).scene;
  return {{"box", test_support::box(kSide), 64, 32},
          {"glossy box", test_support::glossy_box(kSide), 128, 64},
          {"fog", fog, 384, 144}};
}

const std::vector<std::string> kBounces = {"bounce:0", "bounce:1", "bounce:2"};
constexpr int kComparisons = 9;

TEST(Bounces, EachOfBdptIsThatOfPath) {
  for (Case& c : cases()) {
    c.view.settings.estimator.roulette = core::RouletteType::kNone;
    c.view.settings.max_depth = 2;
    const std::vector<Blocks> path = layers_of(c.view, 1000, c.path_samples, kBounces);
    c.view.settings.integrator = "bdpt";
    const std::vector<Blocks> bdpt = layers_of(c.view, 1, c.bdpt_samples, kBounces);
    for (std::size_t i = 0; i < kBounces.size(); ++i) {
      const std::string name = std::string(c.name) + ", " + kBounces[i];
      expect_agreement(compare(bdpt[i], path[i]), kComparisons, name);
      EXPECT_FALSE(agrees(compare(plus(bdpt[i], 0.03, bdpt[i]), path[i]), kComparisons))
          << name << " with 3% more light";
    }
  }
}

// Sampled light (s = 1) and splats (t = 1) find all light of a path length where every surface is
// diffuse. The planted fault is what a wrong number of light paths or a wrong weight would be.
TEST(Bounces, EachStrategyAloneFindsTheWholeBounce) {
  const std::vector<std::string> strategies = {"st:1,2:unweighted", "st:2,1:unweighted",
                                               "st:1,3:unweighted", "st:3,1:unweighted"};
  const auto comparisons = static_cast<int>(strategies.size());
  core::View view = test_support::box(kSide);
  view.settings.estimator.roulette = core::RouletteType::kNone;
  view.settings.max_depth = 2;
  const std::vector<Blocks> path = layers_of(view, 1000, 256, {"bounce:1", "bounce:2"});
  view.settings.integrator = "bdpt";
  const std::vector<Blocks> bdpt = layers_of(view, 1, 128, strategies);
  for (std::size_t i = 0; i < strategies.size(); ++i) {
    const Blocks& bounce = path[i / 2];
    expect_agreement(compare(bdpt[i], bounce), comparisons, strategies[i]);
    for (const double excess : {0.02, -0.02}) {
      EXPECT_FALSE(agrees(compare(plus(bdpt[i], excess, bdpt[i]), bounce), comparisons))
          << strategies[i] << " times " << 1 + excess;
    }
  }
}

}  // namespace
