// The error of an image against sums computed by hand.
#include "core/error/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "core/error/pixel_error.h"
#include "core/layers/layers.h"

namespace {

using core::ErrorEstimate;
using core::Film;

/// Values of both halves of a grey pixel.
struct Halves {
  float a = 0;
  float b = 0;
  float alpha = 1;
};

std::unique_ptr<Film> film_of(int width, int height, const std::function<Halves(int, int)>& at,
                              core::PixelErrors errors = core::PixelErrors::kIndependent) {
  core::FilmSettings settings;
  settings.width = width;
  settings.height = height;
  settings.albedo = settings.normal = settings.depth = false;
  auto film = std::make_unique<Film>(settings, 2, errors);
  for (int t = 0; t < film->tile_count(); ++t) {
    core::TileState state = film->tile(t);
    state.samples = 2;
    std::size_t i = 0;
    for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
      for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, i += 2) {
        const Halves h = at(x, y);
        state.pixels[i] = {h.a, h.a, h.a, h.alpha, 0, 1};
        state.pixels[i + 1] = {h.b, h.b, h.b, h.alpha, 0, 1};
      }
    }
    film->commit(t, std::move(state));
  }
  return film;
}

double tile_error_of(const Film& film, int tile) {
  return static_cast<double>(core::tile_error(film, tile));
}

core::ErrorInterval error_of(const std::unique_ptr<Film>& film) {
  return ErrorEstimate(*film).image(0.95);
}

/// r of a grey pixel with these halves, and F.
double share(double a, double b, double floor) {
  return std::abs(a - b) / (std::abs(a) + std::abs(b) + 2 * floor);
}

// A = 1.1, B = 0.9: the mean is 1, so F = 0.05. In even noise doubt is r^2.
TEST(ErrorEstimate, IsGrainPlusHalfOfDoubt) {
  const auto film = film_of(40, 33, [](int, int) { return Halves{1.1F, 0.9F}; });
  const double r = 0.2 / 2.1;
  const core::ErrorInterval e = error_of(film);
  EXPECT_NEAR(e.grain, r, 1e-6);
  EXPECT_NEAR(e.doubt, r * r, 1e-6);
  EXPECT_NEAR(e.relative, r + r * r / 2, 1e-6);
  EXPECT_NEAR(e.low, r - 0.5 * r * r - e.reach, 1e-6);
  EXPECT_NEAR(e.high, r + r * r + e.reach, 1e-6);
  EXPECT_FALSE(e.unreliable);
  for (int t = 0; t < film->tile_count(); ++t) {
    EXPECT_NEAR(tile_error_of(*film, t), r + r * r / 2, 1e-6) << t;
  }
}

// Tiles of 32 and 8 columns of means 2 and 0.01: the mean root is (32 sqrt(2) + 8 * 0.1) / 40.
TEST(ErrorEstimate, IsTheMeanOverPixelsRelativeToTheFloorOfTheImage) {
  const auto film = film_of(40, 32, [](int x, int) {
    return x < 32 ? Halves{2.2F, 1.8F} : Halves{0.02F, 0};
  });
  const double floor = 0.05 * std::pow(0.8 * std::sqrt(2.0) + 0.02, 2);
  const double bright = share(2.2, 1.8, floor);
  const double dark = share(0.02, 0, floor);
  const core::ErrorInterval e = error_of(film);
  EXPECT_NEAR(e.grain, 0.8 * bright + 0.2 * dark, 1e-6);
  EXPECT_NEAR(e.doubt, 0.8 * bright * bright + 0.2 * dark * dark, 1e-6);
  EXPECT_NEAR(tile_error_of(*film, 0), bright + bright * bright / 2, 1e-6);
  EXPECT_NEAR(tile_error_of(*film, 1), dark + dark * dark / 2, 1e-6);
}

// Halves of three channels: d = 0.1 + 0.2 + 0, s = 0.3 + 0.6 + 2 + 6 F.
TEST(ErrorEstimate, SumsTheChannelsBeforeItDivides) {
  const core::HalfValue a = {{0.2F, 0.4F, 1}, 1, 1};
  const core::HalfValue b = {{0.1F, 0.2F, 1}, 1, 1};
  const core::PixelShare of = core::share_of_pixel(a, b, 0.01);
  EXPECT_NEAR(of.apart, 0.3, 1e-6);
  EXPECT_NEAR(of.scale, 2.9 + 0.06, 1e-6);
  EXPECT_NEAR(of.share, 0.3 / 2.96, 1e-6);
}

// Half of the image is an empty background, which affects neither the floor nor the weights.
TEST(ErrorEstimate, IgnoresAnEmptyBackground) {
  const auto cut = film_of(32, 32, [](int, int y) {
    return y < 16 ? Halves{1.1F, 0.9F} : Halves{0, 0, 0};
  });
  EXPECT_NEAR(error_of(cut).grain, 0.2 / 2.1, 1e-6);
  const auto empty = film_of(32, 32, [](int, int) { return Halves{0, 0, 0}; });
  EXPECT_EQ(error_of(empty).relative, 0);
}

// The shadow of a catcher has a negative alpha in half of its pixels, by noise; they count like the
// others. Empty is only what no sample has seen.
TEST(ErrorEstimate, CountsPixelsWhoseAlphaIsNegative) {
  const auto film = film_of(32, 32, [](int x, int) {
    return Halves{1.1F, 0.9F, x % 2 == 0 ? 0.01F : -0.01F};
  });
  EXPECT_EQ(film->half_sums(0).pixels, 1024U);
  EXPECT_NEAR(error_of(film).grain, 0.2 / 2.1, 1e-6);
}

// F is read when it is asked for: 1 in one tile, then 4 in it, then 9 in the other one.
TEST(ErrorEstimate, FloorFollowsEveryCommit) {
  const auto film = film_of(64, 32, [](int, int) { return Halves{1, 1}; });
  EXPECT_NEAR(film->error_floor(), 0.05, 1e-9);
  const auto commit = [&](int tile, float value) {
    core::TileState state = film->tile(tile);
    for (core::ReplicatePixel& p : state.pixels) {
      p.mean_r = p.mean_g = p.mean_b = value;
    }
    film->commit(tile, std::move(state));
  };
  commit(0, 4);
  EXPECT_NEAR(film->error_floor(), 0.05 * std::pow((2 + 1) / 2.0, 2), 1e-7);
  commit(1, 9);
  EXPECT_NEAR(film->error_floor(), 0.05 * std::pow((2 + 3) / 2.0, 2), 1e-7);
}

TEST(ErrorEstimate, IsIndependentOfExposure) {
  const auto noisy = [](float scale) {
    return error_of(film_of(40, 40, [scale](int x, int y) {
      const float mu = 0.05F * static_cast<float>(x);
      const float off = 0.01F * static_cast<float>((7 * x + 3 * y) % 5);
      return Halves{scale * (mu + off), scale * (mu - off)};
    }));
  };
  EXPECT_NEAR(noisy(64).relative, noisy(1).relative, 1e-6);
  EXPECT_NEAR(noisy(64).low, noisy(1).low, 1e-6);
  EXPECT_NEAR(noisy(64).high, noisy(1).high, 1e-6);
}

// One half is black: the mean is 0.5, F = 0.05 * 0.5, r = 1 / 1.05, and grain + doubt / 2 above 1.
TEST(ErrorEstimate, IsAtMostOne) {
  const core::ErrorInterval e = error_of(film_of(32, 32, [](int, int) { return Halves{1, 0}; }));
  EXPECT_NEAR(e.grain, 1 / 1.05, 1e-6);
  EXPECT_EQ(e.relative, 1);
  EXPECT_EQ(e.high, 1);
  EXPECT_GE(e.low, 0);
}

// A lamp, or one firefly, of 10,000 times the light: F and the error stay those of the rest.
TEST(ErrorEstimate, OneFireflyIsOneWrongPixel) {
  const auto film_with = [](float firefly) {
    return error_of(film_of(64, 64, [firefly](int x, int y) {
      return x == 9 && y == 50 ? Halves{firefly, 1} : Halves{1.01F, 0.99F};
    }));
  };
  const core::ErrorInterval clean = film_with(1);
  const core::ErrorInterval lit = film_with(10'000);
  EXPECT_LT(lit.grain - clean.grain, 1.0 / 4096 + 0.05 * clean.grain);
  // Its square, one of 16, is in doubt.
  EXPECT_NEAR(lit.doubt, 1.0 / 16, 0.004);
  EXPECT_TRUE(lit.unreliable);
  EXPECT_FALSE(clean.unreliable);
}

TEST(ErrorEstimate, IsUnknownWithOneHalf) {
  core::FilmSettings settings;
  settings.width = settings.height = 8;
  Film film(settings, 2);
  EXPECT_TRUE(std::isnan(ErrorEstimate(film).image(0.95).relative)) << "no sample";
  core::TileState state = film.tile(0);
  for (std::size_t i = 0; i < state.pixels.size(); i += 2) {
    state.pixels[i] = {1, 1, 1, 1, 0, 1};
  }
  film.commit(0, std::move(state));
  const core::ErrorInterval e = ErrorEstimate(film).image(0.95);
  for (const double value : {e.relative, e.low, e.high, e.grain, e.doubt}) {
    EXPECT_TRUE(std::isnan(value));
  }
  EXPECT_TRUE(std::isnan(core::tile_error(film, 0)));
  EXPECT_TRUE(std::isnan(ErrorEstimate(film).worst_tile(0.95))) << "ends no job";
  EXPECT_TRUE(std::isnan(core::pixel_error(film.snapshot(), 3, 3).standard_error.r));
}

TEST(ErrorEstimate, IsZeroWithoutNoise) {
  const auto film = film_of(64, 64, [](int, int) { return Halves{2, 2}; });
  const core::ErrorInterval e = error_of(film);
  EXPECT_EQ(e.relative, 0);
  EXPECT_EQ(e.high, 0);
  EXPECT_FALSE(e.unreliable);
  EXPECT_EQ(ErrorEstimate(*film).worst_tile(0.95), 0);
}

// Of 1,024 pixels every second has r = 0.2 / 2.1: z = 1.96 sqrt(2 * 512 r^2) / 1024.
TEST(ErrorEstimate, ReachOfIndependentPixelsIsFromTheSumOfSquares) {
  const auto film = film_of(32, 32, [](int x, int) {
    return x % 2 == 0 ? Halves{1.1F, 0.9F} : Halves{1, 1};
  });
  const double r = 0.2 / 2.1;
  EXPECT_NEAR(error_of(film).reach, 1.959964 * std::sqrt(2 * 512 * r * r) / 1024, 1e-6);
  EXPECT_NEAR(ErrorEstimate(*film).image(0.5).reach / error_of(film).reach, 0.67449 / 1.959964,
              1e-5);
}

// Two squares of four have r = 0.2 / 2.1, two none: 256 pixels that err in one direction.
TEST(ErrorEstimate, ReachOfCorrelatedPixelsIsFromTheSquares) {
  const auto film = film_of(
      32, 32,
      [](int, int y) {
        return y < 16 ? Halves{1.1F, 0.9F} : Halves{1, 1};
      },
      core::PixelErrors::kCorrelated);
  const double r = 0.2 / 2.1;
  EXPECT_NEAR(error_of(film).reach, 1.959964 * std::sqrt(2 * 2 * std::pow(256 * r, 2)) / 1024,
              1e-6);
}

// The lower half of an image is noisier, by structure; its pixels err in both directions alike.
TEST(ErrorEstimate, ReachOfCorrelatedPixelsDoesNotCountStructure) {
  const auto at = [](int x, int y) {
    const float off = y < 16 ? 0 : (x + y) % 2 == 0 ? 0.1F : -0.1F;
    return Halves{1 + off, 1 - off};
  };
  const auto independent = film_of(32, 32, at);
  const auto correlated = film_of(32, 32, at, core::PixelErrors::kCorrelated);
  EXPECT_NEAR(error_of(correlated).reach, error_of(independent).reach, 1e-6);
}

// Red light that only one half has found, and green light that only the other has: D is r with the
// sign of one of them, not the sum, which is 0.
TEST(ErrorEstimate, OppositeChannelsDoNotCancel) {
  core::HalfValue a;
  core::HalfValue b;
  a.mean = {1.2F, 1, 1};
  b.mean = {1, 1.2F, 1};
  const core::PixelShare share = core::share_of_pixel(a, b, 0.1);
  EXPECT_NEAR(share.share, 0.4 / (6.4 + 0.6), 1e-6);
  EXPECT_EQ(std::fabs(share.difference), share.share);
  EXPECT_EQ(core::share_of_pixel(b, a, 0.1).share, share.share);
}

TEST(ErrorEstimate, WorstTileDividesItsConfidenceAmongTiles) {
  const auto film = film_of(64, 32, [](int x, int y) {
    const float off = (x < 32 ? 0.01F : 0.3F) * static_cast<float>(1 + (x / 8 + y / 8) % 2);
    return Halves{1 + off, 1 - off};
  });
  const ErrorEstimate estimate(*film);
  const auto tiles = film->half_sums();
  const double high =
      ErrorEstimate(std::span(tiles).subspan(1, 1), film->errors()).image(0.975).high;
  EXPECT_NEAR(estimate.worst_tile(0.95), high, 1e-9);
  EXPECT_GT(high, estimate.image(0.95).high);
}

// 1,024 pixels, of which the references give sum of r^2 = 2 and a doubt of 1/8. The mean error is
// 0.08, so R = 0.1; its standard error is 0.001.
TEST(ErrorEstimate, IntervalFromRootsIsInClosedForm) {
  core::TileSums references;
  references.pixels = 1024;
  references.squares = 2;
  references.doubt = 128;
  references.has_halves = true;
  const core::ErrorRoots roots = {{1024 * 0.08}, 0.001};
  for (const auto& [confidence, quantile] :
       {std::pair(0.95, 1.959964), std::pair(0.5, 0.6744898)}) {
    const double reach = quantile * (std::sqrt(2 * 2.0) / 1024 + 0.001);
    const core::ErrorInterval e =
        core::error_of_roots({&references, 1}, roots, core::PixelErrors::kIndependent, confidence);
    EXPECT_NEAR(e.relative, 0.08, 1e-9);
    EXPECT_NEAR(e.reach, reach, 1e-8) << confidence;
    EXPECT_NEAR(e.low, 0.064 * (1 - 0.125) - reach, 1e-8) << confidence;
    EXPECT_NEAR(e.high, 0.1 + 0.125 + reach, 1e-8) << confidence;
  }
}

// 25 pixels with (A - B) / 2 = 0.1, one of them with 0.6: variance (24 * 0.01 + 0.36) / 25.
TEST(PixelError, IsPooledOverAWindow) {
  const auto film = film_of(16, 16, [](int x, int y) {
    const float off = x == 8 && y == 8 ? 0.6F : 0.1F;
    return Halves{1 + off, 1 - off};
  });
  const core::FilmSnapshot snapshot = film->snapshot();
  const core::PixelError at = core::pixel_error(snapshot, 7, 9);
  const double deviation = std::sqrt((24 * 0.01 + 0.36) / 25);
  EXPECT_NEAR(static_cast<double>(at.standard_error.g), deviation, 1e-6);
  const double quantile = 2.0595;  // 97.5% of Student's t with 25 degrees of freedom
  EXPECT_NEAR(static_cast<double>(at.high.g), 1 + quantile * deviation, 1e-4);
  EXPECT_NEAR(static_cast<double>(at.low.g), 1 - quantile * deviation, 1e-4);
  EXPECT_NEAR(static_cast<double>(core::pixel_error(snapshot, 2, 2).standard_error.r), 0.1, 1e-6);
  // The layer: mean of r and half of sum d r / sum s over the window; F of the image.
  const auto plane = core::layer_image(snapshot, "error");
  ASSERT_TRUE(plane);
  const double floor = film->error_floor();
  EXPECT_NEAR(floor, 0.05, 1e-6);
  const double low = share(1.1, 0.9, floor);
  const double high = share(1.6, 0.4, floor);
  const double doubt = (24 * 0.2 * low + 1.2 * high) / (25 * (2 + 2 * floor));
  EXPECT_NEAR(static_cast<double>(plane->values[9 * 16 + 7]), (24 * low + high) / 25 + doubt / 2,
              1e-5);
  EXPECT_NEAR(static_cast<double>(plane->values[0]), low + low * low / 2, 1e-5)
      << "windows end with the film";
}

}  // namespace
