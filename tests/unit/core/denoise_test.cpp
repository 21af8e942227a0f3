// Error estimates of denoised images with a known true value; planted faults of the estimate must
// be detected.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "tests/support/errors.h"
#include "tests/support/statistics.h"

namespace {

using core::ColorPlanes;
using core::DenoiseMode;
using core::FilmSnapshot;
using core::HalfPicture;
using core::Plane;
using test_support::Random;

constexpr int kSide = 64;
constexpr int kSamples = 16;  ///< per half

/// A ramp, an edge and fine stripes, which a filter smooths well, keeps, and damages.
double truth_at(int x, int y) {
  const double ramp = 0.5 + 0.5 * x / kSide;
  const double edge = y > kSide / 2 ? 1.5 : 0.5;
  const double stripes = x > kSide / 2 && y < kSide / 2 ? 0.1 * (x % 4 < 2 ? 1 : -1) : 0;
  return ramp * edge + stripes;
}

/// Both halves of a noisy image of it; noise(x, y): standard deviation of a sample over the truth.
template <typename Noise>
FilmSnapshot noisy_where(const Noise& noise, std::uint64_t seed) {
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  film.pixels.resize(film.pixel_count() * 2);
  Random random(seed);
  for (std::size_t i = 0; i < film.pixels.size(); ++i) {
    const auto pixel = static_cast<int>(i / 2);
    const double mu = truth_at(pixel % kSide, pixel / kSide);
    const double deviation = noise(pixel % kSide, pixel / kSide);
    test_support::Moments moments;
    for (int s = 0; s < kSamples; ++s) {
      moments.add(mu * (1 + deviation * random.normal()));
    }
    const auto v = static_cast<float>(moments.mean);
    film.pixels[i] = {v, v, v, 1, static_cast<float>(moments.m2), kSamples};
  }
  return film;
}

FilmSnapshot noisy(double noise, std::uint64_t seed) {
  return noisy_where([noise](int, int) { return noise; }, seed);
}

/// Against the expected values; images are in the first plane alone, so the others are 0.
double true_error(const ColorPlanes& seen) {
  test_support::Truth truth = {kSide, kSide, {}, {}};
  std::vector<core::Rgb> image;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    truth.mu.emplace_back(
        static_cast<float>(truth_at(static_cast<int>(i) % kSide, static_cast<int>(i) / kSide)));
    truth.is_opaque.push_back(1);
    image.emplace_back(seen[0][i]);
  }
  return test_support::defined_error(image, truth);
}

std::vector<ColorPlanes> filtered(std::span<const HalfPicture> halves) {
  auto out = core::StatisticalDenoiser().denoise(halves, nullptr, core::parallel_for(1));
  EXPECT_TRUE(out);
  return std::move(out->planes);
}

std::array<HalfPicture, 2> halves_of(const FilmSnapshot& film) {
  return {core::half_picture(film, 0), core::half_picture(film, 1)};
}

/// Comparison of estimates over many seeds with the truth.
struct Verdict {
  double ratio = 0;  ///< mean estimated error over the mean true one
  int covered = 0;   ///< intervals that contain the error of their image
};
using MakePicture = std::function<core::DenoisedPicture(const FilmSnapshot&)>;

Verdict judge(double noise, DenoiseMode mode, const MakePicture& make, int seeds) {
  Verdict out;
  double truth = 0;
  double estimate = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const core::DenoisedPicture picture = make(noisy(noise, static_cast<std::uint64_t>(seed)));
    const core::ErrorInterval e = picture.interval(mode, 0.95);
    const double error = true_error(picture.planes(mode));
    truth += error;
    estimate += e.relative;
    out.covered += e.low <= error && error <= e.high ? 1 : 0;
  }
  out.ratio = estimate / truth;
  return out;
}

core::DenoisedPicture honest(const FilmSnapshot& film) {
  return core::denoised_picture(film, halves_of(film), filtered(halves_of(film)));
}

/// Sums m over the halves and the denoised halves, for correct and faulty estimates.
double pooled(const FilmSnapshot& film, const std::vector<ColorPlanes>& clean,
              const std::function<double(double a, double b, double fa, double fb)>& m) {
  double sum = 0;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    sum += m(static_cast<double>(film.pixels[2 * i].mean_r),
             static_cast<double>(film.pixels[2 * i + 1].mean_r),
             static_cast<double>(clean[0][0][i]), static_cast<double>(clean[1][0][i]));
  }
  return sum;
}
double honest_m(double a, double b, double fa, double fb) {
  return 0.5 * ((fa - b) * (fa - b) + (fb - a) * (fb - a) - (a - b) * (a - b)) -
         0.25 * (fa - fb) * (fa - fb);
}
/// Estimated over true squared error of F, mean over seeds, with its standard error.
struct Ratio {
  double value = 0;
  double error = 0;
};
constexpr int kSeeds = 30;
constexpr double kNoise = 0.2;

Ratio ratio_of(const std::function<double(double, double, double, double)>& m,
               const std::function<std::vector<ColorPlanes>(const FilmSnapshot&)>& clean_of) {
  std::vector<double> estimates;
  std::vector<double> truths;
  test_support::Moments truth;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const FilmSnapshot film = noisy(kNoise, seed);
    const std::vector<ColorPlanes> clean = clean_of(film);
    estimates.push_back(pooled(film, clean, m));
    double off = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      const double mu = truth_at(static_cast<int>(i) % kSide, static_cast<int>(i) / kSide);
      const double f =
          0.5 * (static_cast<double>(clean[0][0][i]) + static_cast<double>(clean[1][0][i]));
      off += (f - mu) * (f - mu);
    }
    truths.push_back(off);
    truth.add(off);
  }
  test_support::Moments ratio;
  for (std::size_t k = 0; k < truths.size(); ++k) {
    ratio.add(1 + (estimates[k] - truths[k]) / truth.mean);
  }
  return {ratio.mean, ratio.standard_error()};
}
/// Within 3.3 standard errors of 1: false alarm 0.1%. The standard errors must be small.
void expect_true(const Ratio& ratio) {
  EXPECT_NEAR(ratio.value, 1, 3.3 * ratio.error);
  EXPECT_LT(ratio.error, 0.1);
}
/// Farther from 1 than the test above allows, and by more than 5%.
void expect_false(const Ratio& ratio) {
  EXPECT_GT(std::fabs(ratio.value - 1), std::max(5 * ratio.error, 0.05)) << ratio.value;
}
std::vector<ColorPlanes> honest_filter(const FilmSnapshot& film) {
  return filtered(halves_of(film));
}

TEST(DenoisedError, HasTheSquaredErrorAsItsExpectedValue) {
  expect_true(ratio_of(&honest_m, &honest_filter));
}

TEST(DenoisedError, DetectsAnEstimateFromTheDifferenceOfTheHalvesOnly) {
  const auto quarter = [](double, double, double fa, double fb) {
    return 0.25 * (fa - fb) * (fa - fb);
  };
  expect_false(ratio_of(quarter, &honest_filter));
}

TEST(DenoisedError, DetectsClippingBeforePooling) {
  const auto clipped = [](double a, double b, double fa, double fb) {
    return std::max(honest_m(a, b, fa, fb), 0.0);
  };
  expect_false(ratio_of(clipped, &honest_filter));
}

// Weights of A from the values of B: FA then depends on B's noise.
TEST(DenoisedError, DetectsGuidanceOfOneHalfByTheOther) {
  const auto crossed = [](const FilmSnapshot& film) {
    std::vector<ColorPlanes> out(2);
    for (std::size_t h = 0; h < 2; ++h) {
      for (Plane& plane : out[h]) {
        plane.resize(film.pixel_count());
      }
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const auto value = [&](int px, int py, std::size_t half) {
            return static_cast<double>(
                film.pixels[static_cast<std::size_t>(py * kSide + px) * 2 + half].mean_r);
          };
          double sum = 0;
          double weights = 0;
          for (int py = std::max(y - 3, 0); py < std::min(y + 4, kSide); ++py) {
            for (int px = std::max(x - 3, 0); px < std::min(x + 4, kSide); ++px) {
              // Similar in value to the other half's pixel.
              const double d = (value(px, py, h) - value(x, y, 1 - h)) / 0.1;
              const double w = std::exp(-0.5 * d * d);
              sum += w * value(px, py, h);
              weights += w;
            }
          }
          out[h][0][static_cast<std::size_t>(y * kSide + x)] =
              static_cast<float>(weights > 0 ? sum / weights : value(x, y, h));
        }
      }
    }
    return out;
  };
  expect_false(ratio_of(&honest_m, crossed));
}

// Variances from the difference of the halves carry the noise of B into the denoised A.
TEST(DenoisedError, DetectsVariancesFromBothHalves) {
  const auto leaking = [](const FilmSnapshot& film) {
    std::array<HalfPicture, 2> halves = halves_of(film);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      const double d = static_cast<double>(halves[0].mean[0][i] - halves[1].mean[0][i]);
      // Variance of each half, summed over three channels.
      halves[0].variance[i] = halves[1].variance[i] = static_cast<float>(1.5 * d * d);
    }
    return filtered(halves);
  };
  expect_false(ratio_of(&honest_m, leaking));
}

// Features from both halves carry the noise of B into FA; here the feature is the light itself.
TEST(DenoisedError, DetectsFeaturesPooledWithTheHalves) {
  const auto with_features = [](bool is_pooled) {
    return [is_pooled](const FilmSnapshot& film) {
      // From a separate stream, as noisy as the image.
      const FilmSnapshot other = noisy(kNoise, film.pixels[0].count + 1000);
      core::FeaturePicture features = core::FeaturePicture::blank(kSide, kSide);
      for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        features.depth_m[i] = 1;
        for (Plane& plane : features.albedo) {
          plane[i] = core::pixel_value(is_pooled ? film : other, i).mean.r;
        }
      }
      auto out =
          core::StatisticalDenoiser().denoise(halves_of(film), &features, core::parallel_for(1));
      EXPECT_TRUE(out);
      return std::move(out->planes);
    };
  };
  expect_true(ratio_of(&honest_m, with_features(false)));
  expect_false(ratio_of(&honest_m, with_features(true)));
}

// 60 seeds, two noise levels, two images: of 240 intervals that hold with a probability of 0.95,
// fewer than 213 hold in one of 30,000 cases (binomial). They are brackets, which cover more; that
// they use the quantile of their confidence is tested in closed form (interval_test.cpp).
TEST(DenoisedError, IntervalsCoverAtLeastAtTheirConfidence) {
  int covered = 0;
  for (const double noise : {0.2, 0.8}) {
    for (const DenoiseMode mode : {DenoiseMode::kFull, DenoiseMode::kMixed}) {
      const Verdict verdict = judge(noise, mode, &honest, 60);
      // kMeanOfRoot is that of Gaussian errors; those of a denoiser are concentrated at edges.
      EXPECT_NEAR(verdict.ratio, 1, 0.25) << noise;
      // Of 60, fewer than 51 in 0.07% of cases.
      EXPECT_GE(verdict.covered, 51) << noise;
      covered += verdict.covered;
    }
  }
  std::printf("    %d of 240 covered\n", covered);
  EXPECT_GE(covered, 213);
}

// A firefly in one half, which the denoiser removes, is one wrong pixel, and meets noise that is as
// often negative as positive; one that it has spread over a blot stays.
TEST(DenoisedError, AFireflyCancelsAndABlotDoesNot) {
  const FilmSnapshot clean = noisy(0.05, 1);
  const auto error_of = [](const FilmSnapshot& film, const std::vector<ColorPlanes>& filtered) {
    return core::denoised_picture(film, halves_of(film), filtered)
        .interval(DenoiseMode::kFull, 0.95)
        .relative;
  };
  const std::vector<ColorPlanes> smooth = honest_filter(clean);
  const double before = error_of(clean, smooth);
  FilmSnapshot lit;
  test_support::Moments after;
  for (std::size_t k = 0; k < 16; ++k) {
    lit = clean;
    core::ReplicatePixel& p = lit.pixels[2 * (kSide * 40 + 36 + 7 * (k % 4) + kSide * (k / 4))];
    p.mean_r = p.mean_g = p.mean_b = 1e4F;
    after.add(error_of(lit, smooth));
  }
  EXPECT_NEAR(after.mean, before, 0.1 * before);
  std::vector<ColorPlanes> blotted = smooth;
  for (std::size_t y = 36; y < 44; ++y) {
    for (std::size_t x = 36; x < 44; ++x) {
      for (Plane& plane : blotted[0]) {
        plane[kSide * y + x] += 3;
      }
    }
  }
  EXPECT_GT(error_of(lit, blotted), before + 0.1 * 64.0 / (kSide * kSide));
}

// A weight that minimises the sums by which it is judged makes those sums too small.
TEST(DenoisedError, DetectsWeightsThatIncludeThePixelItself) {
  const auto mixed = [](bool is_own) {
    return [is_own](const FilmSnapshot& film) {
      std::vector<ColorPlanes> clean = honest_filter(film);
      const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), clean);
      for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        const double a = static_cast<double>(film.pixels[2 * i].mean_r);
        const double b = static_cast<double>(film.pixels[2 * i + 1].mean_r);
        const double fa = static_cast<double>(clean[0][0][i]);
        const double fb = static_cast<double>(clean[1][0][i]);
        const double s = 0.25 * (fa + fb - a - b) * (fa + fb - a - b);
        const double v = 0.25 * (a - b) * (a - b);
        const double own = s > 0 ? 0.5 + (honest_m(a, b, fa, fb) - v) / (2 * s) : 0;
        const double w =
            is_own ? std::clamp(own, 0.0, 1.0) : static_cast<double>(picture.weight[i]);
        clean[0][0][i] = static_cast<float>(fa + w * (a - fa));
        clean[1][0][i] = static_cast<float>(fb + w * (b - fb));
      }
      return clean;
    };
  };
  expect_true(ratio_of(&honest_m, mixed(false)));
  expect_false(ratio_of(&honest_m, mixed(true)));
}

// m of the plain image is the square of (A - B) / (A + B).
TEST(DenoisedError, OfThePlainImageIsThePlainError) {
  const FilmSnapshot film = noisy(0.4, 1);
  std::vector<ColorPlanes> plain(2);
  for (std::size_t h = 0; h < 2; ++h) {
    plain[h] = core::half_picture(film, static_cast<int>(h)).mean;
  }
  const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), plain);
  const core::ErrorInterval seen = picture.interval(DenoiseMode::kFull, 0.95);
  const double error = true_error(picture.full);
  EXPECT_NEAR(seen.relative, error, 0.15 * error);
  EXPECT_EQ(seen.doubt, core::ErrorEstimate(picture.plain_tiles, film.errors).image(0.95).doubt);
}

// A denoiser that does nothing but for one firefly in each 8x8 pixels, which was set aside: F - I
// is that firefly, the error is everywhere.
TEST(DenoisedError, OfAnImageWithoutFirefliesIsThatOfItsPixels) {
  const FilmSnapshot calm = noisy(0.4, 1);
  FilmSnapshot film = calm;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    if (i % 8 == 3 && i / kSide % 8 == 4) {
      core::ReplicatePixel& p = film.pixels[2 * i];
      p.mean_r = p.mean_g = p.mean_b = 5 * p.mean_r;
    }
  }
  const std::array<HalfPicture, 2> halves = halves_of(calm);
  const std::vector<ColorPlanes> same = {halves[0].mean, halves[1].mean};
  const core::DenoisedPicture picture = core::denoised_picture(film, halves, same);
  const double error = true_error(picture.full);
  EXPECT_NEAR(picture.interval(DenoiseMode::kFull, 0.95).relative, error, 0.15 * error);
}

// A denoiser that smooths one pixel of each 8x8 and leaves the noise in the others: F - I is on few
// pixels, the error on all.
TEST(DenoisedError, OfAnImageThatIsHardlyDenoisedIsThatOfItsNoise) {
  const FilmSnapshot film = noisy(0.4, 1);
  const std::array<HalfPicture, 2> halves = halves_of(film);
  std::vector<ColorPlanes> hardly = {halves[0].mean, halves[1].mean};
  const std::vector<ColorPlanes> smooth = honest_filter(film);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    for (std::size_t h = 0; h < 2 && i % 8 == 3 && i / kSide % 8 == 4; ++h) {
      for (std::size_t c = 0; c < 3; ++c) {
        hardly[h][c][i] = smooth[h][c][i];
      }
    }
  }
  const core::DenoisedPicture picture = core::denoised_picture(film, halves, hardly);
  const double error = true_error(picture.full);
  EXPECT_NEAR(picture.interval(DenoiseMode::kFull, 0.95).relative, error, 0.15 * error);
}

// Where the denoised image is worse, the plain one is shown, and its error is that of its halves:
// of rare events, m would tell less than that.
TEST(DenoisedPicture, MixedThatIsPlainHasThePlainError) {
  FilmSnapshot film = noisy(0.05, 1);
  for (std::size_t i = 0; i < film.pixels.size(); i += 38) {
    core::ReplicatePixel& p = film.pixels[i + (i / 38) % 2];
    p.mean_r = p.mean_g = p.mean_b = 9;
  }
  std::vector<ColorPlanes> wrong(2);
  for (ColorPlanes& half : wrong) {
    half.fill(Plane(film.pixel_count(), 4.0F));
  }
  const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), wrong);
  ASSERT_TRUE(picture.is_plain);
  const core::ErrorEstimate plain(picture.plain_tiles, film.errors);
  const core::ErrorInterval seen = picture.interval(DenoiseMode::kMixed, 0.95);
  EXPECT_EQ(seen.relative, plain.image(0.95).relative);
  EXPECT_EQ(seen.low, plain.image(0.95).low);
  EXPECT_EQ(seen.high, plain.image(0.95).high);
  const double by_m =
      core::error_of_roots(picture.plain_tiles, picture.mixed_roots, film.errors, 0.95).relative;
  EXPECT_LT(by_m, 0.9 * seen.relative) << "the fault is detected";
  EXPECT_EQ(picture.tile_error(DenoiseMode::kMixed, 3),
            core::ErrorEstimate(std::span(picture.plain_tiles).subspan(3, 1), film.errors)
                .image(0.95)
                .relative);
  EXPECT_FALSE(honest(noisy(0.8, 1)).is_plain);
}

TEST(DenoisedPicture, MixedIsAtMostSlightlyWorseThanTheBetterOne) {
  for (const double noise : {0.05, 0.4, 1.6}) {
    double full = 0;
    double plain = 0;
    double mixed = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const FilmSnapshot film = noisy(noise, seed);
      const core::DenoisedPicture picture = honest(film);
      ColorPlanes mean = picture.full;
      for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        mean[0][i] = core::pixel_value(film, i).mean.r;
      }
      full += true_error(picture.full);
      plain += true_error(mean);
      mixed += true_error(picture.mixed);
    }
    EXPECT_LT(mixed, 1.1 * std::min(full, plain)) << noise;
  }
}

// A denoiser that is right everywhere but in the middle, which it darkens by 0.3. No weight in the
// middle knows: it is judged by the pixels around. There the plain image has 0.1 / sqrt(32) = 0.018
// of noise, 0.014 in the mean; the dark middle, a tenth of the image, is off by 0.03.
TEST(DenoisedPicture, MixedIsPlainIfThatIsBetterAsAWhole) {
  const FilmSnapshot film = noisy(0.1, 1);
  std::vector<ColorPlanes> clean = {core::half_picture(film, 0).mean,
                                    core::half_picture(film, 1).mean};
  ColorPlanes plain = clean[0];
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const int x = static_cast<int>(i) % kSide;
    const int y = static_cast<int>(i) / kSide;
    const bool is_middle = std::abs(x - kSide / 2) < 10 && std::abs(y - kSide / 2) < 10;
    for (std::size_t c = 0; c < 3; ++c) {
      plain[c][i] = 0.5F * (clean[0][c][i] + clean[1][c][i]);
      for (ColorPlanes& half : clean) {
        half[c][i] = static_cast<float>(truth_at(x, y)) * (is_middle ? 0.7F : 1.0F);
      }
    }
  }
  const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), clean);
  EXPECT_GT(true_error(picture.full), 1.5 * true_error(plain));
  EXPECT_LT(true_error(picture.mixed), 1.1 * true_error(plain));
}

/// Both halves of the film, drawn towards the truth by this share where `where` holds.
template <typename Where>
std::vector<ColorPlanes> drawn(const FilmSnapshot& film, double share, const Where& where) {
  std::vector<ColorPlanes> out = {core::half_picture(film, 0).mean,
                                  core::half_picture(film, 1).mean};
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const int x = static_cast<int>(i) % kSide;
    const int y = static_cast<int>(i) / kSide;
    for (ColorPlanes& half : out) {
      for (Plane& plane : half) {
        const auto value = static_cast<double>(plane[i]);
        plane[i] =
            where(x, y) ? static_cast<float>(std::lerp(value, truth_at(x, y), share)) : plane[i];
      }
    }
  }
  return out;
}

// A denoiser that removes 6% of the noise everywhere: all tiles agree on the gain, also where the
// film cuts tiles of 32x32.
TEST(DenoisedPicture, MixedTakesAClearGainOfAFewPerCent) {
  for (const int offset : {0, 24}) {
    FilmSnapshot film = noisy(0.4, 1);
    film.rect.x = film.rect.y = offset;
    const std::vector<ColorPlanes> clean = drawn(film, 0.06, [](int, int) { return true; });
    const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), clean);
    ColorPlanes mean = picture.full;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      mean[0][i] = core::pixel_value(film, i).mean.r;
    }
    EXPECT_NEAR(true_error(picture.mixed), 0.94 * true_error(mean), 0.01 * true_error(mean))
        << offset;
  }
}

// The noise is in one window of 8x8 pixels, of which the denoiser removes all: more than half of
// the error, but one place is no evidence. The standard error of the sum of four tiles' gains, one
// of them not 0, is that one.
TEST(DenoisedPicture, MixedTakesNoDoubtfulGain) {
  const auto is_loud = [](int x, int y) { return x / 8 == 3 && y / 8 == 5; };
  const FilmSnapshot film =
      noisy_where([&](int x, int y) { return is_loud(x, y) ? 2.0 : 0.01; }, 1);
  const core::DenoisedPicture picture =
      core::denoised_picture(film, halves_of(film), drawn(film, 1, is_loud));
  ColorPlanes mean = picture.full;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    mean[0][i] = core::pixel_value(film, i).mean.r;
  }
  EXPECT_LT(true_error(picture.full), 0.8 * true_error(mean));
  EXPECT_EQ(picture.weight, Plane(film.pixel_count(), 1.0F));
}

// The denoiser multiplies everything by 0.9. The window is centred on a part of the ramp without
// stripes, so its mean is the value of its centre.
TEST(DenoisedPicture, DetectsTheBiasOfADarkeningDenoiser) {
  const FilmSnapshot film = noisy(0.2, 1);
  std::vector<ColorPlanes> dark = {core::half_picture(film, 0).mean,
                                   core::half_picture(film, 1).mean};
  for (ColorPlanes& planes : dark) {
    for (Plane& plane : planes) {
      for (float& v : plane) {
        v *= 0.9F;
      }
    }
  }
  const core::DenoisedPicture picture = core::denoised_picture(film, halves_of(film), dark);
  const std::size_t middle = kSide * 48 + 32;
  const double mu = truth_at(32, 48);
  EXPECT_NEAR(static_cast<double>(picture.bias[0][middle]), -0.1 * mu, 0.02 * mu);
  EXPECT_GT(static_cast<double>(picture.bias_error[0][middle]), 0);
  EXPECT_LT(static_cast<double>(picture.bias_error[0][middle]), 0.01 * mu);
}

TEST(StatisticalDenoiser, RemovesNoiseFromSmoothRegions) {
  double before = 0;
  double after = 0;
  const FilmSnapshot film = noisy(0.4, 1);
  const core::DenoisedPicture picture = honest(film);
  for (int y = 8; y < kSide / 2 - 8; ++y) {
    for (int x = 8; x < kSide / 2 - 8; ++x) {
      const auto i = static_cast<std::size_t>(y * kSide + x);
      const double mu = truth_at(x, y);
      before += std::pow(static_cast<double>(core::pixel_value(film, i).mean.r) - mu, 2);
      after += std::pow(static_cast<double>(picture.full[0][i]) - mu, 2);
    }
  }
  EXPECT_LT(after, 0.1 * before);
}

TEST(StatisticalDenoiser, GivesTheSameBitsForAnyNumberOfThreads) {
  FilmSnapshot film = noisy(0.4, 1);
  const std::array halves = halves_of(film);
  std::vector<HalfPicture> wide;  // larger than one tile
  for (const HalfPicture& half : halves) {
    HalfPicture big = half;
    big.width = kSide * 4;
    big.height = kSide * 2;
    const auto repeat = [&](const Plane& plane) {
      Plane out;
      for (int y = 0; y < big.height; ++y) {
        for (int x = 0; x < big.width; ++x) {
          out.push_back(plane[static_cast<std::size_t>(y % kSide * kSide + x % kSide)]);
        }
      }
      return out;
    };
    for (std::size_t c = 0; c < 3; ++c) {
      big.mean[c] = repeat(half.mean[c]);
    }
    big.variance = repeat(half.variance);
    wide.push_back(std::move(big));
  }
  const core::StatisticalDenoiser denoiser;
  const auto one = denoiser.denoise(wide, nullptr, core::parallel_for(1));
  const auto many = denoiser.denoise(wide, nullptr, core::parallel_for(5));
  ASSERT_TRUE(one);
  ASSERT_TRUE(many);
  EXPECT_EQ(one->planes, many->planes);
}

TEST(StatisticalDenoiser, DenoisesAHalfIndependentlyOfTheOther) {
  const std::array first = halves_of(noisy(0.4, 1));
  const std::array second = halves_of(noisy(0.4, 2));
  const std::array other = {first[0], second[1]};
  EXPECT_EQ(filtered(first)[0], filtered(other)[0]);
  EXPECT_NE(filtered(first)[1], filtered(other)[1]);
}

/// A surface with independent noise below a backdrop, whose samples differ by its texture, but
/// whose stratified means have hardly any noise; and its features.
struct BeforeABackdrop {
  static constexpr int kHorizon = 3 * kSide / 4;
  static constexpr double kSurfaceVariance = 0.25;  ///< of a sample
  FilmSnapshot film;
  core::FeaturePicture features = core::FeaturePicture::blank(kSide, kSide);

  static double backdrop_at(int x) { return 1 + 0.5 * x / kSide; }
  static bool is_backdrop(std::size_t pixel) { return pixel / kSide < kHorizon; }

  explicit BeforeABackdrop(std::uint64_t seed) {
    constexpr double kTextureVariance = 0.04;
    constexpr double kStratifiedError = 1e-3;
    constexpr double kFeatureError = 1e-2;
    film.rect = {0, 0, kSide, kSide};
    features.samples = kSamples;
    Random random(seed);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      const double light = backdrop_at(static_cast<int>(i % kSide));
      for (int half = 0; half < 2; ++half) {
        test_support::Moments moments;
        for (int s = 0; s < kSamples; ++s) {
          moments.add(1 + std::sqrt(kSurfaceVariance) * random.normal());
        }
        const auto v = static_cast<float>(
            is_backdrop(i) ? light + kStratifiedError * random.normal() : moments.mean);
        const double m2 = is_backdrop(i) ? (kSamples - 1) * kTextureVariance : moments.m2;
        film.pixels.push_back({v, v, v, 1, static_cast<float>(m2), kSamples});
      }
      for (std::size_t c = 0; c < 3; ++c) {
        features.albedo[c][i] = is_backdrop(i) ? 0 : 0.8F;
        features.emission[c][i] =
            is_backdrop(i) ? static_cast<float>(light + kFeatureError * random.normal()) : 0;
      }
      features.depth_m[i] = is_backdrop(i) ? 0 : 1;
    }
  }

  /// Returns the mean variance of a surface's means, over its true value.
  double surface_variance(const core::FeaturePicture* seen) const {
    const HalfPicture half = core::half_picture(film, 0, core::HalfPart::kLight, {}, seen);
    double sum = 0;
    for (std::size_t i = kHorizon * kSide; i < film.pixel_count(); ++i) {
      sum += static_cast<double>(half.variance[i]) / 3;
    }
    const auto count = static_cast<double>(film.pixel_count() - kHorizon * kSide);
    return sum / count / (kSurfaceVariance / kSamples);
  }
};

TEST(HalfPicture, ABackdropSetsNoScaleForTheNoiseOfSurfaces) {
  const BeforeABackdrop scene(1);
  EXPECT_NEAR(scene.surface_variance(&scene.features), 1, 0.3);
  // Without features it does; behind fog it has noise of its own.
  EXPECT_LT(scene.surface_variance(nullptr), 0.1);
  core::FeaturePicture in_fog = scene.features;
  in_fog.has_fog = true;
  EXPECT_LT(scene.surface_variance(&in_fog), 0.1);
}

TEST(StatisticalDenoiser, DenoisesSurfacesBeforeABackdropAndAveragesIt) {
  const BeforeABackdrop scene(2);
  const auto made = core::denoise(scene.film, &scene.features, core::StatisticalDenoiser(),
                                  core::parallel_for(1));
  ASSERT_TRUE(made);
  double noise = 0;
  double left = 0;
  double apart = 0;
  for (std::size_t i = 0; i < scene.film.pixel_count(); ++i) {
    const float plain =
        0.5F * (scene.film.pixels[2 * i].mean_r + scene.film.pixels[2 * i + 1].mean_r);
    const float full = made->picture.full[0][i];
    if (BeforeABackdrop::is_backdrop(i)) {
      // A half and the features have as many samples.
      const float mean = 0.5F * (plain + scene.features.emission[0][i]);
      apart += static_cast<double>((full - mean) * (full - mean));
    } else {
      noise += (static_cast<double>(plain) - 1) * (static_cast<double>(plain) - 1);
      left += (static_cast<double>(full) - 1) * (static_cast<double>(full) - 1);
    }
  }
  EXPECT_LT(left, 0.1 * noise);
  // Apart from what is set aside; half the features' error would be 5e-3.
  EXPECT_LT(std::sqrt(apart / (BeforeABackdrop::kHorizon * kSide)), 1e-3);
}

// The left is a backdrop, the right a cyan surface, and pixels of the column between show half of
// each. The surface also reflects a little white light, as coats do.
TEST(StatisticalDenoiser, EdgesBeforeABackdropKeepTheColorOfTheSurface) {
  constexpr std::size_t kEdge = kSide / 2;
  constexpr std::array<double, 3> kAlbedo = {0, 0.4, 0.8};
  constexpr double kCoat = 0.05;
  constexpr double kBackdrop = 0.2;
  FilmSnapshot film;
  film.rect = {0, 0, kSide, kSide};
  core::FeaturePicture features = core::FeaturePicture::blank(kSide, kSide);
  features.samples = kSamples;
  Random random(3);
  const auto covered = [](std::size_t pixel) {
    const std::size_t x = pixel % kSide;
    return x < kEdge ? 0.0 : x == kEdge ? 0.5 : 1.0;
  };
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const double share = covered(i);
    for (int half = 0; half < 2; ++half) {
      test_support::Moments light;
      for (int s = 0; s < kSamples; ++s) {
        light.add(1 + 0.5 * random.normal());
      }
      const auto shown = [&](std::size_t c) {
        return static_cast<float>(share * (kAlbedo[c] + kCoat) * light.mean +
                                  (1 - share) * kBackdrop);
      };
      const float y = core::luminance({static_cast<float>(kAlbedo[0] + kCoat),
                                       static_cast<float>(kAlbedo[1] + kCoat),
                                       static_cast<float>(kAlbedo[2] + kCoat)});
      film.pixels.push_back({shown(0), shown(1), shown(2), 1,
                             static_cast<float>(share * share * light.m2) * y * y, kSamples});
    }
    for (std::size_t c = 0; c < 3; ++c) {
      features.albedo[c][i] = static_cast<float>(share * kAlbedo[c]);
      features.emission[c][i] = static_cast<float>((1 - share) * kBackdrop);
    }
    features.normal[0][i] = static_cast<float>(share);
    features.depth_m[i] = static_cast<float>(share);
    // Of samples that meet either.
    const auto variance = static_cast<float>(share * (1 - share) / kSamples);
    features.normal_variance[i] = features.depth_variance[i] = variance;
    features.albedo_variance[i] = features.emission_variance[i] = variance;
  }
  const auto made =
      core::denoise(film, &features, core::StatisticalDenoiser(), core::parallel_for(1));
  ASSERT_TRUE(made);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    if (i % kSide == kEdge) {
      EXPECT_NEAR(made->picture.full[0][i], 0.5 * (kCoat + kBackdrop), 0.05) << i / kSide;
    }
  }
}

// The variance is that of the mean of 16 samples, summed over three channels.
TEST(HalfPicture, EstimatesTheVarianceOfItsMeans) {
  const FilmSnapshot film = noisy(0.4, 1);
  const HalfPicture half = core::half_picture(film, 0);
  double seen = 0;
  double expected = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      seen += static_cast<double>(half.variance[static_cast<std::size_t>(y * kSide + x)]);
      expected += 3 * 0.4 * 0.4 * truth_at(x, y) * truth_at(x, y) / kSamples;
    }
  }
  EXPECT_NEAR(seen / expected, 1, 0.25);
}

}  // namespace
