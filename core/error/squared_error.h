/// SquaredErrors: pools bounded estimates m of the squared relative error of single pixels.
///
/// For x and y that do not depend on each other's references u and v, and independent u and v with
/// the expected value mu, E (x - u)(y - v) = (E x - mu)(E y - mu). relative_product() is that
/// product relative to the light s of the pixel,
///   sum over channels of s d(x, u) d(y, v) / sum of s,   d(x, u) = (x - u) / s within
///   [-kBound, kBound],
/// which by Cauchy's inequality is at least (sum |x - u| sum |y - v|) / (sum of s)^2 for errors of
/// one sign, and equal to it for errors of the light's colour. s must not depend on u and v: each
/// difference then keeps its expected value, unless it reaches the bound. A firefly in u meets
/// the noise of v, whose mean is 0.
///
/// m may be negative: it is averaged over windows of kEnergyWindow pixels before its root R is
/// taken. Noise would make the mean root of these averages too large, so they are drawn towards the
/// mean of the image, by the share of their variance that is noise. That share is measured by the
/// difference between the two colours of a chessboard within the windows. Source: Efron and Morris
/// 1973 (Stein's estimator). No window is drawn further than its own standard deviation, so that
/// those without noise stay as they are (Efron and Morris 1972, limited translation).
///
/// The mean error of a window is below R where the error is on few of its pixels. It is taken to be
/// spread as unevenly as differences d that consist of that error and of noise: with k = (mean |d|)
/// / (root mean square of d), as R / k on a fraction k^2 of the pixels, which has both moments. Of
/// two differences, such as a bias and a noise, k^2 is the mean weighted by their mean squares. k
/// is kMeanOfRoot for Gaussian errors, and where d is 0.
///
/// The error of an image is relative to the larger of it and mu, which in half of the pixels is mu,
/// 1 + R / k times s. The mean error is thus k^2 (R / k) / (1 + R / (2 k)).
#pragma once

#include <array>

#include "core/error/error_estimate.h"
#include "core/film/summed_area.h"
#include "core/settings/settings.h"

namespace core {

using ColorSum = std::array<double, 3>;

/// Bound of a relative difference. With skewed noise of 1.6 in a half, 1 makes the error of
/// denoised images 40% too large, 2 20%, and `mixed` 25% and 7% worse than the better image.
inline constexpr double kBound = 2;

/// Side of the windows over which m is averaged.
inline constexpr int kEnergyWindow = 8;

/// scale: s, above 0 where x - u is not 0.
double relative_product(const ColorSum& x, const ColorSum& u, const ColorSum& y, const ColorSum& v,
                        const ColorSum& scale);
inline double relative_square(const ColorSum& x, const ColorSum& u, const ColorSum& scale) {
  return relative_product(x, u, x, u, scale);
}

class SquaredErrors {
 public:
  explicit SquaredErrors(const PixelRect& rect);

  /// x, y: from the corner of the rectangle; call with increasing rows and columns. squares: d^2 of
  /// both differences, as relative_square(), or 0. counts: whether the pixel counts (a sample has
  /// seen something).
  void set(int x, int y, double m, std::array<double, 2> squares, bool counts);

  /// Returns the mean error of the window; 0 if no pixel counts or its mean m is negative.
  double error(const PixelRect& window) const;
  /// Returns the errors of the windows (ErrorRoots), their mean m drawn towards that of the image.
  ErrorRoots roots() const;

 private:
  /// Returns k of the window, of which `pixels` count.
  double evenness(const PixelRect& window, double pixels) const;

  PixelRect rect_;
  SummedArea energies_;
  SummedArea chessboard_;            ///< m with the sign of the chessboard's colours
  std::array<SummedArea, 2> sizes_;  ///< |d|
  SummedArea squares_;               ///< d^2 of both
  SummedArea counts_;
};

}  // namespace core
