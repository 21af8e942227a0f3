#include <algorithm>
#include <array>

#include "core/film/film.h"
#include "core/math/numbers.h"

namespace core {

HalfValue half_value(const FilmSnapshot& film, std::size_t pixel, int half) {
  const auto r = static_cast<std::size_t>(film.replicates);
  return half_value(std::span(film.pixels).subspan(pixel * r, r), half);
}

HalfValue pixel_value(const FilmSnapshot& film, std::size_t pixel) {
  const HalfValue a = half_value(film, pixel, 0);
  const HalfValue b = half_value(film, pixel, 1);
  HalfValue out;
  out.count = a.count + b.count;
  if (out.count == 0) {
    return out;
  }
  const float w = b.count == 0 ? 0.0F : a.count == 0 ? 1.0F : 0.5F;
  out.mean = lerp(a.mean, b.mean, w);
  out.alpha = lerp(a.alpha, b.alpha, w);
  return out;
}

SampleVariance sample_variance(const FilmSnapshot& film, std::size_t pixel) {
  const auto r = static_cast<std::size_t>(film.replicates);
  double squares = 0;
  std::array<double, 2> counts{};
  SampleVariance out;
  for (std::size_t k = 0; k < r; ++k) {
    const ReplicatePixel& p = film.pixels[pixel * r + k];
    if (p.count > 0) {
      squares += static_cast<double>(p.m2_luminance);
      counts[k % 2] += static_cast<double>(p.count);
      out.degrees += static_cast<double>(p.count) - 1;
    }
  }
  if (out.degrees > 0) {
    const double of_sample = std::max(squares, 0.0) / out.degrees;
    const bool has_both = counts[0] > 0 && counts[1] > 0;
    out.of_mean = has_both ? 0.25 * of_sample * (1 / counts[0] + 1 / counts[1])
                           : of_sample / (counts[0] + counts[1]);
  }
  return out;
}

}  // namespace core
