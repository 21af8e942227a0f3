// Denoising with the images before and after of a series: its error, edges that move, and flicker
// in closed form. Planted faults must be detected.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/flicker.h"
#include "core/denoise/statistical.h"
#include "core/error/pixel_error.h"
#include "tests/support/errors.h"
#include "tests/support/statistics.h"

namespace {

using core::ColorPlanes;
using core::FilmSnapshot;
using core::FrameMatch;
using test_support::Random;

constexpr int kSide = 64;
constexpr int kSamples = 16;  ///< per half
constexpr double kNoise = 0.3;
constexpr int kStep = 4;  ///< pixels to the right per frame
constexpr int kEdge = 30;
constexpr int kWide = 14;  ///< of the post, which hides the wall behind it

bool is_post(int x, int frame) {
  const int at = x - kStep * frame;
  return at >= kEdge && at < kEdge + kWide;
}

/// A wall, and a post that moves in front of it.
enum class Stage {
  /// Half of it is smooth; in the other half every point has a light of its own, so that only its
  /// images at other times are like it.
  kTextured,
  kFaint,  ///< they differ by half of the noise of a half, which no test of single pixels detects
};
constexpr double kFaintStep = 0.5 * kNoise / 4;
static_assert(kSamples == 4 * 4);

double texture_at(int x, int y) {
  if (y >= kSide / 2) {
    return 1;
  }
  Random random(static_cast<std::uint64_t>(1000 * (y + 1) + x + 100));
  return 0.5 + random.uniform_double();
}
double truth_at(Stage stage, int x, int y, int frame) {
  const bool post = is_post(x, frame);
  if (stage == Stage::kFaint) {
    return post ? 1 + kFaintStep : 1;
  }
  return post ? texture_at(500 + x - kStep * frame, y) : texture_at(x, y);
}

FilmSnapshot film_at(Stage stage, int frame, std::uint64_t seed) {
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  film.pixels.resize(film.pixel_count() * 2);
  Random random(seed * 1000 + static_cast<std::uint64_t>(frame + 10));
  for (std::size_t i = 0; i < film.pixels.size(); ++i) {
    const auto pixel = static_cast<int>(i / 2);
    test_support::Moments moments;
    for (int s = 0; s < kSamples; ++s) {
      moments.add(truth_at(stage, pixel % kSide, pixel / kSide, frame) *
                  (1 + kNoise * random.normal()));
    }
    const auto v = static_cast<float>(moments.mean);
    film.pixels[i] = {v, v, v, 1, static_cast<float>(moments.m2), kSamples};
  }
  return film;
}

/// Follows wall and post; without rejection, also to where the other hides them.
FrameMatch match(int from, int to, bool rejects) {
  FrameMatch out;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int there = x + (is_post(x, from) ? kStep * (to - from) : 0);
      const bool is_inside = there >= 0 && there < kSide;
      const bool is_seen = is_inside && is_post(there, to) == is_post(x, from);
      out.source.push_back(is_inside && (is_seen || !rejects) ? y * kSide + there : -1);
      out.farther_m.push_back(0);
    }
  }
  return out;
}

/// Frame 0 with those before and after.
struct Series {
  std::vector<FilmSnapshot> films;  ///< frames 0, -1, 1
  std::vector<FrameMatch> matches;  ///< from 0 to -1 and 1
};
Series series(Stage stage, std::uint64_t seed, bool rejects = true) {
  return {{film_at(stage, 0, seed), film_at(stage, -1, seed), film_at(stage, 1, seed)},
          {match(0, -1, rejects), match(0, 1, rejects)}};
}

core::CleanFilm clean_of(const FilmSnapshot& film, const core::FeaturePicture* features,
                         int threads = 1) {
  auto out =
      core::clean_film(film, features, core::StatisticalDenoiser(), core::parallel_for(threads));
  EXPECT_TRUE(out);
  return *std::move(out);
}

/// Frame 0 with its neighbours. own, other: features of it and of them; null: none.
core::DenoisedPicture denoised(const Series& of, const core::FeaturePicture* own = nullptr,
                               const core::FeaturePicture* other = nullptr, int threads = 1) {
  const core::CleanFilm before = clean_of(of.films[1], other, threads);
  const core::CleanFilm after = clean_of(of.films[2], other, threads);
  const std::array<core::CleanNeighbour, 2> frames = {
      core::CleanNeighbour{&before, other, &of.matches[0]},
      core::CleanNeighbour{&after, other, &of.matches[1]}};
  return core::denoised(of.films[0], own,
                        core::mean_in_series(clean_of(of.films[0], own, threads), own, frames))
      .picture;
}
core::DenoisedPicture alone(const Series& of, const core::FeaturePicture* own = nullptr) {
  return core::denoised(of.films[0], own, clean_of(of.films[0], own)).picture;
}

double true_error(const ColorPlanes& seen) {
  test_support::Truth truth = {kSide, kSide, {}, {}};
  std::vector<core::Rgb> image;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    truth.mu.emplace_back(static_cast<float>(
        truth_at(Stage::kTextured, static_cast<int>(i) % kSide, static_cast<int>(i) / kSide, 0)));
    truth.is_opaque.push_back(1);
    image.emplace_back(seen[0][i]);
  }
  return test_support::defined_error(image, truth);
}

/// Halves without fireflies set aside, which would tie them to each other.
core::CleanHalves raw_halves(const FilmSnapshot& film) {
  core::CleanHalves out = {{core::half_picture(film, 0), core::half_picture(film, 1)}, {}};
  auto clean = core::StatisticalDenoiser().denoise(out.plain, nullptr, core::parallel_for(1));
  EXPECT_TRUE(clean);
  out.clean = std::move(clean->planes);
  return out;
}

/// Mean over seeds of (estimated - true) squared error of F, over the mean true one.
test_support::Moments excess(bool crosses_halves) {
  constexpr int kSeeds = 30;
  std::vector<double> estimates;
  std::vector<double> truths;
  double all = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Series of = series(Stage::kTextured, static_cast<std::uint64_t>(seed));
    const FrameMatch still = match(0, 0, true);
    const core::CleanHalves own = raw_halves(of.films[0]);
    std::vector<core::CleanHalves> others;
    for (std::size_t k = 1; k < 3; ++k) {
      others.push_back(crosses_halves ? core::CleanHalves{{own.plain[1], own.plain[0]},
                                                          {own.clean[1], own.clean[0]}}
                                      : raw_halves(of.films[k]));
    }
    std::vector<core::SeriesFrame> frames;
    for (std::size_t k = 0; k < 2; ++k) {
      frames.push_back({&others[k], nullptr, crosses_halves ? &still : &of.matches[k]});
    }
    const std::vector<ColorPlanes> out = core::mean_of_frames(own, nullptr, frames);
    double estimate = 0;
    double truth = 0;
    for (std::size_t i = 0; i < of.films[0].pixel_count(); ++i) {
      const auto a = static_cast<double>(of.films[0].pixels[2 * i].mean_r);
      const auto b = static_cast<double>(of.films[0].pixels[2 * i + 1].mean_r);
      const auto fa = static_cast<double>(out[0][0][i]);
      const auto fb = static_cast<double>(out[1][0][i]);
      const double mu =
          truth_at(Stage::kTextured, static_cast<int>(i) % kSide, static_cast<int>(i) / kSide, 0);
      estimate += (fa - a) * (fb - b) + 0.25 * (fa - fb) * (fa - fb);
      truth += std::pow(0.5 * (fa + fb) - mu, 2);
    }
    estimates.push_back(estimate);
    truths.push_back(truth);
    all += truth / kSeeds;
  }
  test_support::Moments out;
  for (std::size_t k = 0; k < truths.size(); ++k) {
    out.add((estimates[k] - truths[k]) / all);
  }
  return out;
}

// Within 3.3 standard errors: false alarm 0.1%.
TEST(SeriesDenoiser, TheEstimateHasTheSquaredErrorAsItsExpectedValue) {
  const test_support::Moments off = excess(false);
  EXPECT_NEAR(off.mean, 0, 3.3 * off.standard_error());
  EXPECT_LT(off.standard_error(), 0.1);
}

// FA with light of B, as if frames had the same random numbers and their halves another order.
TEST(SeriesDenoiser, DetectsLightOfTheOtherHalf) {
  const test_support::Moments off = excess(true);
  EXPECT_LT(off.mean, -std::max(5 * off.standard_error(), 0.05));
}

// 60 seeds, two images: of 60 intervals that hold with a probability of 0.95, fewer than 51 hold in
// 0.07% of cases.
TEST(SeriesDenoiser, IntervalsCoverAtLeastAtTheirConfidence) {
  constexpr std::array kModes = {core::DenoiseMode::kFull, core::DenoiseMode::kMixed};
  std::array<int, 2> covered{};
  std::array<double, 2> estimate{};
  std::array<double, 2> truth{};
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const core::DenoisedPicture picture = denoised(series(Stage::kTextured, seed));
    for (std::size_t k = 0; k < 2; ++k) {
      const core::ErrorInterval e = picture.interval(kModes[k], 0.95);
      const double error = true_error(picture.planes(kModes[k]));
      covered[k] += e.low <= error && error <= e.high ? 1 : 0;
      estimate[k] += e.relative;
      truth[k] += error;
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    std::printf("    %d of 60 covered, estimate / truth %.2f\n", covered[k],
                estimate[k] / truth[k]);
    EXPECT_GE(covered[k], 51);
    EXPECT_NEAR(estimate[k] / truth[k], 1, 0.25);
  }
}

// A shadow that leaves is no noise: four standard deviations of a pixel, fourteen of a window.
TEST(SeriesDenoiser, LightThatChangesIsLeftAlone) {
  Series of = series(Stage::kFaint, 1);
  for (FrameMatch& each : of.matches) {
    each = match(0, 0, true);
  }
  for (std::size_t k = 1; k < 3; ++k) {
    for (core::ReplicatePixel& p : of.films[k].pixels) {
      p.mean_r = p.mean_g = p.mean_b = p.mean_r + 0.3F;
    }
  }
  EXPECT_EQ(denoised(of).full, alone(of).full);
}

// Three frames of equal noise have a third of its variance; half where the post hides the point in
// one of them.
TEST(SeriesDenoiser, NeighboursHalveTheSquaredError) {
  double without = 0;
  double with = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Series of = series(Stage::kTextured, seed);
    without += std::pow(true_error(alone(of).full), 2);
    with += std::pow(true_error(denoised(of).full), 2);
  }
  std::printf("    %.2f of the squared error\n", with / without);
  EXPECT_LT(with, 0.5 * without);
}

core::FeaturePicture surfaces(float depth_m, float albedo) {
  core::FeaturePicture out = core::FeaturePicture::blank(kSide, kSide);
  for (std::size_t i = 0; i < out.depth_m.size(); ++i) {
    out.depth_m[i] = depth_m;
    out.normal[2][i] = 1;
    for (core::Plane& plane : out.albedo) {
      plane[i] = albedo;
    }
  }
  return out;
}

/// Mean change of F by the neighbours where the post hides the wall before or after. Wall and post
/// differ by their normals, so that within a frame they do not mix.
test_support::Moments ghost(bool rejects) {
  core::FeaturePicture features = surfaces(2, 0.5F);
  for (std::size_t i = 0; i < features.depth_m.size(); ++i) {
    const bool post = is_post(static_cast<int>(i) % kSide, 0);
    features.normal[0][i] = post ? 1 : 0;
    features.normal[2][i] = post ? 0 : 1;
  }
  test_support::Moments out;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Series of = series(Stage::kFaint, seed, rejects);
    // Features of the other frames agree in albedo and depth.
    const core::DenoisedPicture with = denoised(of, &features, &features);
    const core::DenoisedPicture without = alone(of, &features);
    test_support::Moments strip;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        if (!is_post(x, 0) && (is_post(x, -1) || is_post(x, 1))) {
          const auto i = static_cast<std::size_t>(y * kSide + x);
          strip.add(static_cast<double>(with.full[0][i] - without.full[0][i]));
        }
      }
    }
    out.add(strip.mean);
  }
  return out;
}

// A carried pixel of the post would be one of three.
TEST(SeriesDenoiser, AMovingEdgeLeavesNoGhost) {
  const test_support::Moments with = ghost(true);
  std::printf("    %.4f +- %.4f\n", with.mean, with.standard_error());
  EXPECT_NEAR(with.mean, 0, 3.3 * with.standard_error());
}
TEST(SeriesDenoiser, DetectsAGhostWithoutRejection) {
  const test_support::Moments with = ghost(false);
  std::printf("    %.4f +- %.4f\n", with.mean, with.standard_error());
  EXPECT_GT(with.mean, 5 * with.standard_error());
}

// Features of the other image disagree, whatever the match says.
TEST(SeriesDenoiser, TakesNothingFromAnotherDepthOrColour) {
  Series of = series(Stage::kTextured, 1);
  const core::FeaturePicture own = surfaces(2, 0.5F);
  const auto full = [&](const core::FeaturePicture& other) {
    return denoised(of, &own, &other).full;
  };
  const ColorPlanes without = alone(of, &own).full;
  const auto near = [&](const ColorPlanes& image) {
    // Division by the colour and multiplication with it round.
    float most = 0;
    for (std::size_t i = 0; i < without[0].size(); ++i) {
      most = std::max(most, std::fabs(image[0][i] - without[0][i]));
    }
    return most < 1e-5F;
  };
  EXPECT_TRUE(near(full(surfaces(2.5F, 0.5F))));
  EXPECT_TRUE(near(full(surfaces(2, 0.9F))));
  const ColorPlanes with = full(own);
  EXPECT_FALSE(near(with));
  // A match that expects the points to be farther away takes them there.
  for (FrameMatch& match : of.matches) {
    match.farther_m.assign(match.farther_m.size(), 0.5F);
  }
  EXPECT_EQ(full(surfaces(2.5F, 0.5F)), with);
}

TEST(SeriesDenoiser, IsTheSameForAnyNumberOfThreads) {
  const Series of = series(Stage::kTextured, 1);
  EXPECT_EQ(denoised(of, nullptr, nullptr, 3).full, denoised(of).full);
}

/// Frames whose denoised halves have known noise, with the light of the frame.
struct Known {
  double light = 1;
  double noise = 0;   ///< of a denoised half, apart from that of the other frames
  double offset = 0;  ///< of both, which is bias
  std::uint64_t seed = 1;
};
struct KnownFrame {
  FilmSnapshot film;
  core::DenoisedPicture picture;
};
KnownFrame frame_of(const Known& known) {
  KnownFrame out;
  out.film.rect = {0, 0, kSide, kSide};
  out.film.pixels.resize(out.film.pixel_count() * 2);
  for (core::Plane& plane : out.picture.full) {
    plane.resize(out.film.pixel_count());
  }
  out.picture.apart = out.picture.full;
  Random plain(known.seed * 100 + 7);
  Random clean(known.seed);
  for (std::size_t i = 0; i < out.film.pixel_count(); ++i) {
    for (std::size_t h = 0; h < 2; ++h) {
      const auto v = static_cast<float>(known.light + 0.1 * plain.normal());
      out.film.pixels[2 * i + h] = {v, v, v, 1, 0, kSamples};
    }
    const double a = known.light + known.offset + known.noise * clean.normal();
    const double b = known.light + known.offset + known.noise * clean.normal();
    for (std::size_t c = 0; c < 3; ++c) {
      out.picture.full[c][i] = static_cast<float>(0.5 * (a + b));
      out.picture.apart[c][i] = static_cast<float>(0.5 * (a - b));
    }
  }
  return out;
}
FrameMatch in_place() {
  FrameMatch out = {{}, std::vector<float>(kSide * kSide)};
  for (int i = 0; i < kSide * kSide; ++i) {
    out.source.push_back(i);
  }
  return out;
}
/// The mean m times the squared scale of light 1, with its standard error.
test_support::Moments squares(const std::function<Known(int seed)>& now,
                              const std::function<Known(int seed)>& before) {
  test_support::Moments out;
  for (int seed = 1; seed <= 20; ++seed) {
    const KnownFrame a = frame_of(now(seed));
    const KnownFrame b = frame_of(before(seed));
    const core::Flicker f = core::flicker({&a.film, &a.picture}, {&b.film, &b.picture}, in_place());
    EXPECT_EQ(f.pixels, kSide * kSide);
    out.add(f.sum / f.pixels * std::pow(now(seed).light + core::floor_of(a.film), 2));
  }
  return out;
}
Known known(int seed, int frame, double noise, double light = 1, double offset = 0) {
  return {light, noise, offset, static_cast<std::uint64_t>(1000 * frame + seed)};
}

// Each image has half the variance of a half; two frames have twice that. Scales vary by the noise:
// a relative 0.04^2 / 2.
TEST(Flicker, IsTheNoiseOfBothFrames) {
  const auto m =
      squares([](int s) { return known(s, 1, 0.04); }, [](int s) { return known(s, 2, 0.04); });
  EXPECT_NEAR(m.mean, 0.04 * 0.04, 3.3 * m.standard_error() + 3 * std::pow(0.04, 4));
  EXPECT_LT(m.standard_error(), 0.0002);
}

TEST(Flicker, IsNotTheNoiseThatBothFramesShare) {
  const auto m = squares([](int s) { return known(s, 1, 0.04); },
                         [](int s) {
                           return Known{1, 0.04, 0, static_cast<std::uint64_t>(1000 + s)};
                         });
  EXPECT_NEAR(m.mean, 0, 3.3 * m.standard_error() + 1e-12);
}

TEST(Flicker, IsNotTheChangeOfTheLight) {
  const auto m = squares([](int s) { return known(s, 1, 0.04); },
                         [](int s) { return known(s, 2, 0.04, 1.3); });
  EXPECT_NEAR(m.mean, 0.04 * 0.04, 3.3 * m.standard_error() + 3 * std::pow(0.04, 4));
}

// The light that m is relative to includes the bias: 10% for 0.05.
TEST(Flicker, IsTheChangeOfTheBias) {
  const auto m = squares([](int s) { return known(s, 1, 0, 1, 0.05); },
                         [](int s) { return known(s, 2, 0, 1, -0.03); });
  EXPECT_NEAR(m.mean, 0.08 * 0.08, 3.3 * m.standard_error() + 0.08 * 0.08 * 0.1);
}

TEST(Flicker, IsTheChangeOfTheBiasAlsoWhereTheLightChanges) {
  const auto m = squares([](int s) { return known(s, 1, 0, 1, 0.05); },
                         [](int s) { return known(s, 2, 0, 1.3, -0.03); });
  EXPECT_NEAR(m.mean, 0.08 * 0.08, 3.3 * m.standard_error() + 0.08 * 0.08 * 0.1);
}

// Of 100 intervals at 95%, fewer than 87 hold in 0.15% of cases.
TEST(Flicker, ItsIntervalCoversAtItsConfidence) {
  int covered = 0;
  for (int seed = 1; seed <= 100; ++seed) {
    const KnownFrame a = frame_of(known(seed, 1, 0.05));
    const KnownFrame b = frame_of(known(seed, 2, 0.05));
    const auto e = core::interval(
        core::flicker({&a.film, &a.picture}, {&b.film, &b.picture}, in_place()), 0.95);
    ASSERT_TRUE(e);
    // The light of F varies by 0.05 / sqrt(2), which makes m greater by 3 * 0.05^2.
    const double truth = 0.05 / (1 + core::floor_of(a.film));
    covered += e->low <= truth && truth <= e->high ? 1 : 0;
  }
  std::printf("    %d of 100 covered\n", covered);
  EXPECT_GE(covered, 87);
}

TEST(Flicker, IsUnknownWithoutCommonSurfaces) { EXPECT_FALSE(core::interval({}, 0.95)); }

}  // namespace
