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

/// Computes F (core/film/half_sums.h) from the parts of an image.
class FloorSum {
 public:
  void add(const FilmSnapshot& film);
  double floor() const { return pixels_ > 0 ? error_floor(roots_ / pixels_) : 0; }

 private:
  double roots_ = 0;
  double pixels_ = 0;
};

/// Returns F of the snapshot's image.
double floor_of(const FilmSnapshot& film);

/// Returns the sums of the snapshot's tiles (tile_rects() of its rect).
std::vector<TileSums> half_sums(const FilmSnapshot& film);

/// Returns the error of each pixel (core/error/error_estimate.h), of its window in place of the
/// image and of its squares: mean of r plus half of sum d r / sum s. NaN if a half is missing.
std::vector<float> relative_error_plane(const FilmSnapshot& film);

}  // namespace core
