/// Meter: samples irradiance at points.
///
/// Each point has kMeterReplicates independent randomisations of a Sobol sequence, independent of
/// those of the image. One sample of the meter is one path of each. The sums of a chunk of points
/// are updated in the order of samples, so they depend only on the job and on the number of
/// samples.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/film/meter_reading.h"
#include "core/integrators/path/irradiance.h"
#include "core/settings/settings.h"

namespace core {

class Meter {
 public:
  /// input: as for IrradianceTracer.
  explicit Meter(const IntegratorInput& input);
  /// Adds the samples from state.samples to last_sample to a chunk. Returns false, leaving the
  /// chunk incomplete, if stop was requested.
  bool render(int chunk, MeterChunk& state, int last_sample, const std::stop_token& stop) const;

 private:
  std::vector<MeterPoint> points_;  ///< in the file's coordinates
  std::uint64_t seed_;
  int first_replicate_;
  Place origin_;  ///< of the scene
  IrradianceTracer tracer_;
  std::vector<MediumStack> media_;  ///< around each point; empty: the scene has no solids
};

}  // namespace core
