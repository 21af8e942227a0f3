/// medium_sample: where a path scatters within the medium around its segment.
#pragma once

#include "core/media/medium.h"
#include "core/transport/path_state.h"

namespace core {

struct MediumSample {
  const Medium* scatterer = nullptr;  ///< null: the path reaches the end of its segment
  float distance_m = 0;               ///< where it scatters
  Rgb weight = {1, 1, 1};             ///< transmittance, and scattering coefficient, over density
};

/// The same for a path from path.ray.origin along its direction, `distance_m` to the next surface.
/// solid: around the segment; null: it is in none, but in path.fog. Where the coefficients differ
/// by channel, one channel is picked by throughput, its distance is exponential, and the densities
/// of all of them count: no channel's weight grows beyond their number.
/// Source: Wilkie et al., Hero Wavelength Spectral Sampling, 2014, for the weights.
MediumSample sample_medium(const PathState& path, const Medium* solid, float distance_m) noexcept;

}  // namespace core
