/// Errors of single pixels: the variance from the halves, pooled over a window around each.
#pragma once

#include <vector>

#include "core/color/rgb.h"
#include "core/film/film.h"

namespace core {

/// Pixels to each side of a window: 25 squares of one degree of freedom, of which the root has a
/// standard error of 14 %. Wider windows hold noise of other kinds.
inline constexpr int kErrorWindow = 2;

struct PixelError {
  Rgb standard_error;  ///< of the value; NaN where a half is missing
  Rgb low;             ///< 95 % interval
  Rgb high;
};
/// x, y: of the full film, within the snapshot, which holds the window as far as the film does.
PixelError pixel_error(const FilmSnapshot& film, int x, int y);

/// Variance of the mean, per channel: the raw half estimate, which adds up over a block. NaN where
/// a half is missing; never infinite.
Rgb raw_variance(const HalfValue& a, const HalfValue& b);

/// Sum of the luminance of the pixels whose alpha is not 0, and how many they are.
struct Light {
  double sum = 0;
  double pixels = 0;
  void add(const FilmSnapshot& film);
  double mean() const { return pixels > 0 ? sum / pixels : 0; }
};

/// The standard error of each pixel's luminance over the root of its window's mean A B, which the
/// floor of the picture's mean luminance is added to. NaN where a half is missing.
std::vector<float> relative_error_plane(const FilmSnapshot& film);

}  // namespace core
