/// Films of synthetic noise with errors in closed form.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "core/film/film.h"
#include "tests/support/errors.h"
#include "tests/support/statistics.h"

namespace test_support {

/// Noise of a pixel: draws the mean of one half; gives the variance of the pixel's mean and its
/// expected value.
struct Plan {
  int width = 64;
  int height = 64;
  std::function<double(Random&, int x, int y)> half;  ///< draws the mean of a half
  std::function<double(int x, int y)> mu;
  std::function<double(int x, int y)> variance;  ///< of the mean of both halves
  /// Squared deviations of a half's 128 samples from their mean; if empty, their expected value.
  std::function<double(int x, int y, double mean)> m2 = {};
};

inline core::FilmSnapshot draw(const Plan& plan, std::uint64_t seed) {
  core::FilmSnapshot film;
  film.rect = {0, 0, plan.width, plan.height};
  film.pixels.resize(film.pixel_count() * 2);
  Random random(seed);
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      for (std::size_t r = 0; r < 2; ++r) {
        const auto v = static_cast<float>(plan.half(random, x, y));
        const double m2 =
            plan.m2 ? plan.m2(x, y, static_cast<double>(v)) : 2 * plan.variance(x, y) * 127 * 128;
        film.pixels[static_cast<std::size_t>(y * plan.width + x) * 2 + r] = {
            v, v, v, 1, static_cast<float>(m2), 128};
      }
    }
  }
  return film;
}

inline Truth truth_of(const Plan& plan) {
  Truth out = {plan.width, plan.height, {}, {}};
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      out.mu.emplace_back(static_cast<float>(plan.mu(x, y)));
      out.is_opaque.push_back(1);
    }
  }
  return out;
}

/// Mean over 128 samples of events of the given probability, each worth 1 / probability.
inline double events(Random& random, double probability) {
  const double log_miss = std::log1p(-probability);
  int count = 0;
  for (double at = std::log(1 - random.uniform_double()) / log_miss; at < 128;
       at += 1 + std::floor(std::log(1 - random.uniform_double()) / log_miss)) {
    ++count;
  }
  return count / (128 * probability);
}

}  // namespace test_support
