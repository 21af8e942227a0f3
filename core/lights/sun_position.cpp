#include "core/lights/sun_position.h"

#include <cmath>
#include <numbers>

namespace core {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

double sin_of(double degrees) { return std::sin(degrees * kDegree); }
double cos_of(double degrees) { return std::cos(degrees * kDegree); }

}  // namespace

SunPosition sun_position(const SunSettings& at) {
  constexpr double kJ2000UnixSeconds = 946728000;  // 2000-01-01 12:00
  constexpr double kSecondsPerDay = 86400;
  const double days = (at.unix_seconds - kJ2000UnixSeconds) / kSecondsPerDay;
  const double t = days / 36525;  // Julian centuries
  const double mean_longitude = 280.46646 + t * (36000.76983 + t * 0.0003032);
  const double mean_anomaly = 357.52911 + t * (35999.05029 - t * 0.0001537);
  const double eccentricity = 0.016708634 - t * (0.000042037 + t * 0.0000001267);
  const double center = sin_of(mean_anomaly) * (1.914602 - t * (0.004817 + t * 0.000014)) +
                        sin_of(2 * mean_anomaly) * (0.019993 - t * 0.000101) +
                        sin_of(3 * mean_anomaly) * 0.000289;
  const double node = 125.04 - 1934.136 * t;  // of the moon: nutation
  const double longitude = mean_longitude + center - 0.00569 - 0.00478 * sin_of(node);
  const double obliquity = 23 +
                           (26 + (21.448 - t * (46.815 + t * (0.00059 - t * 0.001813))) / 60) / 60 +
                           0.00256 * cos_of(node);
  const double right_ascension =
      std::atan2(cos_of(obliquity) * sin_of(longitude), cos_of(longitude)) / kDegree;
  const double declination = std::asin(sin_of(obliquity) * sin_of(longitude)) / kDegree;
  // Meeus (12.4); nutation in right ascension approximated by that in longitude.
  const double sidereal = 280.46061837 + 360.98564736629 * days + t * t * 0.000387933 -
                          0.00478 * sin_of(node) * cos_of(obliquity);
  const double hour_angle = sidereal + at.longitude_degrees - right_ascension;
  // Meeus (13.5) and (13.6), with azimuth measured from north.
  const double latitude = at.latitude_degrees;
  SunPosition out;
  out.declination_degrees = declination;
  out.distance_au = 1.000001018 * (1 - eccentricity * eccentricity) /
                    (1 + eccentricity * cos_of(mean_anomaly + center));
  out.elevation_degrees = std::asin(sin_of(latitude) * sin_of(declination) +
                                    cos_of(latitude) * cos_of(declination) * cos_of(hour_angle)) /
                          kDegree;
  const double south = std::atan2(sin_of(hour_angle) * cos_of(declination),
                                  cos_of(hour_angle) * sin_of(latitude) * cos_of(declination) -
                                      sin_of(declination) * cos_of(latitude)) /
                       kDegree;
  out.azimuth_degrees = std::fmod(south + 180 + 360, 360);
  return out;
}

Vec3 sun_direction(const SunPosition& sun) {
  const double level = cos_of(sun.elevation_degrees);
  return {static_cast<float>(level * sin_of(sun.azimuth_degrees)),
          static_cast<float>(sin_of(sun.elevation_degrees)),
          static_cast<float>(-level * cos_of(sun.azimuth_degrees))};
}

}  // namespace core
