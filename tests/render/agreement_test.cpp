// Truth 19: every option and every unbiased integrator has the same expected image as plain path
// tracing.
#include "tests/render/agreement.h"

#include <cstdio>

#include "tests/render/agreement_scenes.h"
#include "tests/render/truth.h"
#include "tests/support/caustic.h"
#include "tests/support/statistics.h"

namespace {

using test_support::Agreement;
using test_support::agrees;
using test_support::Blocks;
using test_support::blocks_of;
using test_support::compare;
using test_support::expect_agreement;
using test_support::kAgreementSeeds;
using test_support::layers_of;
using test_support::plus;

core::View without_roulette(core::View view) {
  view.settings.estimator.roulette = core::RouletteType::kNone;
  return view;
}

/// Fewer than 50 variants in two scenes.
constexpr int kVariants = 100;

/// Samples, in halves of those of MIS, that make an error below kErrorMost in both scenes.
int effort_of(const test_support::Variant& v, bool gloss) {
  switch (v.estimator.strategy) {
    case core::Strategy::kMis:
      return v.sampler == core::SamplerType::kAntithetic ||
                     v.estimator.splitting == core::SplittingType::kMeasured
                 ? 2
                 : 1;
    case core::Strategy::kLight:
      return gloss ? 8 : 2;
    case core::Strategy::kBsdf:
      return gloss ? 2 : 4;
    case core::Strategy::kCosine:
      return 4;
    case core::Strategy::kUniform:
      return 8;
  }
  return 8;
}

// gloss: excludes the strategies that ignore the BSDF. Their samples of a narrow lobe are so rare
// and so large that means of 16 images are far from normal; irradiance_test.cpp and
// furnace_test.cpp test them.
void expect_variants_agree(core::View view, int samples, bool gloss) {
  view = without_roulette(view);
  const Blocks reference = blocks_of(view, 1000, 2 * samples);
  int seed = 1;
  for (const auto& v : test_support::variants()) {
    const core::Strategy strategy = v.estimator.strategy;
    if (gloss && (strategy == core::Strategy::kCosine || strategy == core::Strategy::kUniform)) {
      continue;
    }
    const bool is_mis = strategy == core::Strategy::kMis;
    test_support::apply(v, view);
    const Blocks seen = blocks_of(view, seed, effort_of(v, gloss) * samples / 2);
    seed += kAgreementSeeds;
    expect_agreement(compare(seen, reference), kVariants, v.name);
    if (is_mis) {
      EXPECT_FALSE(agrees(compare(plus(seen, 0.03, seen), reference), kVariants))
          << v.name << " with 3% more light";
    }
  }
}

constexpr int kVariantSide = 32;

TEST(Agreement, AllOptionsAgreeInTheCornellBox) {
  expect_variants_agree(test_support::box(kVariantSide), 16, false);
}
TEST(Agreement, AllOptionsAgreeOnGlossyMaterials) {
  expect_variants_agree(test_support::zoo(kVariantSide), 8, true);
}

/// Light subpaths start everywhere, so they are expensive and few: a small film, blocks of 4 x 4
/// pixels.
constexpr int kLightSide = 16;

/// More lights, many of them, and textures: emitters_test.cpp. A scene, and the samples that make
/// means of 16 images normal in it. Light tracing finds few of the pixels; path tracing, the
/// reference, finds caustics only by chance.
struct LightPaths {
  const char* name;
  core::View view;
  int light_trace_samples;
  int other_samples;
  int reference_samples;
};
std::vector<LightPaths> light_path_scenes() {
  core::View glossy = test_support::zoo(kLightSide);
  glossy.settings.film.filter = {core::FilterType::kTent, 1};
  core::View caustic = test_support::caustic();
  caustic.settings.film.width = caustic.settings.film.height = kLightSide;
  return {{"box", test_support::box(kLightSide), 32, 32, 64},
          {"glossy things", glossy, 512, 64, 128},
          {"half clear pane", test_support::pane(kLightSide), 128, 64, 256},
          {"caustic", caustic, 64, 64, 768},
          {"instances", test_support::instances(kLightSide), 256, 128, 256}};
}

constexpr const char* kLightIntegrators[] = {"light-trace", "bdpt", "mlt"};
constexpr int kLightComparisons = 15;

/// Strategies of bdpt that a fault might lose; all scenes have light of each.
const std::vector<std::string> kStrategies = {"st:1,2", "st:1,3", "st:2,1"};

struct Seen {
  std::string name;
  std::string integrator;
  std::vector<Blocks> parts;  ///< scattered light, for bdpt the strategies, and last the image
  Blocks reference;
  /// Applies the rule of the test to the image with this fault.
  bool detects(double factor, std::size_t part) const {
    return !agrees(compare(plus(parts.back(), factor, parts[part]), reference), kLightComparisons);
  }
};

/// Rendered once for all tests.
const std::vector<Seen>& light_images() {
  static const std::vector<Seen> images = [] {
    std::vector<Seen> out;
    for (const LightPaths& scene : light_path_scenes()) {
      core::View view = without_roulette(scene.view);
      const Blocks reference = blocks_of(view, 1000, scene.reference_samples);
      for (const char* integrator : kLightIntegrators) {
        view.settings.integrator = integrator;
        std::vector<std::string> layers = {test_support::kSplats};
        if (view.settings.integrator == "bdpt") {
          layers = {"bounce:1-"};
          layers.insert(layers.end(), kStrategies.begin(), kStrategies.end());
        }
        const bool is_light = view.settings.integrator == "light-trace";
        out.push_back(
            {scene.name, integrator,
             layers_of(view, 1, is_light ? scene.light_trace_samples : scene.other_samples, layers),
             reference});
      }
    }
    return out;
  }();
  return images;
}

TEST(Agreement, BidirectionalIntegratorsAgreeWithPathTracing) {
  EXPECT_EQ(light_images().size(), kLightComparisons);
  for (const Seen& seen : light_images()) {
    expect_agreement(compare(seen.parts.back(), seen.reference), kLightComparisons,
                     seen.name + ", " + seen.integrator);
  }
}

// Light seen directly stays as it is: blocks of sky would give the fault away.
TEST(Agreement, DetectsThreePercentMoreScatteredLightInEveryScene) {
  for (const Seen& seen : light_images()) {
    const double excess = seen.integrator == "light-trace" ? 0.05 : 0.03;
    EXPECT_TRUE(seen.detects(excess, 0)) << seen.name << ", " << seen.integrator;
  }
}

TEST(Agreement, DetectsALostStrategyInEveryScene) {
  for (const Seen& seen : light_images()) {
    for (std::size_t i = 0; i < kStrategies.size() && seen.integrator == "bdpt"; ++i) {
      EXPECT_TRUE(seen.detects(-1, i + 1)) << seen.name << " without " << kStrategies[i];
    }
  }
}

// The planted fault is 5% more scattered light: the prisms' light is mostly that of the sky behind.
TEST(Agreement, LightPathsDisperseAsPathsDo) {
  constexpr int kComparisons = 2;
  core::View view = without_roulette(test_support::prisms(kLightSide));
  const Blocks reference = blocks_of(view, 1000, 128);
  for (const char* integrator : {"bdpt", "mlt"}) {
    view.settings.integrator = integrator;
    const bool is_bdpt = view.settings.integrator == "bdpt";
    const std::vector<Blocks> parts =
        layers_of(view, 1, 32, {is_bdpt ? std::string("bounce:1-") : test_support::kSplats});
    expect_agreement(compare(parts.back(), reference), kComparisons, integrator);
    EXPECT_FALSE(agrees(compare(plus(parts.back(), 0.05, parts[0]), reference), kComparisons))
        << integrator;
  }
}

constexpr double kAlarmLevel = 0.05;
/// Bounds of the number of alarms among 200 independent comparisons at this level: outside of each
/// with probability 0.1% (binomial distribution).
constexpr int kNullComparisons = 200;
constexpr int kAlarmsLeast = 2;
constexpr int kAlarmsMost = 21;

// Two halves of the replicates of one film: equal by construction, and independent of the other
// films, so that the number of alarms is binomial. Films of few samples are the hard case, since
// they are farther from normal than those of the other tests. Bonferroni's factors make all but the
// squares conservative, so only those have a lower bound too.
TEST(Agreement, RaisesAsManyFalseAlarmsAsItStates) {
  core::View view = without_roulette(test_support::box(8));
  view.settings.integrator = "bdpt";
  int image = 0;
  int block = 0;
  int squares = 0;
  int all = 0;
  int twice = 0;
  std::vector<double> p_values;
  for (int i = 0; i < kNullComparisons; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i);
    const Blocks rows = test_support::replicates_of(view, 2 * kAgreementSeeds, 2);
    const auto middle = rows.begin() + kAgreementSeeds;
    const Agreement a = compare(Blocks(rows.begin(), middle), Blocks(middle, rows.end()));
    image += a.image < kAlarmLevel ? 1 : 0;
    block += a.block < kAlarmLevel ? 1 : 0;
    squares += a.squares < kAlarmLevel ? 1 : 0;
    all += a.p() < kAlarmLevel ? 1 : 0;
    p_values.push_back(a.squares);
    // The planted fault: every seed counts twice.
    Blocks first(rows.begin(), rows.begin() + kAgreementSeeds / 2);
    Blocks last(middle, middle + kAgreementSeeds / 2);
    first.insert(first.end(), rows.begin(), rows.begin() + kAgreementSeeds / 2);
    last.insert(last.end(), middle, middle + kAgreementSeeds / 2);
    twice += compare(first, last).p() < kAlarmLevel ? 1 : 0;
  }
  std::printf("    alarms: image %d, block %d, squares %d, all %d; every seed twice %d\n", image,
              block, squares, all, twice);
  EXPECT_LE(image, kAlarmsMost);
  EXPECT_LE(block, kAlarmsMost);
  EXPECT_LE(squares, kAlarmsMost);
  EXPECT_GE(squares, kAlarmsLeast);
  EXPECT_LE(all, kAlarmsMost);
  EXPECT_GT(test_support::ks_uniform(p_values), 0.001);
  EXPECT_GT(twice, kAlarmsMost);
}

}  // namespace
