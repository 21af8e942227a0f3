// Error estimates against closed forms (DESIGN section 3): films made of known distributions.
#include "core/film/error_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/planted_film.h"
#include "tests/support/statistics.h"

namespace {

using core::ErrorEstimate;
using core::FilmSnapshot;
using test_support::draw;
using test_support::events;
using test_support::Moments;
using test_support::Plan;
using test_support::Random;
using test_support::true_error;

Plan rare_events(double probability, int size = 64) {
  Plan plan;
  plan.width = plan.height = size;
  plan.half = [probability](Random& r, int, int) { return events(r, probability); };
  plan.mu = [](int, int) { return 1.0; };
  plan.variance = [probability](int, int) { return (1 / probability - 1) / 256; };
  plan.m2 = [probability](int, int, double mean) { return 128 * mean * (1 / probability - mean); };
  return plan;
}

Plan gaussian(double sd, int size = 64) {
  Plan plan;
  plan.width = plan.height = size;
  plan.half = [sd](Random& r, int, int) { return 1 + sd * std::sqrt(2.0) * r.normal(); };
  plan.mu = [](int, int) { return 1.0; };
  plan.variance = [sd](int, int) { return sd * sd; };
  return plan;
}

/// Black left of column `middle`, beyond it as in `bright`.
Plan half_black(Plan bright, int middle = 32) {
  Plan plan = bright;
  plan.half = [=](Random& r, int x, int y) { return x < middle ? 0.0 : bright.half(r, x, y); };
  plan.mu = [=](int x, int y) { return x < middle ? 0.0 : bright.mu(x, y); };
  plan.variance = [=](int x, int y) { return x < middle ? 0.0 : bright.variance(x, y); };
  if (bright.m2) {
    plan.m2 = [=](int x, int y, double mean) { return x < middle ? 0.0 : bright.m2(x, y, mean); };
  }
  return plan;
}

/// What the scene says of lamps of the given radiance that cover share(x, y) of the pixels.
template <class Share>
core::LightEdges edges_of(const Plan& plan, double radiance, const Share& share) {
  core::LightEdges edges;
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      const double p = share(x, y);
      if (p > 0 && p < 1) {
        edges.push_back({static_cast<std::uint32_t>(y * plan.width + x), core::Rgb(static_cast<float>(radiance * p)),
                         static_cast<float>(radiance * radiance * p * (1 - p)), static_cast<float>(p)});
      }
    }
  }
  return edges;
}

/// A lamp of radiance 20 on a wall of 0.3, round, so that each pixel of its rim stands alone. Samples meet the lamp with the
/// probability of the share of the pixel that it covers, independently.
Plan round_lamp(int samples) {
  Plan plan;
  const auto share = [](int x, int y) {
    return std::clamp(12.5 - std::hypot(x - 31.3, y - 32.2), 0.0, 1.0);
  };
  plan.half = [=](Random& r, int x, int y) {
    int met = 0;
    for (int i = 0; i < samples / 2; ++i) {
      met += r.uniform_double() < share(x, y) ? 1 : 0;
    }
    return 0.3 + 19.7 * met / (samples / 2);
  };
  plan.mu = [=](int x, int y) { return 0.3 + 19.7 * share(x, y); };
  plan.variance = [=](int x, int y) { return 19.7 * 19.7 * share(x, y) * (1 - share(x, y)) / samples; };
  plan.m2 = [=](int, int, double mean) {
    const double met = (mean - 0.3) / 19.7;
    // As if there were 128 samples: s^2 / n is that of samples / 2.
    return 19.7 * 19.7 * met * (1 - met) / (samples / 2 - 1) * 127 * 128;
  };
  plan.edges = edges_of(plan, 20, share);
  return plan;
}

struct Outcome {
  double truth = 0;
  Moments estimate;
  double covered = 0;
  double naive = 0;
};

/// sqrt(mean of (A-B)^2/4 / (own mean^2 + 0.01)): what DESIGN forbids.
double naive_error(const FilmSnapshot& film) {
  double sum = 0;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const auto a = static_cast<double>(film.pixels[2 * i].mean_r);
    const auto b = static_cast<double>(film.pixels[2 * i + 1].mean_r);
    sum += (a - b) * (a - b) / 4 / ((a + b) * (a + b) / 4 + 0.01);
  }
  return std::sqrt(sum / static_cast<double>(film.pixel_count()));
}

Outcome measure(const Plan& plan, int trials = 300) {
  Outcome out;
  out.truth = true_error(plan);
  for (int t = 0; t < trials; ++t) {
    const FilmSnapshot film = draw(plan, static_cast<std::uint64_t>(t) + 1);
    const ErrorEstimate estimate(film, plan.edges);
    const auto e = estimate.image(0.95);
    out.estimate.add(e.relative_rmse);
    out.covered += e.low <= out.truth && out.truth <= e.high ? 1.0 / trials : 0.0;
    out.naive += naive_error(film) / trials;
  }
  testing::Test::RecordProperty("truth", std::to_string(out.truth));
  testing::Test::RecordProperty("estimate", std::to_string(out.estimate.mean));
  testing::Test::RecordProperty("coverage", std::to_string(out.covered));
  std::printf("    truth %.4f  estimate %.4f (%+.1f %%, sd %.1f %%)  covered %.1f %%  naive %.4f\n", out.truth,
              out.estimate.mean, 100 * (out.estimate.mean / out.truth - 1),
              100 * std::sqrt(out.estimate.variance()) / out.truth, 100 * out.covered, out.naive);
  return out;
}

// Over 1,500 trials each of these plans covers 93.5 to 97.4 %. Of 300, the standard deviation is 1.26 %: bounds that cover
// 95 % fall below 92 % in 0.9 % of cases; the seeds are fixed.
constexpr double kLeastCoverage = 0.92;

/// Gaussian errors from which the mean over every 2 x 2 pixels is taken: the most that blue noise can do.
FilmSnapshot blue_noise(std::uint64_t seed, double sd, core::PixelErrors errors) {
  constexpr int kSide = 32;
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  film.errors = errors;
  film.pixels.resize(film.pixel_count() * 2);
  Random random(seed);
  const double scale = sd * std::sqrt(2.0) * std::sqrt(4.0 / 3);
  const auto m2 = static_cast<float>(2 * sd * sd * 127 * 128);
  for (int block = 0; block < kSide * kSide / 4; ++block) {
    for (std::size_t r = 0; r < 2; ++r) {
      double noise[4];
      double mean = 0;
      for (double& v : noise) {
        v = random.normal();
        mean += v / 4;
      }
      for (int k = 0; k < 4; ++k) {
        const int x = block % (kSide / 2) * 2 + k % 2;
        const int y = block / (kSide / 2) * 2 + k / 2;
        const auto v = static_cast<float>(1 + scale * (noise[k] - mean));
        film.pixels[static_cast<std::size_t>(y * kSide + x) * 2 + r] = {v, v, v, 1, m2, 128};
      }
    }
  }
  return film;
}

// 2,000 trials: a standard deviation of 0.5 %, of a difference with the same seeds less. The bounds are somewhat wide for
// Gaussian errors, so those taken for independent lose a part of their coverage only.
TEST(ErrorEstimate, OfBlueNoiseIsCoveredWhenItIsToldSo) {
  constexpr int kTrials = 2000;
  const double truth = 0.1 / std::sqrt(1.01);
  const auto covered = [&](core::PixelErrors errors) {
    int count = 0;
    for (int t = 0; t < kTrials; ++t) {
      const auto e = ErrorEstimate(blue_noise(static_cast<std::uint64_t>(t) + 1, 0.1, errors)).image(0.95);
      count += e.low <= truth && truth <= e.high ? 1 : 0;
    }
    std::printf("    covered %.1f %%\n", 100.0 * count / kTrials);
    return count / static_cast<double>(kTrials);
  };
  const double told = covered(core::PixelErrors::kCorrelated);
  EXPECT_GE(told, 0.935);
  EXPECT_LE(told, 0.985);
  EXPECT_LT(covered(core::PixelErrors::kIndependent), told - 0.015) << "the correlation must matter";
}

TEST(ErrorEstimate, EventsOfOneInAThousandAt256Samples) {
  const Outcome o = measure(rare_events(0.001));
  EXPECT_NEAR(o.truth, 1.966, 0.001);
  EXPECT_NEAR(o.estimate.mean, o.truth, 0.1 * o.truth);
  EXPECT_GE(o.covered, kLeastCoverage);
  EXPECT_LT(o.naive, 0.3 * o.truth) << "a pixel's own mean hides its fireflies";
}

TEST(ErrorEstimate, EventsOfOneInAThousandOnALargerFilm) {
  const Outcome o = measure(rare_events(0.001, 160), 100);
  EXPECT_NEAR(o.estimate.mean, o.truth, 0.05 * o.truth);
  EXPECT_GE(o.covered, kLeastCoverage - 0.02);
}

TEST(ErrorEstimate, EventsOfTwoPercent) {
  const Outcome o = measure(rare_events(0.02));
  EXPECT_NEAR(o.estimate.mean, o.truth, 0.1 * o.truth);
  EXPECT_GE(o.covered, kLeastCoverage);
}

TEST(ErrorEstimate, GaussianNoise) {
  for (const double sd : {0.02, 0.2, 1.0}) {
    const Outcome o = measure(gaussian(sd));
    EXPECT_NEAR(o.estimate.mean, o.truth, 0.1 * o.truth) << sd;
    EXPECT_GE(o.covered, kLeastCoverage) << sd;
    EXPECT_LE(o.covered, 0.99) << sd;
  }
}

TEST(ErrorEstimate, HalfBlackHalfBright) {
  for (const Plan& plan : {half_black(gaussian(0.1)), half_black(gaussian(0.5)), half_black(rare_events(0.02)),
                           half_black(rare_events(0.001)), half_black(gaussian(0.5), 37), half_black(rare_events(0.02), 19),
                           half_black(rare_events(0.001), 43)}) {
    const Outcome o = measure(plan);
    EXPECT_NEAR(o.estimate.mean, o.truth, 0.1 * o.truth);
    EXPECT_GE(o.covered, kLeastCoverage);
  }
}

TEST(ErrorEstimate, TheRimOfALampIsNotTakenForFireflies) {
  for (const int samples : {16, 64, 256}) {
    const Outcome o = measure(round_lamp(samples), 100);
    EXPECT_NEAR(o.estimate.mean, o.truth, 0.1 * o.truth) << samples;  // four standard deviations of what is drawn
    EXPECT_GE(o.covered, 0.85) << samples;
  }
}

// Nor can it be told from them where the scene is not at hand: what is said then is on the safe side.
TEST(ErrorEstimate, TheRimOfALampThatNothingIsKnownOfReadsHigh) {
  for (const int samples : {16, 64, 256}) {
    Plan plan = round_lamp(samples);
    plan.edges.clear();
    const Outcome o = measure(plan, 100);
    EXPECT_GE(o.estimate.mean, 1.05 * o.truth) << samples;
    EXPECT_LE(o.estimate.mean, 3 * o.truth) << samples;
  }
}

/// Radiance 500 in 2 x 2 pixels of a lamp, a quarter of each of which it covers, on a wall of 0.2; one lamp in 32 x 32 pixels.
Plan small_lamps(int samples) {
  Plan plan;
  const auto share = [](int x, int y) { return x % 32 / 2 == 7 && y % 32 / 2 == 7 ? 0.25 : 0.0; };
  plan.half = [=](Random& r, int x, int y) {
    int met = 0;
    for (int i = 0; i < samples / 2; ++i) {
      met += r.uniform_double() < share(x, y) ? 1 : 0;
    }
    return 0.2 + 0.01 * r.normal() + 500.0 * met / (samples / 2);
  };
  plan.mu = [=](int x, int y) { return 0.2 + 500 * share(x, y); };
  plan.variance = [=](int x, int y) { return 0.00005 + 500.0 * 500 * share(x, y) * (1 - share(x, y)) / samples; };
  plan.m2 = [=](int, int, double mean) {
    const double met = std::clamp((mean - 0.2) / 500, 0.0, 1.0);
    return (0.0001 * (samples / 2) + 500.0 * 500 * met * (1 - met)) / (samples / 2 - 1) * 127 * 128;
  };
  plan.edges = edges_of(plan, 500.2, share);
  return plan;
}

TEST(ErrorEstimate, ASmallLampIsNotTakenForFireflies) {
  const Plan plan = small_lamps(64);
  const double truth = true_error(plan);
  std::vector<double> estimates;
  for (int t = 0; t < 101; ++t) {
    estimates.push_back(ErrorEstimate(draw(plan, static_cast<std::uint64_t>(t) + 1), plan.edges).image(0.95).relative_rmse);
  }
  std::sort(estimates.begin(), estimates.end());
  std::printf("    truth %.4f  median %.4f  most %.4f\n", truth, estimates[50], estimates.back());
  EXPECT_NEAR(estimates[50], truth, 0.05 * truth);
  EXPECT_LE(estimates[90], 1.15 * truth);
}

/// What a drawn picture is off by itself.
double error_of(const FilmSnapshot& film, const Plan& plan) {
  double sum = 0;
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      const auto i = static_cast<std::size_t>(y * plan.width + x);
      const double mu = plan.mu(x, y);
      const double off = (static_cast<double>(film.pixels[2 * i].mean_r) + static_cast<double>(film.pixels[2 * i + 1].mean_r)) / 2 - mu;
      sum += off * off / (mu * mu + 0.01);
    }
  }
  return std::sqrt(sum / (plan.width * plan.height));
}

// 1,000 pictures each: a standard deviation of 0.7 %. The twin, the bound of the expected error, is exceeded too often.
TEST(ErrorEstimate, APictureIsSeldomOffByMoreThanItsBound) {
  constexpr int kTrials = 1000;
  for (const Plan& plan : {gaussian(0.1, 24), rare_events(0.02, 24), rare_events(0.001, 48)}) {
    int beyond = 0;
    int beyond_expected = 0;
    for (int t = 0; t < kTrials; ++t) {
      const FilmSnapshot film = draw(plan, static_cast<std::uint64_t>(t) + 1);
      const ErrorEstimate estimate(film, plan.edges);
      const double off = error_of(film, plan);
      beyond += off > estimate.most(0.05) ? 1 : 0;
      beyond_expected += off > estimate.image(0.9).high ? 1 : 0;
    }
    std::printf("    beyond: %.1f %%, beyond what is expected %.1f %%\n", 100.0 * beyond / kTrials, 100.0 * beyond_expected / kTrials);
    EXPECT_GE(beyond, 0.02 * kTrials);
    EXPECT_LE(beyond, 0.075 * kTrials);
    EXPECT_GT(beyond_expected, 0.075 * kTrials);
  }
}

TEST(ErrorEstimate, RegionsSayTheSameOfTheirOwnPixels) {
  const Plan plan = half_black(gaussian(0.1));
  Moments dark;
  Moments bright;
  for (int t = 0; t < 50; ++t) {
    const ErrorEstimate estimate(draw(plan, static_cast<std::uint64_t>(t) + 1000));
    dark.add(estimate.region({0, 0, 16, 64}, 0.95).relative_rmse);
    bright.add(estimate.region({48, 0, 16, 64}, 0.95).relative_rmse);
  }
  EXPECT_EQ(dark.mean, 0);
  EXPECT_NEAR(bright.mean, 0.1 / std::sqrt(1.01), 0.003);
}

TEST(ErrorEstimate, TooFewEventsAreCalledUnreliable) {
  int flagged = 0;
  for (int t = 0; t < 20; ++t) {
    flagged += ErrorEstimate(draw(rare_events(3e-6), static_cast<std::uint64_t>(t))).image(0.95).unreliable ? 1 : 0;
  }
  EXPECT_GE(flagged, 15);
  EXPECT_FALSE(ErrorEstimate(draw(gaussian(0.1), 1)).image(0.95).unreliable);
}

// Six pixels that one sample in fifty finds very bright, or as many such events anywhere in the picture: no film tells one from the other, and
// errors are far apart. The interval holds both, and is called unreliable. 200 pictures, of which one in fifty has not met any of the six: less
// than 180 cover with probability 1e-4 where 0.95 do. The twin: what is said of the six is more than twice their error.
TEST(ErrorEstimate, FewBrightPixelsMayBeRimsOrLuck) {
  constexpr double kShare = 0.02 / 4;  // 128 samples of a half here are to meet as much as 32 would
  const auto plan_of = [&](bool anywhere) {
    Plan plan;
    const auto share = [=](int x, int y) { return anywhere ? 6 * kShare / (64 * 64) : (x % 24 == 8 && y % 30 == 10 ? kShare : 0.0); };
    plan.half = [=](Random& r, int x, int y) {
      const double p = share(x, y);
      return 0.1 + 0.005 * r.normal() + (p > 0 ? 100 * p * events(r, p) : 0.0);
    };
    plan.mu = [=](int x, int y) { return 0.1 + 100 * share(x, y); };
    plan.variance = [=](int x, int y) { return 0.005 * 0.005 / 2 + 100 * 100 * share(x, y) * (1 - share(x, y)) / 256; };
    plan.m2 = [](int, int, double mean) { return 128 * (0.005 * 0.005 * 127 + std::max(mean - 0.1, 0.0) * std::max(100.1 - mean, 0.0)); };
    return plan;
  };
  int covers[2] = {};
  int too_much = 0;
  int flagged = 0;
  for (int t = 0; t < 400; ++t) {
    const Plan plan = plan_of(t % 2 == 1);
    const core::ErrorInterval said = ErrorEstimate(draw(plan, static_cast<std::uint64_t>(t) + 1)).image(0.95);
    const double truth = true_error(plan);
    covers[t % 2] += said.low <= truth && truth <= said.high ? 1 : 0;
    too_much += t % 2 == 0 && said.relative_rmse > 2 * truth ? 1 : 0;
    flagged += t % 2 == 0 && said.unreliable ? 1 : 0;
  }
  std::printf("    %d and %d of 200 intervals cover; %d say more than twice, %d are unreliable\n", covers[0], covers[1], too_much, flagged);
  EXPECT_GE(std::min(covers[0], covers[1]), 180);
  EXPECT_GE(too_much, 100);
  EXPECT_GE(flagged, 180);
}

// Four rims that one picture in eight meets carry the error, and of each the scene tells a variance that is wrong by half, one standard
// deviation, as places are few: the interval knows. 200 pictures: less than 180 cover with probability 1e-4 where 0.95 do. The twin, of which
// four times the variance is told, covers seldom.
TEST(ErrorEstimate, WhatTheSceneForetellsOfFewRimsIsKnownBadly) {
  constexpr double kShare = 0.0005;
  const auto is_rim = [](int x, int y) { return x % 32 == 8 && y % 32 == 10; };
  Plan plan;
  plan.half = [&](Random& r, int x, int y) { return 0.1 + 0.001 * r.normal() + (is_rim(x, y) ? 100 * kShare * events(r, kShare) : 0.0); };
  plan.mu = [&](int x, int y) { return is_rim(x, y) ? 0.1 + 100 * kShare : 0.1; };
  plan.variance = [&](int x, int y) { return 0.001 * 0.001 / 2 + (is_rim(x, y) ? 100 * 100 * kShare * (1 - kShare) / 256 : 0.0); };
  const core::LightEdges told = edges_of(plan, 100, [&](int x, int y) { return is_rim(x, y) ? kShare : 0.0; });
  const double truth = true_error(plan);
  int covers[2] = {};
  for (int t = 0; t < 400; ++t) {
    const FilmSnapshot film = draw(plan, static_cast<std::uint64_t>(t) + 1);
    Random random(static_cast<std::uint64_t>(t) + 1000);
    core::LightEdges edges = told;
    for (core::LightEdge& edge : edges) {
      edge.variance *= t % 2 == 0 ? static_cast<float>(std::max(1 + 0.5 * random.normal(), 0.2)) : 4.0F;
    }
    const core::ErrorInterval said = ErrorEstimate(film, edges, {}, true).image(0.95);
    covers[t % 2] += said.low <= truth && truth <= said.high ? 1 : 0;
  }
  std::printf("    %d of 200 intervals cover, %d with four times the variance\n", covers[0], covers[1]);
  EXPECT_GE(covers[0], 180);
  EXPECT_LE(covers[1], 20);
}

// Pixels: pooled standard errors, 95 % intervals, on average over the picture; 50 x 4096 pixels.
TEST(ErrorEstimate, PixelIntervalsCover) {
  for (const Plan& plan : {gaussian(0.1), half_black(gaussian(0.1)), rare_events(0.02)}) {
    double inside = 0;
    double all = 0;
    for (int t = 0; t < 50; ++t) {
      const ErrorEstimate estimate(draw(plan, static_cast<std::uint64_t>(t) + 1));
      for (int y = 0; y < plan.height; ++y) {
        for (int x = 0; x < plan.width; ++x) {
          const auto p = estimate.pixel(x, y);
          const auto mu = static_cast<float>(plan.mu(x, y));
          inside += p.low.g <= mu && mu <= p.high.g ? 1 : 0;
          all += 1;
        }
      }
    }
    std::printf("    pixels covered %.2f %%\n", 100 * inside / all);
    EXPECT_GE(inside / all, 0.90);
    EXPECT_LE(inside / all, 0.99);
  }
}

/// Lanterns: noise is in proportion to the light, which is 20 times that of their surroundings within few pixels. The samples of
/// a half spread as is expected of them.
Plan lanterns() {
  Plan plan;
  plan.mu = [](int x, int y) {
    const double dx = x % 16 - 7.6;
    const double dy = y % 16 - 8.3;
    return 0.05 + std::exp(-(dx * dx + dy * dy) / 4);
  };
  plan.half = [mu = plan.mu](Random& r, int x, int y) { return mu(x, y) * (1 + 0.1 * std::sqrt(2.0) * r.normal()); };
  plan.variance = [mu = plan.mu](int x, int y) { return 0.01 * mu(x, y) * mu(x, y); };
  return plan;
}

/// Share of pixels whose interval holds the truth: those brighter than 0.7, between, and darker than 0.1.
std::array<double, 3> covered_by_brightness(const Plan& plan) {
  std::array<double, 3> inside{};
  std::array<double, 3> all{};
  for (int t = 0; t < 50; ++t) {
    const ErrorEstimate estimate(draw(plan, static_cast<std::uint64_t>(t) + 1));
    for (int y = 0; y < plan.height; ++y) {
      for (int x = 0; x < plan.width; ++x) {
        const double mu = plan.mu(x, y);
        const std::size_t at = mu > 0.7 ? 0 : mu > 0.1 ? 1 : 2;
        const auto p = estimate.pixel(x, y);
        inside[at] += static_cast<double>(p.low.g) <= mu && mu <= static_cast<double>(p.high.g) ? 1 : 0;
        all[at] += 1;
      }
    }
  }
  for (std::size_t k = 0; k < inside.size(); ++k) {
    inside[k] /= all[k];
  }
  std::printf("    pixels covered: bright %.2f %%, between %.2f %%, dark %.2f %%\n", 100 * inside[0], 100 * inside[1],
              100 * inside[2]);
  return inside;
}

// 8,000 bright pixels: a standard deviation of 0.25 %.
TEST(ErrorEstimate, PixelIntervalsCoverInTheMiddleOfALanternAsInTheDark) {
  for (const double covered : covered_by_brightness(lanterns())) {
    EXPECT_GE(covered, 0.92);
    EXPECT_LE(covered, 0.98);
  }
}

// The twin: samples of all pixels spread alike, so that the window alone says how noisy a pixel is.
TEST(ErrorEstimate, TheWindowAloneSaysTooLittleOfTheBrightestPixels) {
  Plan plan = lanterns();
  plan.m2 = [](int, int, double) { return 1.0; };
  EXPECT_LT(covered_by_brightness(plan)[0], 0.915);
}

TEST(ErrorEstimate, OneHalfGivesNoNumber) {
  FilmSnapshot film = draw(gaussian(0.1, 8), 1);
  film.pixels[5].count = 0;
  const ErrorEstimate estimate(film);
  EXPECT_FALSE(estimate.valid());
  EXPECT_TRUE(std::isnan(estimate.image(0.95).relative_rmse));
  EXPECT_TRUE(std::isnan(estimate.pixel(0, 0).standard_error.r));
}

TEST(ErrorEstimate, ANoiselessPictureHasNoError) {
  const ErrorEstimate estimate(draw(gaussian(0), 1));
  EXPECT_EQ(estimate.image(0.95).relative_rmse, 0);
  EXPECT_EQ(estimate.image(0.95).high, 0);
}

}  // namespace
