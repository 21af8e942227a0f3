/// Picture: one side of a comparison, with pixel values and variances.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/film/film.h"
#include "core/image_io/image.h"
#include "core/settings/settings.h"

namespace core {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Rgb> values;  ///< linear, row by row
  /// (A - B) / 2 of the halves; its square estimates the variance of the value. Empty: see
  /// is_exact.
  std::vector<Rgb> half_difference;
  /// Variance of the luminance's mean as if all samples were independent; the actual variance
  /// differs by a factor that is similar for neighbours. Empty: unknown.
  std::vector<float> sample_variance;
  /// Variance of the mean over pixels and channels, from the means of the replicates; also correct
  /// if the errors of neighbouring pixels are correlated. degrees: of freedom, 1 with two
  /// replicates; 0: unknown.
  double mean_variance = 0;
  double mean_degrees = 0;
  /// Variance of the luminance due to rounding in a file. Empty: none.
  std::vector<float> rounding_variance;
  PixelErrors errors = PixelErrors::kIndependent;
  bool is_exact = false;  ///< an image without noise other than rounding

  std::size_t pixel_count() const noexcept { return values.size(); }
  bool knows_its_error() const noexcept { return is_exact || !half_difference.empty(); }
};

/// Returns the beauty layer of the snapshot.
Picture picture_of(const FilmSnapshot& film);

/// Returns a denoised image, whose pixel errors are unknown. planes: width by height each.
Picture picture_of(const std::array<std::vector<float>, 3>& planes, int width, int height);

/// Converts a decoded file: 8 and 16 bits are read as sRGB with straight alpha, floats as linear
/// with premultiplied alpha, like a film's values; grey is used for all channels. Errors:
/// kInvalidArgument for non-finite values.
Result<Picture> picture_of(const Image& image);

}  // namespace core
