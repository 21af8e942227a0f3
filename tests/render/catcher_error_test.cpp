// The error of images of a shadow catcher, plain and denoised: that of the image over white.
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "core/error/pixel_error.h"
#include "tests/render/catcher_stage.h"
#include "tests/support/errors.h"

namespace {

using catcher_stage::render;
using catcher_stage::transparent_catcher;
using core::Rgb;
using test_support::Picture;

TEST(Catcher, ErrorIsThatOfTheImageOverWhite) {
  const Picture caught = render(transparent_catcher(), 2, 16);
  core::FilmSnapshot white = caught.snapshot;
  white.errors_over_white = false;  // The image is over white already.
  for (std::size_t i = 0; i < white.pixels.size(); i += 2) {
    if (white.pixels[i].mean_alpha != 0 || white.pixels[i + 1].mean_alpha != 0) {
      for (core::ReplicatePixel& p : std::span(white.pixels).subspan(i, 2)) {
        p.mean_r += 1 - p.mean_alpha;
        p.mean_g += 1 - p.mean_alpha;
        p.mean_b += 1 - p.mean_alpha;
      }
    }
  }
  const core::TileSums seen = caught.film->half_sums(0);
  const core::TileSums expected = core::half_sums(white).front();
  EXPECT_NEAR(seen.grain, expected.grain, 1e-5 * expected.grain);  // the image is added in floats
  EXPECT_NEAR(seen.doubt, expected.doubt, 1e-5 * expected.doubt);
  core::FilmSnapshot colour = caught.snapshot;
  colour.errors_over_white = false;
  EXPECT_NE(seen.grain, core::half_sums(colour).front().grain)
      << "the noise of a shadow is in its alpha";
}

/// The image over white, which its error is about.
std::vector<Rgb> over_white(const core::FilmSnapshot& film) {
  std::vector<Rgb> out;
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const core::HalfValue v = core::pixel_value(film, p);
    out.push_back(v.mean + Rgb(1 - v.alpha));
  }
  return out;
}

/// Empty pixels, in which no sample of the image has met the model or its shadow, leave all means.
/// seen: the same truth for the other pixels; empty: for these.
struct ByPixel {
  test_support::Truth seen;
  test_support::Truth empty;
};
ByPixel by_pixel(const test_support::Truth& truth, const core::FilmSnapshot& film) {
  ByPixel out = {truth, truth};
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const bool is_empty =
        core::is_empty(core::half_value(film, p, 0), core::half_value(film, p, 1));
    (is_empty ? out.seen : out.empty).is_opaque[p] = 0;
  }
  return out;
}

TEST(Catcher, IntervalContainsTheErrorOfTheImage) {
  // Images of 16 samples against one of 1024, whose own error is an eighth of theirs.
  const Picture reference = render(transparent_catcher(), 99, 1024);
  test_support::Truth truth = test_support::truth_of(reference.snapshot);
  truth.mu = over_white(reference.snapshot);
  constexpr int kPictures = 20;
  int inside = 0;
  for (int i = 0; i < kPictures; ++i) {
    const Picture seen = render(transparent_catcher(), static_cast<std::uint64_t>(i), 16);
    const ByPixel truths = by_pixel(truth, seen.snapshot);
    const double error = test_support::defined_error(over_white(seen.snapshot), truths.seen);
    EXPECT_LT(test_support::defined_error(over_white(seen.snapshot), truths.empty), 0.25 * error)
        << "empty pixels are right, up to thin shadows";
    const core::ErrorInterval& e = seen.progress.error;
    inside += e.low <= error && error <= e.high ? 1 : 0;
    EXPECT_LT(e.high, 3 * error) << "the interval is not trivially wide";
  }
  // Of 20 intervals of 95%, fewer than 16 hold with a probability of 3e-3; brackets cover more, and
  // their quantiles have closed forms (tests/unit/core/error_estimate_test.cpp).
  EXPECT_GE(inside, 16);
}

// The planted fault: its alpha is that of the plain image.
TEST(Catcher, ErrorEstimateOfDenoisedLightAndAlphaIsCorrect) {
  constexpr int kTile = 32;
  constexpr int kPictures = 16;
  const auto view_for = [](std::uint64_t seed) {
    core::View view = transparent_catcher();
    view.settings.film.width = kTile;
    view.settings.film.height = kTile;
    view.settings.seed = seed;
    return view;
  };
  const Picture reference = test_support::render(view_for(99), 1024);
  test_support::Truth truth = test_support::truth_of(reference.snapshot);
  truth.mu = over_white(reference.snapshot);
  int inside = 0;
  double estimate = 0;
  double grainy_error = 0;
  double plain = 0;
  double denoised = 0;
  for (int i = 0; i < kPictures; ++i) {
    const Picture seen = test_support::render(view_for(static_cast<std::uint64_t>(i)), 4);
    const auto made =
        core::denoise(seen.snapshot, nullptr, core::StatisticalDenoiser(), core::parallel_for(2));
    ASSERT_TRUE(made);
    const core::DenoisedPicture& picture = made->picture;
    std::vector<Rgb> clean;
    std::vector<Rgb> grainy;
    for (std::size_t p = 0; p < seen.snapshot.pixel_count(); ++p) {
      const float alpha = core::pixel_value(seen.snapshot, p).alpha;
      const Rgb light = {picture.full[0][p], picture.full[1][p], picture.full[2][p]};
      clean.push_back(light + Rgb(1 - picture.full_alpha[p]));
      grainy.push_back(light + Rgb(1 - alpha));
    }
    const core::ErrorInterval e = picture.interval(core::DenoiseMode::kFull, 0.95);
    const test_support::Truth counted = by_pixel(truth, seen.snapshot).seen;
    const double error = test_support::defined_error(clean, counted);
    const double faulty = test_support::defined_error(grainy, counted);
    inside += e.low <= error && error <= e.high ? 1 : 0;
    estimate += e.relative;
    grainy_error += faulty;
    denoised += error;
    plain += test_support::defined_error(over_white(seen.snapshot), counted);
  }
  // Of 16 intervals of 95%: fewer with a probability of 7e-3. In closed form: interval_test.cpp.
  EXPECT_GE(inside, 13);
  // The mean of 16 estimates, which scatter by a tenth, is known to 2.5%: 12% are 4.8 of these.
  EXPECT_NEAR(estimate / denoised, 1, 0.12);
  EXPECT_LT(estimate / grainy_error, 0.88) << "a planted fault: its alpha is not denoised";
  EXPECT_LT(denoised, 0.9 * plain) << "and the image is denoised";
}

}  // namespace
