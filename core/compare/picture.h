/// Picture: one side of a comparison: pixel values and their variances.
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
  /// (A - B) / 2 of the two halves: its square estimates the variance of the value. Empty: see
  /// is_exact.
  std::vector<Rgb> half_difference;
  /// Variance of the luminance's mean if all samples were independent; the noise differs from it by
  /// a factor that is much the same for neighbours. Empty: unknown.
  std::vector<float> sample_variance;
  /// Of the mean over pixels and channels, from how the replicates' own means differ: right where
  /// the errors of neighbouring pixels are correlated, too. degrees: of freedom, 1 with two
  /// replicates; 0: unknown.
  double mean_variance = 0;
  double mean_degrees = 0;
  /// Variance of the luminance from the rounding of a file's numbers. Empty: none.
  std::vector<float> rounding_variance;
  PixelErrors errors = PixelErrors::kIndependent;
  bool is_exact = false;  ///< a given picture: has no noise but rounding

  std::size_t pixel_count() const noexcept { return values.size(); }
  bool knows_its_error() const noexcept { return is_exact || !half_difference.empty(); }
};

/// The beauty layer over the snapshot's rectangle.
Picture picture_of(const FilmSnapshot& film);

/// A denoised picture, of whose pixels no error is known singly. planes: of width by height.
Picture picture_of(const std::array<std::vector<float>, 3>& planes, int width, int height);

/// A decoded file: 8 and 16 bits are taken as sRGB beside their alpha, floats as linear and
/// multiplied by it, as a film's values are; grey counts for all channels. Errors: kInvalidArgument
/// for values that are not finite.
Result<Picture> picture_of(const Image& image);

}  // namespace core
