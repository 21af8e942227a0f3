/// Computes the position of the sun.
///
/// Source: NOAA Global Monitoring Laboratory, Solar Calculation Details; the formulas are Meeus,
/// Astronomical Algorithms, 2nd ed., chapters 22 and 25 (0.01 degrees between 1800 and 2100).
/// Ignores atmospheric refraction, which lifts the sun by 0.03 degrees at 30 degrees and by 0.5 at
/// the horizon.
#pragma once

#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

struct SunPosition {
  double elevation_degrees = 0;
  double azimuth_degrees = 0;  ///< clockwise from north
  double declination_degrees = 0;
  double distance_au = 1;
};

SunPosition sun_position(const SunSettings& at);

/// Returns the unit vector to the sun. East is +x, up +y, north -z.
Vec3 sun_direction(const SunPosition& sun);

}  // namespace core
