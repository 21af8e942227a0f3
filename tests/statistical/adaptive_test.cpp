// Adaptive sampling: the bias of stop rules (the table of stop rules against closed forms), and the
// product's adaptive types on films with known expected values, rendered by its own tasks and
// plans.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/layers/layers.h"
#include "core/settings/choices.h"
#include "tests/support/statistics.h"
#include "tests/support/synthetic.h"

namespace {

using core::AdaptiveType;
using test_support::Moments;
using test_support::Random;
using test_support::Synthetic;

// ---- The textbook rules, one pixel, true mean 1.

using Draw = std::function<double(Random&)>;

double event_50(Random& r) { return r.uniform_double() < 0.02 ? 50 : 0; }
double exponential(Random& r) { return -std::log(1 - r.uniform_double()); }

enum class Rule {
  kHalfMetric,
  kStandardError,
  kTwoStageReused,
  kTwoStageDiscarded,
  kCrossHalf,
  kCrossHalfByCount
};

/// The two halves of a pixel, which take samples alternately.
struct Halves {
  Moments a;
  Moments b;
  double mean() const { return (a.n * a.mean + b.n * b.mean) / (a.n + b.n); }
};

void feed(Moments& half, const Draw& draw, Random& random, int count) {
  for (int i = 0; i < count; ++i) {
    half.add(draw(random));
  }
}

/// Samples that a pixel needs for a standard error of 10% of its mean, estimated from `seen`; 32
/// to 1024.
int needed(const Moments& seen) {
  const double target = 0.1 * std::max(std::fabs(seen.mean), 1e-9);
  return static_cast<int>(std::clamp(seen.variance() / (target * target), 32.0, 1024.0));
}

/// The value of a pixel by one rule: at most 1024 samples, checked every 16; two-stage rules use a
/// pilot of 32.
double pixel_by(Rule rule, const Draw& draw, Random& random) {
  Halves h;
  if (rule == Rule::kHalfMetric || rule == Rule::kStandardError) {
    while (h.a.n + h.b.n < 1024) {
      feed(h.a, draw, random, 8);
      feed(h.b, draw, random, 8);
      const double metric = std::fabs(h.a.mean - h.b.mean) / 2;
      Moments all;
      all.n = h.a.n + h.b.n;
      all.m2 = h.a.m2 + h.b.m2;
      const double error =
          rule == Rule::kHalfMetric
              ? metric / (h.mean() < 1 ? std::sqrt(std::max(h.mean(), 1e-9)) : h.mean())
              : all.standard_error() / std::max(h.mean(), 1e-9);
      if (error < (rule == Rule::kHalfMetric ? 0.05 : 0.1)) {
        break;
      }
    }
    return h.mean();
  }
  if (rule == Rule::kCrossHalf || rule == Rule::kCrossHalfByCount) {
    feed(h.a, draw, random, 16);
    feed(h.b, draw, random, 16);
    const int more_a = needed(h.b) / 2 - 16;
    const int more_b = needed(h.a) / 2 - 16;
    feed(h.a, draw, random, more_a);
    feed(h.b, draw, random, more_b);
    return rule == Rule::kCrossHalf ? (h.a.mean + h.b.mean) / 2 : h.mean();
  }
  feed(h.a, draw, random, 32);
  const int count = needed(h.a);
  if (rule == Rule::kTwoStageReused) {
    feed(h.a, draw, random, count - 32);
    return h.a.mean;
  }
  feed(h.b, draw, random, count);
  return h.b.mean;
}

Moments runs_of(Rule rule, const Draw& draw, int runs) {
  Moments out;
  Random random(7);
  for (int i = 0; i < runs; ++i) {
    out.add(pixel_by(rule, draw, random));
  }
  std::printf("    %+.1f %% (%.1f %%)\n", 100 * (out.mean - 1), 100 * out.standard_error());
  return out;
}

// Simulated with 200,000 trials, for events of 2%: -48, -71, -51%, +.2, +.4, -49%. Rules without
// bias stay within 4 standard errors (false alarm 6e-5 for each of four); biased rules are off by
// tens of percent.
TEST(StopBias, SequentialRulesUnderestimateRareEvents) {
  EXPECT_LT(runs_of(Rule::kHalfMetric, event_50, 20000).mean, 0.7);
  EXPECT_LT(runs_of(Rule::kStandardError, event_50, 20000).mean, 0.5);
}
TEST(StopBias, ReusedPilotUnderestimatesRareEvents) {
  EXPECT_LT(runs_of(Rule::kTwoStageReused, event_50, 20000).mean, 0.7);
}
TEST(StopBias, DiscardedPilotIsUnbiased) {
  EXPECT_LT(std::fabs(runs_of(Rule::kTwoStageDiscarded, event_50, 20000).z(1)), 4);
  EXPECT_LT(std::fabs(runs_of(Rule::kTwoStageDiscarded, exponential, 20000).z(1)), 4);
}
TEST(StopBias, CrossHalvesWithEqualWeightsAreUnbiased) {
  EXPECT_LT(std::fabs(runs_of(Rule::kCrossHalf, event_50, 20000).z(1)), 4);
  EXPECT_LT(std::fabs(runs_of(Rule::kCrossHalf, exponential, 20000).z(1)), 4);
}
TEST(StopBias, CrossHalvesWeightedByCountUnderestimateRareEvents) {
  EXPECT_LT(runs_of(Rule::kCrossHalfByCount, event_50, 20000).mean, 0.7);
}

// ---- The product's adaptive types.

constexpr float kEvent = 1000;
constexpr int kSamples = 128;

Synthetic rare(AdaptiveType type) {
  Synthetic s;
  s.adaptive.type = type;
  s.adaptive.dilation = 0;
  return s;
}

struct Totals {
  Moments mean;        ///< of an image; the true value is 1
  Moments unreported;  ///< (x - 1)^2 - (A - B)^2 / 4, mean over an image: covariance of the halves
  double uneven = 0;   ///< pixels whose halves have different counts
  double spread = 0;   ///< largest over smallest count, last image
};

/// scale: factor of every sample.
Totals render_many(AdaptiveType type, int pictures, float scale = 1) {
  Totals out;
  Synthetic s = rare(type);
  s.sample = [scale](Random& r, int, int) { return scale * test_support::rare_event(r, kEvent); };
  for (int i = 0; i < pictures; ++i) {
    const auto picture = test_support::render(s, kSamples, static_cast<std::uint64_t>(i) + 1);
    double sum = 0;
    double unreported = 0;
    const auto n = static_cast<double>(picture.snapshot.pixel_count());
    for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
      const auto x = static_cast<double>(core::pixel_value(picture.snapshot, p).mean.g);
      const auto a = core::half_value(picture.snapshot, p, 0);
      const auto b = core::half_value(picture.snapshot, p, 1);
      const auto d = static_cast<double>(a.mean.g - b.mean.g);
      sum += x / n;
      unreported += ((x - 1) * (x - 1) - d * d / 4) / n;
      out.uneven += a.count != b.count ? 1 : 0;
    }
    out.mean.add(sum);
    out.unreported.add(unreported);
    out.spread = static_cast<double>(picture.progress.samples_max) / picture.progress.samples_min;
  }
  std::printf("    mean %.4f (%.4f)  covariance of the halves %+.4f (%.4f)  counts spread %.1f\n",
              out.mean.mean, out.mean.standard_error(), out.unreported.mean,
              out.unreported.standard_error(), out.spread);
  return out;
}

// z-tests over images, which are independent; |z| < 4: false alarm 6e-5 each.
TEST(AdaptiveTypes, PilotIsUnbiasedAndItsErrorsAreValid) {
  const Totals t = render_many(AdaptiveType::kPilot, 60);
  EXPECT_GT(t.spread, 2) << "sampling was not adaptive";
  EXPECT_LT(std::fabs(t.mean.z(1)), 4);
  EXPECT_LT(std::fabs(t.unreported.z(0)), 4);
  EXPECT_EQ(t.uneven, 0);
}

// The planted fault: if the counts of pixels depended on their own samples, light would be missing.
// The same check detects an image that misses a twentieth of it.
TEST(AdaptiveTypes, DetectsAnImageThatMissesLight) {
  const Totals t = render_many(AdaptiveType::kPilot, 60, 0.95F);
  EXPECT_LT(t.mean.z(1), -4);
}

TEST(AdaptiveTypes, AreUnbiasedWithAValidError) {
  core::RenderSettings settings;
  for (const auto& row : core::adaptive_types()) {
    settings.adaptive.type = row.value;
    EXPECT_EQ(core::bias_of(settings), "none") << row.name;
    EXPECT_TRUE(core::halves_show_error(settings)) << row.name;
  }
}

// A quarter of the image has a hundred times the noise of the rest.
Synthetic uneven_noise(AdaptiveType type) {
  Synthetic s;
  s.adaptive.type = type;
  s.sample = [](Random& r, int x, int y) {
    return 1 + (x < 32 && y < 32 ? 1.0F : 0.01F) * static_cast<float>(r.normal());
  };
  return s;
}

double squared_error(AdaptiveType type, int pictures) {
  double sum = 0;
  for (int i = 0; i < pictures; ++i) {
    const auto picture =
        test_support::render(uneven_noise(type), 256, static_cast<std::uint64_t>(i) + 1);
    for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
      const auto d = static_cast<double>(core::pixel_value(picture.snapshot, p).mean.g) - 1;
      sum += d * d / static_cast<double>(picture.snapshot.pixel_count()) / pictures;
    }
  }
  return sum;
}

// The sum of variance / n at a given sum of n is minimal for n proportional to the standard
// deviations: here (1/4 1 + 3/4 0.01)^2 instead of 1/4, a factor 3.8. A tenth of the samples is
// uniform, and the pilot's window blurs the edge: more than half of the gain remains.
TEST(AdaptiveTypes, AllocateSamplesWhereTheNoiseIs) {
  const double none = squared_error(AdaptiveType::kNone, 2);
  EXPECT_NEAR(none, 0.25 / 256,
              0.25 / 256 * 0.1);  // 2,048 noisy pixels: a standard deviation of 3%
  const double gain = none / squared_error(AdaptiveType::kPilot, 2);
  std::printf("    variance %.2f times less\n", gain);
  EXPECT_GT(gain, 2);
  EXPECT_LT(gain, 4.2);
}

// 95% intervals of tiles, with adaptive sampling by pixels and by tiles: 120 images of 4 tiles
// each; 960 trials, a standard deviation of 0.7%, limits 3.4 of them away. An exponential sample of
// 48 is skewed: its mean is covered a little less often than a Gaussian one.
TEST(AdaptiveTypes, TileIntervalsOfPilotCover) {
  constexpr int kImages = 120;
  double inside = 0;
  double inside_at_90 = 0;
  for (const core::Granularity granularity :
       {core::Granularity::kPixel, core::Granularity::kTile}) {
    Synthetic s = uneven_noise(AdaptiveType::kPilot);
    s.adaptive.granularity = granularity;
    s.sample = [](Random& r, int x, int) {
      return static_cast<float>((x < 20 ? 0.2 : 1.0) * exponential(r));
    };
    for (int i = 0; i < kImages; ++i) {
      const auto picture = test_support::render(s, 48, static_cast<std::uint64_t>(i) + 1);
      const auto variance = core::layer_image(picture.snapshot, "variance");
      for (int t = 0; t < picture.film->tile_count(); ++t) {
        const core::PixelRect rect = picture.film->tile_rect(t);
        double off = 0;
        double reported = 0;
        for (int y = rect.y; y < rect.y + rect.height; ++y) {
          for (int x = rect.x; x < rect.x + rect.width; ++x) {
            const auto p = static_cast<std::size_t>(y * 64 + x);
            off += static_cast<double>(core::pixel_value(picture.snapshot, p).mean.g) -
                   (x < 20 ? 0.2 : 1.0);
            reported += static_cast<double>(variance->values[3 * p + 1]);
          }
        }
        inside += std::fabs(off) <= 1.959964 * std::sqrt(reported) ? 0.5 / (4 * kImages) : 0;
        inside_at_90 += std::fabs(off) <= 1.644854 * std::sqrt(reported) ? 0.5 / (4 * kImages) : 0;
      }
    }
  }
  std::printf("    tiles covered %.1f %%, at 90 %%: %.1f %%\n", 100 * inside, 100 * inside_at_90);
  EXPECT_GE(inside, 0.926);
  EXPECT_LE(inside, 0.974);
  EXPECT_LT(inside_at_90, 0.926) << "intervals of 90% are detected";
}

}  // namespace
