// Truth 19: every option gives the same picture. Blocks of pictures of 16 seeds against 16 other
// seeds of plain path tracing, Welch's t; the p-values of all blocks are uniform
// (Kolmogorov-Smirnov), and none is too small.
#include <cmath>

#include "core/settings/registry.h"
#include "tests/render/truth.h"
#include "tests/support/caustic.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using test_support::Moments;

constexpr int kSeeds = 16;
constexpr int kSide = 32;
constexpr int kBlock = 8;
constexpr std::size_t kBlocks = (kSide / kBlock) * (kSide / kBlock);

using Blocks = std::vector<Moments>;

Blocks blocks_of(core::View view, int first_seed, int samples) {
  Blocks blocks(3 * kBlocks);
  for (int i = 0; i < kSeeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(first_seed + i);
    const auto film = test_support::render(view, samples).snapshot;
    std::vector<double> sums(3 * kBlocks, 0.0);
    for (std::size_t p = 0; p < film.pixel_count(); ++p) {
      const std::size_t block = p / kSide / kBlock * (kSide / kBlock) + p % kSide / kBlock;
      const Rgb v = core::pixel_value(film, p).mean;
      for (std::size_t c = 0; c < 3; ++c) {
        sums[3 * block + c] += static_cast<double>(v[static_cast<int>(c)]);
      }
    }
    for (std::size_t k = 0; k < sums.size(); ++k) {
      blocks[k].add(sums[k]);
    }
  }
  return blocks;
}

struct Agreement {
  double least_p = 1;
  double ks = 1;
};

Agreement compare(const Blocks& a, const Blocks& b) {
  std::vector<double> p_values;
  // Green alone: channels of one block are correlated.
  for (std::size_t k = 1; k < a.size(); k += 3) {
    const double va = a[k].variance() / kSeeds;
    const double vb = b[k].variance() / kSeeds;
    if (!(va + vb > 0)) {
      continue;
    }
    const double t = (a[k].mean - b[k].mean) / std::sqrt(va + vb);
    const double dof = (va + vb) * (va + vb) / ((va * va + vb * vb) / (kSeeds - 1));
    p_values.push_back(2 * (1 - test_support::student_t_cdf(std::fabs(t), dof)));
  }
  Agreement out;
  for (const double p : p_values) {
    out.least_p = std::min(out.least_p, p);
  }
  out.ks = test_support::ks_uniform(p_values);
  return out;
}

core::View box() {
  core::View view =
      test_support::view_of(test_support::build(test_support::cornell()), kSide, kSide);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = 4;
  return view;
}

/// Metal, rough glass, plastic; a lamp, a point light, a map for a sky.
core::View zoo() {
  core::MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = 0.5F;
  metal.base_color = {0.9F, 0.6F, 0.3F};
  core::MaterialDescription glass;
  glass.metallic = 0;
  glass.roughness = 0.5F;
  glass.transmission = 1;
  glass.thickness = 1;
  core::MaterialDescription plastic;
  plastic.metallic = 0;
  plastic.roughness = 0.4F;
  plastic.base_color = {0.2F, 0.5F, 0.8F};
  auto lamp = test_support::emitter(Rgb(4));
  lamp.double_sided = true;
  core::SceneDescription scene = test_support::scene_of(
      {plastic, metal, glass, lamp}, {test_support::quad({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, 0),
                                      test_support::sphere({-0.9F, 0.6F, 0}, 0.6F, 12, false, 1),
                                      test_support::sphere({0.6F, 0.6F, 0.5F}, 0.6F, 12, false, 2),
                                      test_support::quad({-1, 2, -1.5F}, {2, 0, 0}, {0, 1, 0}, 3)});
  core::PunctualLightDescription point;
  point.intensity = {2, 1, 1};
  point.to_world = core::translation({1.5F, 2, 1.5F});
  scene.lights.push_back(point);
  core::View view = test_support::view_of(test_support::build(std::move(scene)), kSide, kSide);
  test_support::look_at(view, {0, 1.6F, 4}, {0, 0.7F, 0}, 45);
  view.environment = test_support::sky_map(
      16, 8, [](int x, int y) { return Rgb(0.2F + 0.1F * static_cast<float>((x + y) % 3)); });
  view.settings.max_depth = 4;
  return view;
}

// Fewer than 50 variants in two scenes, each with a KS test and the least of 16 p-values; 0.1 %
// over all of them (Sidak). The null comparison is one of them. gloss: not for the strategies that
// ignore the BSDF. Their samples of a narrow lobe are so rare and so large that means of 16
// pictures are far from normal; they are held to the truths of irradiance_test.cpp and
// furnace_test.cpp.
void expect_agreement(core::View view, int samples, bool gloss) {
  const double level_ks = test_support::sidak(0.001, 100);
  const double level_p = test_support::sidak(0.001, 100 * static_cast<int>(kBlocks));
  view.settings.estimator.roulette = core::RouletteType::kNone;
  const Blocks reference = blocks_of(view, 1000, 2 * samples);
  int seed = 1;
  for (const auto& v : test_support::variants()) {
    const core::Strategy strategy = v.estimator.strategy;
    if (gloss && (strategy == core::Strategy::kCosine || strategy == core::Strategy::kUniform)) {
      continue;
    }
    test_support::apply(v, view);
    const Agreement a = compare(blocks_of(view, seed, samples), reference);
    seed += kSeeds;
    EXPECT_GT(a.least_p, level_p) << v.name;
    EXPECT_GT(a.ks, level_ks) << v.name;
  }
}

TEST(Agreement, OfAllOptionsInTheCornellBox) { expect_agreement(box(), 16, false); }
TEST(Agreement, OfAllOptionsAmongGlossyThings) { expect_agreement(zoo(), 16, true); }

// A lamp, a point light, a map for a sky; metal, rough and smooth glass, a mirror, bent normals.
core::View zoo_for_light_paths() {
  core::View view = zoo();
  view.settings.film.filter = {core::FilterType::kTent, 1};
  return view;
}

struct LightTracing {
  const char* name;
  core::View view;
};
std::vector<LightTracing> light_tracings() {
  core::View caustic = test_support::caustic();
  caustic.settings.film.width = caustic.settings.film.height = kSide;
  core::View lens = box();
  lens.camera.aperture_radius_m = 0.05F;
  return {{"box", box()},
          {"thin lens", lens},
          {"glossy things", zoo_for_light_paths()},
          {"caustic", caustic}};
}

/// Paths find a caustic by chance: means of 16 pictures need more samples there to be normal.
Agreement light_paths_agree(core::View view, const char* integrator, float brightness) {
  view.settings.estimator.roulette = core::RouletteType::kNone;
  const Blocks reference = blocks_of(view, 1000, 256);
  view.settings.integrator = integrator;
  if (view.environment == nullptr && brightness != 1) {
    core::SceneDescription brighter = test_support::cornell();
    brighter.materials[3].emissive = Rgb(15 * brightness);
    view.scene = test_support::build(std::move(brighter));
  }
  return compare(blocks_of(view, 1, 64), reference);
}

void expect_light_paths_agree(const char* integrator) {
  const std::vector<LightTracing> cases = light_tracings();
  const int tests = static_cast<int>(cases.size());
  for (const LightTracing& one : cases) {
    const Agreement a = light_paths_agree(one.view, integrator, 1);
    EXPECT_GT(a.least_p, test_support::sidak(0.001, 2 * tests * static_cast<int>(kBlocks)))
        << one.name;
    EXPECT_GT(a.ks, test_support::sidak(0.001, 2 * tests)) << one.name;
  }
}

TEST(Agreement, OfLightTracingWithPathTracing) { expect_light_paths_agree("light-trace"); }
TEST(Agreement, OfBidirectionalWithPathTracing) { expect_light_paths_agree("bdpt"); }

TEST(Agreement, ThreePercentMoreLightAreSeenOfLightPaths) {
  for (const char* integrator : {"light-trace", "bdpt"}) {
    const Agreement a = light_paths_agree(box(), integrator, 1.03F);
    EXPECT_LT(std::min(a.least_p * static_cast<double>(kBlocks), a.ks), 1e-4) << integrator;
  }
}

// What is to be seen must be seen: light that is 3 % too strong.
TEST(Agreement, ThreePercentMoreLightAreSeen) {
  core::View view = box();
  const Blocks reference = blocks_of(view, 1000, 64);
  core::SceneDescription brighter = test_support::cornell();
  brighter.materials[3].emissive = Rgb(15 * 1.03F);
  view.scene = test_support::build(std::move(brighter));
  const Agreement a = compare(blocks_of(view, 1, 64), reference);
  EXPECT_LT(std::min(a.least_p * static_cast<double>(kBlocks), a.ks), 1e-4);
}

}  // namespace
