/// MeterReading: the measurement at one meter point, with its interval.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/color/photometry.h"
#include "core/film/meter_chunk.h"
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
  double low = 0;                      ///< 95% interval of the luminance
  double high = 0;
  /// The interval may miss or is wide: one randomisation makes up most of the variance, as where
  /// light is rare; no path has found light; or light that no path has found may be more than a
  /// quarter of the reading.
  bool unreliable = false;
  std::int64_t samples = 0;  ///< paths
};
/// Returns the readings; none before every point has a sample. chunks: those of the points.
/// path_light: unsampled_path_light() of the scene (core/render/picture/unsampled_light.h).
///
/// The interval is Student's t, but rare events are skewed, so its upper end is at least
///   mean + 4.57 (largest randomisation - their median) / 16: the largest as a single event, of
///     which up to 5.57 may have been due (Poisson, 97.5%; Garwood 1936). For Gaussian noise this
///     is the end by Student's t;
///   mean + 3.69 path_light / paths: of light that no path has found up to 3.69 events may be due.
std::vector<MeterReading> meter_readings(const std::vector<MeterPoint>& points,
                                         const std::vector<MeterChunk>& chunks,
                                         double path_light = 0);

/// Returns the largest (high - low) / illuminance of any point; infinite if a point has no reading.
double meter_error(const std::vector<MeterReading>& readings);

/// The difference of two readings of a point, lux.
struct ReadingDifference {
  double value = 0;  ///< a - b
  double low = 0;    ///< 95% interval; assumes independent readings
  double high = 0;
};
/// The interval's ends are root sums of squares of the distances of the readings' ends. Source: Zou
/// and Donner, Construction of confidence limits about effect measures, Stat. Med. 27, 2008
/// (MOVER).
ReadingDifference difference_of(const MeterReading& a, const MeterReading& b);

double mean_illuminance(std::span<const MeterReading> readings);  ///< lux; NaN without readings

/// Returns the least reading divided by their mean (EN 12464-1, U0); NaN if the mean is not
/// positive.
double uniformity(std::span<const MeterReading> readings);

}  // namespace core
