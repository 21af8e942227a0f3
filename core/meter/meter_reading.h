/// MeterReading: the measurement at one meter point, with its interval.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/color/photometry.h"
#include "core/meter/meter_chunk.h"
#include "core/settings/settings.h"

namespace core {

/// Returns the meter points with unit normals; the cells of the plane follow the points, row by
/// row.
std::vector<MeterPoint> meter_points(const MeterSettings& settings);

/// Confidence level of the intervals.
inline constexpr double kMeterConfidence = 0.95;

/// The measurement of one point, in the scene's units.
struct MeterReading {
  MeterPoint at;
  std::array<double, 3> irradiance{};  ///< linear RGB
  double illuminance = 0;              ///< its luminance: lux
  double low = 0;                      ///< 95% interval of the luminance, by Student's t
  double high = 0;
  /// The interval may miss: one randomisation makes up most of the variance, as where light is
  /// rare, or no path has found light.
  bool unreliable = false;
  std::int64_t samples = 0;  ///< paths
};
/// Returns the readings; none before every point has a sample. chunks: those of the points.
std::vector<MeterReading> meter_readings(const std::vector<MeterPoint>& points,
                                         const std::vector<MeterChunk>& chunks);

}  // namespace core
