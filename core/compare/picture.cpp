#include "core/compare/picture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "core/color/tone_map.h"

namespace core {
namespace {

/// A stored number and its rounding interval; both linear.
struct Stored {
  float value = 0;
  float step = 0;
};

template <typename Word>
Stored encoded(const std::byte* at, float most) {
  Word word = 0;
  std::memcpy(&word, at, sizeof word);
  const auto v = static_cast<float>(word);
  return {linear_from_srgb(v / most),
          linear_from_srgb((v + 0.5F) / most) - linear_from_srgb((v - 0.5F) / most)};
}

float float_at(const std::byte* at) {
  float value = 0;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// Returns whether a float uses only ten bits of mantissa: it was a half float in the file.
bool is_half(float value) { return (std::bit_cast<std::uint32_t>(value) & 0x1fffU) == 0; }

/// Returns the spacing of half floats around a value.
float half_step(float value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  return std::ldexp(1.0F, std::max(exponent - 11, -24));
}

Stored stored_value(const Image& image, std::size_t index, bool halves) {
  switch (image.type) {
    case PixelType::kU8:
      return encoded<std::uint8_t>(image.bytes.data() + index, 255);
    case PixelType::kU16:
      return encoded<std::uint16_t>(image.bytes.data() + 2 * index, 65535);
    case PixelType::kF32:
      break;
  }
  const float value = float_at(image.bytes.data() + 4 * index);
  return {value, halves ? half_step(value) : 0};
}

/// Integer files have straight alpha; films and float files have premultiplied alpha.
float coverage(const Image& image, std::size_t pixel) {
  const auto channels = static_cast<std::size_t>(image.channels);
  if (image.type == PixelType::kF32 || channels % 2 != 0) {
    return 1;
  }
  const std::size_t at = (pixel + 1) * channels - 1;
  if (image.type == PixelType::kU8) {
    return static_cast<float>(image.bytes[at]) / 255;
  }
  std::uint16_t word = 0;
  std::memcpy(&word, image.bytes.data() + 2 * at, sizeof word);
  return static_cast<float>(word) / 65535;
}

bool all_halves(const Image& image) {
  if (image.type != PixelType::kF32) {
    return false;
  }
  for (std::size_t i = 0; i < image.value_count(); ++i) {
    if (!is_half(float_at(image.bytes.data() + 4 * i))) {
      return false;
    }
  }
  return true;
}

/// A pixel's value is a sum of its replicates' means m_k with weights w_k, half their fraction of
/// the counts of their half. With W_k and D_k the means over the image of w_k and w_k (m_k -
/// value), sum_k D_k^2 / (1 - W_k) estimates the variance of the image's mean: unbiased if the
/// replicates have equal variances and weights, and also if variances are proportional to 1 / W_k.
/// Source: MacKinnon, White, Some heteroskedasticity-consistent covariance matrix estimators, 1985
/// (HC2), for a weighted mean.
void measure_replicates(const FilmSnapshot& film, Picture& picture) {
  const auto replicates = static_cast<std::size_t>(film.replicates);
  std::vector<double> weights(replicates);
  std::vector<double> deviations(replicates);
  const std::size_t n = film.pixel_count();
  for (std::size_t i = 0; i < n; ++i) {
    const ReplicatePixel* pixel = &film.pixels[i * replicates];
    std::array<double, 2> counts{};
    for (std::size_t k = 0; k < replicates; ++k) {
      counts[k % 2] += static_cast<double>(pixel[k].count);
    }
    const auto value = static_cast<double>(average(picture.values[i]));
    for (std::size_t k = 0; k < replicates; ++k) {
      if (pixel[k].count > 0) {
        const double weight = 0.5 * static_cast<double>(pixel[k].count) / counts[k % 2];
        weights[k] += weight;
        deviations[k] +=
            weight *
            (static_cast<double>(average(Rgb{pixel[k].mean_r, pixel[k].mean_g, pixel[k].mean_b})) -
             value);
      }
    }
  }
  const auto pixels = static_cast<double>(n);
  double squared_weights = 0;
  for (std::size_t k = 0; k < replicates; ++k) {
    const double weight = weights[k] / pixels;
    squared_weights += weight * weight;
    picture.mean_variance += deviations[k] * deviations[k] / (pixels * pixels * (1 - weight));
  }
  // The effective number of replicates with equal weights, minus one for their mean.
  picture.mean_degrees = std::max(1 / squared_weights - 1, 1.0);
}

}  // namespace

Picture picture_of(const FilmSnapshot& film) {
  Picture picture;
  picture.width = film.rect.width;
  picture.height = film.rect.height;
  picture.errors = film.errors;
  const std::size_t n = film.pixel_count();
  picture.values.resize(n);
  picture.half_difference.resize(n);
  picture.sample_variance.resize(n);
  bool has_halves = true;
  bool has_spread = !film.has_splats;
  for (std::size_t i = 0; i < n; ++i) {
    const HalfValue a = half_value(film, i, 0);
    const HalfValue b = half_value(film, i, 1);
    picture.values[i] = pixel_value(film, i).mean;
    picture.half_difference[i] = (a.mean - b.mean) * 0.5F;
    const SampleVariance spread = sample_variance(film, i);
    picture.sample_variance[i] = static_cast<float>(spread.of_mean);
    has_halves = has_halves && a.count > 0 && b.count > 0;
    has_spread = has_spread && spread.degrees > 0;
  }
  if (has_halves) {
    measure_replicates(film, picture);
  } else {
    picture.half_difference.clear();
  }
  if (!has_spread) {
    picture.sample_variance.clear();
  }
  return picture;
}

Picture picture_of(const std::array<std::vector<float>, 3>& planes, int width, int height) {
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.values.resize(planes[0].size());
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    picture.values[i] = {planes[0][i], planes[1][i], planes[2][i]};
  }
  return picture;
}

Result<Picture> picture_of(const Image& image) {
  Picture picture;
  picture.width = image.width;
  picture.height = image.height;
  picture.is_exact = true;
  const std::size_t n =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  picture.values.resize(n);
  picture.rounding_variance.resize(n);
  const bool halves = all_halves(image);
  const auto stride = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<Stored, 3> rgb;
    for (std::size_t c = 0; c < 3; ++c) {
      rgb[c] = stored_value(image, i * stride + (stride >= 3 ? c : 0), halves);
      // Uniform over a step: variance is its square over 12.
      const float deviation = kLuminance<float>[c] * rgb[c].step;
      picture.rounding_variance[i] += deviation * deviation / 12;
    }
    picture.values[i] = Rgb{rgb[0].value, rgb[1].value, rgb[2].value} * coverage(image, i);
    if (!is_finite(picture.values[i])) {
      return Error{ErrorCode::kInvalidArgument,
                   "the image contains a value that is not finite, at pixel " +
                       std::to_string(i % static_cast<std::size_t>(image.width)) + ", " +
                       std::to_string(i / static_cast<std::size_t>(image.width)),
                   ""};
    }
  }
  return picture;
}

}  // namespace core
