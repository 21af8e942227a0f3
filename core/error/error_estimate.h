/// ErrorEstimate: how far the average pixel of an image is off, estimated from its two halves.
///
/// The error of an image I against the truth mu is the mean over its pixels of
///   sum over channels of |I - mu|  /  sum over channels of max(I, mu) + F,
/// F as in core/film/half_sums.h: 0 to 1, independent of the exposure; a firefly is one wrong pixel
/// and no more. It is estimated by
///   grain = mean over pixels of r,   doubt = mean over squares of (sum of d r) / (sum of s)
///   error = grain + doubt / 2
///   low = grain - max(grain, 1/2) doubt - z,   high = grain + doubt + z,
///   z = q sqrt(2 sum of r^2) / pixels
/// with q the normal quantile. For independent halves E|A - B| / 2 <= E|I - mu| <= E|A - B|
/// (symmetrisation, Ledoux and Talagrand 1991, 6.1), so the halves understate the error at most by
/// a factor of two if they are pooled before they are bounded, and doubt is that pooled part. The
/// bound is proven for sums; for the quotients it is measured (tests/bench/run --coverage).
///
/// For Gaussian noise of relative variance s^2 << 1 in the image, doubt is s^2 and the error is
/// grain - s^2 / 2, because max(I, mu) is above mu in half of the pixels: hence the 1/2.
///
/// z is the noise of both estimate and error. If errors of neighbouring pixels are correlated, the
/// sum over squares of (sum of D)^2 takes the place of that of r^2 where it is larger: its mean is
/// the same for independent pixels, and it is (sum of r)^2 where a whole square errs in one
/// direction.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/film/film.h"
#include "core/film/half_sums.h"

namespace core {

/// How an error is estimated.
enum class ErrorForm : std::int32_t {
  kHalves,  ///< from the difference of the halves, as above
  kSquares  ///< from squares against independent images (error_of_roots())
};

struct ErrorInterval {
  double relative = 0;  ///< the error, 0 to 1; NaN if a half is missing, as all others
  double low = 0;       ///< interval of the error of this image
  double high = 0;
  double grain = 0;
  double doubt = 0;
  double reach = 0;         ///< z
  bool unreliable = false;  ///< more light is in doubt than is visible as grain
  ErrorForm form = ErrorForm::kHalves;
};

ErrorInterval unknown_error();
/// Ratio of mean and root mean square of Gaussian errors: sqrt(2 / pi).
inline constexpr double kMeanOfRoot = 0.8;

/// Returns the error from its parts. kSquares: with R = grain / 0.8
///   error = 0.8 R,   low = 0.64 R (1 - doubt) - z,   high = R + doubt + z.
/// 0.8 is kMeanOfRoot: R is the root mean square of Gaussian errors with this mean, which errors
/// that are all alike reach (Jensen). 0.64 is its square: edges concentrate errors once more
/// (measured by tests/bench/run --coverage).
ErrorInterval error_interval(double grain, double doubt, double reach,
                             ErrorForm form = ErrorForm::kHalves);

/// Errors from the roots of m over the windows of an image (core/error/squared_error.h).
struct ErrorRoots {
  /// Per tile: sum over its windows of n times their mean error, n the window's counted pixels.
  std::vector<double> tiles;
  double deviation = 0;  ///< standard error of the mean error, by the noise in the windows
};

/// Returns an error of form kSquares. references: sums of the independent images that m was
/// measured with. grain is the mean of the errors; z is that of the references, plus q deviation.
ErrorInterval error_of_roots(std::span<const TileSums> references, const ErrorRoots& roots,
                             PixelErrors errors, double confidence);

/// Returns the error of one tile; NaN if a half is missing.
float tile_error(const Film& film, int tile);

class ErrorEstimate {
 public:
  /// tiles: of the whole image.
  ErrorEstimate(std::span<const TileSums> tiles, PixelErrors errors);
  explicit ErrorEstimate(const Film& film) : ErrorEstimate(film.half_sums(), film.errors()) {}
  /// Of form kSquares; arguments as of error_of_roots().
  ErrorEstimate(std::span<const TileSums> references, ErrorRoots roots, PixelErrors errors);

  ErrorInterval image(double confidence) const;
  /// Returns the largest upper end of any tile, with 1 - confidence divided among them.
  double worst_tile(double confidence) const;

 private:
  std::vector<TileSums> tiles_;
  std::optional<ErrorRoots> roots_;
  PixelErrors errors_;
};

}  // namespace core
