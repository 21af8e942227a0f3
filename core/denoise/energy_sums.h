/// EnergySums: a tile's squared error where a picture was made of two halves by other means than
/// averaging, and how well that is known.
///
/// A, B: means of the halves; XA = mu + fA what is made of A, a = A - mu, and so on. The pixel's m
/// (core/denoise/denoised_picture.h) is (X - mu)^2 + a b - fA b - fB a, X = (XA + XB) / 2: off by
/// something of mean 0, for B knows nothing of A. With vA, vB the variances of A and B its variance
/// is that of
///   (A - XA)^2 vB + (B - XB)^2 vA - (1 - 2 s^2) vA vB
/// on average, s being the share of the plain picture in X (E a fA = s vA): each product is of two
/// halves that know nothing of each other. vA and vB come from the spread of each half's own
/// samples, so that noise at an edge counts at the edge; over a tile they are scaled to what the
/// halves differ by, which samples of low discrepancy do less than their spread says.
///
/// Where s is 1 this is the variance of the plain picture's error; there the squares of (A - B)^2 /
/// 4 stand in if they are more (core/error/error_estimate.h), because of rare events.
///
/// That is the variance about what this very picture is off by, not about what is expected of such
/// pictures: what a denoiser leaves or smears is alike over many pixels and differs from seed to
/// seed.
#pragma once

#include "core/error/error_estimate.h"

namespace core {

/// Of one pixel, summed over its channels, whose noise goes together.
struct PixelEnergy {
  double energy = 0;    ///< m
  double noise = 0;     ///< (A - B)^2 / 4
  double together = 0;  ///< (XA - XB) (A - B) / 4: over noise, the share s
  double apart_a = 0;   ///< (A - XA)^2
  double apart_b = 0;
  double variance_a = 0;  ///< vA, up to a factor that is the same in a tile
  double variance_b = 0;
};

class EnergySums {
 public:
  void add(const PixelEnergy& pixel);
  TileEnergy result() const;

 private:
  double energy_ = 0;
  double noise_ = 0;
  double noise_squares_ = 0;
  double together_ = 0;
  double apart_ = 0;
  double apart_squares_ = 0;
  double variances_ = 0;
  double product_ = 0;
};

}  // namespace core
