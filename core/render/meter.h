/// Meter: samples irradiance at points.
///
/// Each point has kMeterReplicates independent randomisations of a Sobol sequence, whatever those
/// of the picture; a sample of the meter is one path of each. The sums of a chunk of points are fed
/// in the order of the samples, so that they are a function of the job and of their number.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "core/integrators/irradiance.h"
#include "core/meter/meter_reading.h"
#include "core/settings/settings.h"

namespace core {

class Meter {
 public:
  /// As IrradianceTracer's.
  explicit Meter(const IntegratorInput& input);
  /// Brings chunk number `chunk` from state.samples to last_sample. False, leaving it half done,
  /// when stop was requested.
  bool render(int chunk, MeterChunk& state, int last_sample, const std::stop_token& stop) const;

 private:
  std::vector<MeterPoint> points_;
  std::uint64_t seed_;
  int first_replicate_;
  IrradianceTracer tracer_;
};

}  // namespace core
