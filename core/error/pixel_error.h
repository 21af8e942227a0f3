/// Errors of single pixels: the variance from the halves, pooled over a window around each.
#pragma once

#include <vector>

#include "core/color/rgb.h"
#include "core/film/film.h"

namespace core {

/// Pixels on each side of a window: the root of the mean of 25 squares, each with one degree of
/// freedom, has a standard error of 14%. Wider windows mix different noise.
inline constexpr int kErrorWindow = 2;

struct PixelError {
  Rgb standard_error;  ///< of the value; NaN if a half is missing
  Rgb low;             ///< 95% interval
  Rgb high;
};
/// x, y: in the full film, within the snapshot, which contains the part of the window inside the
/// film.
PixelError pixel_error(const FilmSnapshot& film, int x, int y);

/// Returns the variance of the mean, per channel: the unpooled estimate from the halves, which adds
/// up over a block. NaN if a half is missing; never infinite.
Rgb raw_variance(const HalfValue& a, const HalfValue& b);

/// Sum of the luminance of the pixels whose alpha is not 0, and their number.
struct Light {
  double sum = 0;
  double pixels = 0;
  void add(const FilmSnapshot& film);
  double mean() const { return pixels > 0 ? sum / pixels : 0; }
};

/// Returns the standard error of each pixel's luminance divided by the root of its window's mean
/// A B plus the floor from the image's mean luminance. NaN if a half is missing.
std::vector<float> relative_error_plane(const FilmSnapshot& film);

}  // namespace core
