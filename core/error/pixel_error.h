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

/// The standard error of each pixel's luminance over the root of its window's mean A B, which the
/// floor of the snapshot's mean luminance is added to. NaN where a half is missing.
std::vector<float> relative_error_plane(const FilmSnapshot& film);

}  // namespace core
