/// EnergySums: estimates the squared error of a tile of a denoised image, with its variance.
///
/// A, B: means of the halves; XA = mu + fA is computed from A, and a = A - mu; likewise for B. With
/// X = (XA + XB) / 2 a pixel's m (core/denoise/denoised_picture.h) is (X - mu)^2 + a b - fA b - fB
/// a. The last three terms have mean 0, since A and B are independent, and variance
///   E (A - XA)^2 vB + E (B - XB)^2 vA - (1 - 2 s^2) vA vB
/// vA, vB: variances of A and B; s: fraction of the plain image in X, E a fA = s vA. vA and vB come
/// from the sample variance of each half, so that noise at an edge stays at the edge. Over a tile
/// they are scaled to the sum of (A - B)^2, because the sample variance overestimates the variance
/// of low-discrepancy samples.
///
/// At s = 1 this is the sum of vA vB. There twice the sum of the squares of (A - B)^2 / 4 replaces
/// it if it is larger (core/error/error_estimate.h), because of rare events.
///
/// The variance refers to the error of this image, not to the mean error of such images: the
/// residual error of a denoiser is similar over many pixels and differs between seeds.
#pragma once

#include "core/error/error_estimate.h"

namespace core {

/// Terms of one pixel, summed over its channels, whose noise is correlated.
struct PixelEnergy {
  double energy = 0;    ///< m
  double noise = 0;     ///< (A - B)^2 / 4
  double together = 0;  ///< (XA - XB) (A - B) / 4; divided by noise: s
  double apart_a = 0;   ///< (A - XA)^2
  double apart_b = 0;
  double variance_a = 0;  ///< vA, up to a factor common to the tile
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
