#include "core/film/half_sums.h"

#include <cstddef>
#include <cstring>

namespace core {
namespace {

/// Red, green, blue, alpha. Double, because squares of radiances of 1e20 and more overflow a float.
typedef double Doubles __attribute__((vector_size(32)));
typedef float Floats __attribute__((vector_size(16)));

struct Half {
  Doubles mean;
  std::uint32_t count;
};

/// As half_value() of a pixel, with a shortcut for a single replicate.
inline Half half_of(std::span<const ReplicatePixel> pixel, int half) {
  Floats mean;
  if (pixel.size() == 2) {
    const ReplicatePixel& p = pixel[static_cast<std::size_t>(half)];
    static_assert(offsetof(ReplicatePixel, mean_alpha) == 3 * sizeof(float));
    std::memcpy(&mean, &p.mean_r, sizeof(mean));
    return {__builtin_convertvector(mean, Doubles), p.count};
  }
  const HalfValue v = half_value(pixel, half);
  mean = Floats{v.mean.r, v.mean.g, v.mean.b, v.alpha};
  return {__builtin_convertvector(mean, Doubles), v.count};
}

}  // namespace

TileSums half_sums(const PixelRect& rect, std::span<const ReplicatePixel> pixels, int replicates,
                   bool over_white) {
  TileSums out;
  out.has_halves = !pixels.empty();
  const auto r = static_cast<std::size_t>(replicates);
  const std::size_t count =
      static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  Doubles signal = {};
  Doubles luminance = {};
  for (std::size_t i = 0; i < count && out.has_halves; ++i) {
    const auto pixel = pixels.subspan(i * r, r);
    auto [a, count_a] = half_of(pixel, 0);
    auto [b, count_b] = half_of(pixel, 1);
    if (over_white && a[3] + b[3] > 0) {  // put_over_white()
      constexpr Doubles kWhite = {1, 1, 1, 0};
      a += kWhite * (1 - a[3]);
      b += kWhite * (1 - b[3]);
    }
    out.has_halves = count_a > 0 && count_b > 0;
    const Doubles squares = 0.25 * (a - b) * (a - b);
    const double noise = squares[0] + squares[1] + squares[2];
    out.noise += noise;
    out.noise_squares += noise * noise;
    signal += a * b;
    const Doubles sum = a + b;
    if (sum[3] > 0) {
      luminance += sum;
      ++out.pixels;
    }
  }
  out.signal = signal[0] + signal[1] + signal[2];
  const auto weight = [](Rgb channel) { return static_cast<double>(core::luminance(channel)); };
  out.luminance = 0.5 * (weight({1, 0, 0}) * luminance[0] + weight({0, 1, 0}) * luminance[1] +
                         weight({0, 0, 1}) * luminance[2]);
  return out;
}

}  // namespace core
