// The error of an image against sums computed by hand.
#include "core/error/error_estimate.h"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

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

std::unique_ptr<Film> film_of(int width, int height, const std::function<Halves(int, int)>& at) {
  core::FilmSettings settings;
  settings.width = width;
  settings.height = height;
  settings.albedo = settings.normal = settings.depth = false;
  auto film = std::make_unique<Film>(settings, 2);
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

double error_of(const std::unique_ptr<Film>& film) {
  return ErrorEstimate(*film).image(0.95).relative_rmse;
}

// A = 1.1, B = 0.9: N of a pixel 3 * 0.01, S 3 * 0.99, F 3 * 0.05^2.
TEST(ErrorEstimate, IsNoiseOverSignalAndFloor) {
  const auto film = film_of(40, 33, [](int, int) { return Halves{1.1F, 0.9F}; });
  EXPECT_NEAR(error_of(film), std::sqrt(0.01 / (0.99 + 0.0025)), 1e-6);
  for (int t = 0; t < film->tile_count(); ++t) {
    EXPECT_NEAR(tile_error_of(*film, t), std::sqrt(0.01 / (0.99 + 0.0025)), 1e-6) << t;
  }
}

// Tiles of 32 and 8 columns: A = 2.2, B = 1.8 and A = 0.02, B = 0. The mean luminance is (32 * 2 +
// 8 * 0.01) / 40 = 1.602, the floor of a pixel and channel 0.0801^2.
TEST(ErrorEstimate, IsTheMeanOverTilesWeightedByTheirPixels) {
  const auto film = film_of(40, 32, [](int x, int) {
    return x < 32 ? Halves{2.2F, 1.8F} : Halves{0.02F, 0};
  });
  const double floor = 0.0801 * 0.0801;
  const double bright = 0.04 / (3.96 + floor);
  const double dark = 0.0001 / floor;
  EXPECT_NEAR(error_of(film), std::sqrt(0.8 * bright + 0.2 * dark), 1e-6);
  EXPECT_NEAR(tile_error_of(*film, 0), std::sqrt(bright), 1e-6);
  EXPECT_NEAR(tile_error_of(*film, 1), std::sqrt(dark), 1e-6);
}

// Half of the image is an empty background, which affects neither the floor nor the weights.
TEST(ErrorEstimate, IgnoresAnEmptyBackground) {
  const auto cut = film_of(32, 32, [](int, int y) {
    return y < 16 ? Halves{1.1F, 0.9F} : Halves{0, 0, 0};
  });
  EXPECT_NEAR(error_of(cut), std::sqrt(0.01 / (0.99 + 0.0025)), 1e-6);
  const auto empty = film_of(32, 32, [](int, int) { return Halves{0, 0, 0}; });
  EXPECT_EQ(error_of(empty), 0);
}

TEST(ErrorEstimate, IsIndependentOfExposure) {
  const auto noisy = [](float scale) {
    return film_of(40, 40, [scale](int x, int y) {
      const float mu = 0.05F * static_cast<float>(x);
      const float off = 0.01F * static_cast<float>((7 * x + 3 * y) % 5);
      return Halves{scale * (mu + off), scale * (mu - off)};
    });
  };
  EXPECT_NEAR(error_of(noisy(64)), error_of(noisy(1)), 1e-6);
  const auto a = ErrorEstimate(*noisy(64)).image(0.95);
  const auto b = ErrorEstimate(*noisy(1)).image(0.95);
  EXPECT_NEAR(a.low, b.low, 1e-6);
  EXPECT_NEAR(a.high, b.high, 1e-6);
}

// One half is black: S is 0, and only the floor remains, 0.05 of the mean luminance 0.5.
TEST(ErrorEstimate, WithoutSignalIsRelativeToTheFloor) {
  const auto film = film_of(32, 32, [](int, int) { return Halves{1, 0}; });
  EXPECT_NEAR(error_of(film), std::sqrt(0.25 / (0.025 * 0.025)), 1e-4);
  const auto opposite = film_of(32, 32, [](int, int) { return Halves{1.5F, -0.5F}; });
  EXPECT_NEAR(error_of(opposite), std::sqrt(1 / (0.025 * 0.025)), 1e-3)
      << "a negative S counts as none";
}

TEST(ErrorEstimate, IsUnknownWithOneHalf) {
  core::FilmSettings settings;
  settings.width = settings.height = 8;
  Film film(settings, 2);
  EXPECT_FALSE(ErrorEstimate(film).valid()) << "no sample";
  core::TileState state = film.tile(0);
  for (std::size_t i = 0; i < state.pixels.size(); i += 2) {
    state.pixels[i] = {1, 1, 1, 1, 0, 1};
  }
  film.commit(0, std::move(state));
  const ErrorEstimate estimate(film);
  EXPECT_FALSE(estimate.valid());
  EXPECT_TRUE(std::isnan(estimate.image(0.95).relative_rmse));
  EXPECT_TRUE(std::isnan(core::tile_error(film, 0)));
  EXPECT_EQ(estimate.bound(0.05), std::numeric_limits<double>::infinity()) << "ends no job";
  EXPECT_TRUE(std::isnan(core::pixel_error(film.snapshot(), 3, 3).standard_error.r));
}

TEST(ErrorEstimate, IsZeroWithoutNoise) {
  const ErrorEstimate estimate(*film_of(64, 64, [](int, int) { return Halves{2, 2}; }));
  const core::ErrorInterval e = estimate.image(0.95);
  EXPECT_EQ(e.relative_rmse, 0);
  EXPECT_EQ(e.high, 0);
  EXPECT_FALSE(e.unreliable);
  EXPECT_EQ(estimate.bound(0.05), 0);
  EXPECT_EQ(estimate.worst_tile_bound(0.05), 0);
}

// 256 pixels of three channels; N is 3 times 1, 2, 3 and 4 in the four quarters: sum 192 * 10, sum
// of squares 9 * 64 * 30. S is 300 per pixel, its variance 4 (N S / n + the sum of squares).
TEST(ErrorEstimate, IntervalIsLogNormalFromTheSumOfSquares) {
  const auto film = film_of(16, 16, [](int x, int y) {
    const auto noise = static_cast<float>(1 + x / 8 + y / 8 * 2);
    const float off = std::sqrt(noise);
    return Halves{std::sqrt(100 + noise) + off, std::sqrt(100 + noise) - off};
  });
  const double squares = 9 * 64 * 30;
  const double light = (std::sqrt(101) + std::sqrt(102) + std::sqrt(103) + std::sqrt(104)) / 4;
  const double scale = 256 * (300 + 3 * std::pow(0.05 * light, 2));
  const double of_noise = squares / std::pow(192 * 10, 2);
  const double of_signal = 4 * (192 * 10 * 300 + squares) / (scale * scale);
  const double deviation = std::sqrt(of_noise + of_signal);
  const core::ErrorInterval e = ErrorEstimate(*film).image(0.95);
  EXPECT_NEAR(e.high / e.relative_rmse, std::exp(0.5 * 1.95996 * deviation), 1e-4);
  EXPECT_NEAR(e.relative_rmse / e.low, std::exp(0.5 * 1.95996 * deviation), 1e-4);
  // The error of this image varies as much as the estimate does: twice the variance.
  EXPECT_NEAR(ErrorEstimate(*film).bound(0.025) / e.relative_rmse,
              std::exp(0.5 * 1.95996 * std::sqrt(2.0) * deviation), 1e-4);
}

// For n pixels with the same noise the relative standard error is about 1 / (2 sqrt(n)).
TEST(ErrorEstimate, IsUnreliableIfFewPixelsDominateIt) {
  const auto lit = [](int few) {
    return film_of(64, 64, [few](int x, int y) {
      const bool is_noisy = x / 8 + y / 8 * 8 < few && x % 8 == 3 && y % 8 == 4;
      return is_noisy ? Halves{2, 0} : Halves{1, 1};
    });
  };
  EXPECT_TRUE(ErrorEstimate(*lit(1)).image(0.95).unreliable);
  EXPECT_TRUE(ErrorEstimate(*lit(3)).image(0.95).unreliable);
  EXPECT_FALSE(ErrorEstimate(*lit(5)).image(0.95).unreliable);
  EXPECT_FALSE(ErrorEstimate(*lit(60)).image(0.95).unreliable);
}

TEST(ErrorEstimate, BoundOfTheWorstTileDividesAlphaAmongTiles) {
  const auto half_noisy = [](float noise) {
    return film_of(64, 32, [noise](int x, int y) {
      const float off = (x < 32 ? 0.01F : noise) * static_cast<float>(1 + (x / 8 + y / 8) % 2);
      return Halves{1 + off, 1 - off};
    });
  };
  const ErrorEstimate estimate(*half_noisy(0.3F));
  EXPECT_GT(estimate.worst_tile_bound(0.05), tile_error_of(*half_noisy(0.3F), 1));
  EXPECT_GT(estimate.worst_tile_bound(0.05), estimate.bound(0.05));
  EXPECT_GT(estimate.worst_tile_bound(0.01), estimate.worst_tile_bound(0.05));
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
  // The layer divides by the root of the window's mean A B, 24 * 0.99 and 0.64, plus the floor.
  const auto plane = core::layer_image(snapshot, "error");
  ASSERT_TRUE(plane);
  const double signal = (24 * 0.99 + 0.64) / 25 + 0.0025;
  EXPECT_NEAR(static_cast<double>(plane->values[9 * 16 + 7]), deviation / std::sqrt(signal), 1e-5);
  EXPECT_NEAR(static_cast<double>(plane->values[0]), 0.1 / std::sqrt(0.9925), 1e-5)
      << "windows end with the film";
}

}  // namespace
