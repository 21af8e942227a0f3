#include "core/denoise/energy_sums.h"

#include <algorithm>

namespace core {

void EnergySums::add(const PixelEnergy& pixel) {
  energy_ += pixel.energy;
  noise_ += pixel.noise;
  noise_squares_ += pixel.noise * pixel.noise;
  together_ += pixel.together;
  const double apart = pixel.apart_a * pixel.variance_b + pixel.apart_b * pixel.variance_a;
  apart_ += apart;
  apart_squares_ += apart * apart;
  variances_ += pixel.variance_a + pixel.variance_b;
  product_ += pixel.variance_a * pixel.variance_b;
}

TileEnergy EnergySums::result() const {
  const double share = noise_ > 0 ? std::clamp(together_ / noise_, 0.0, 1.0) : 0;
  const double scale = variances_ > 0 ? 4 * noise_ / variances_ : 0;
  const double product = scale * scale * product_;
  // Makes the variance at s = 1 the larger of product and 2 noise_squares_: the estimate and the
  // estimated quantity have the same variance and are independent (ErrorEstimate::bound()).
  const double rare = std::max(noise_squares_ - 0.5 * product, 0.0);
  // If few pixels carry most of the variance, it is poorly known: widen it to that of Student's t
  // with their number as degrees of freedom. t has a variance from three degrees of freedom on.
  const double degrees = apart_squares_ > 0 ? std::max(apart_ * apart_ / apart_squares_, 3.0) : 3;
  TileEnergy out;
  out.energy = energy_;
  out.variance =
      std::max(scale * apart_ - (1 - 2 * share * share) * product, 0.0) * degrees / (degrees - 2) +
      2 * share * share * share * share * rare;
  return out;
}

}  // namespace core
