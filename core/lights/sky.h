/// Sky: radiance of a clear sky and the sun.
///
/// Source: Preetham, Shirley and Smits, A Practical Analytic Model for Daylight, SIGGRAPH 1999:
/// luminance and chromaticity of the sky, and attenuation of the sun (without ozone, water vapour
/// and mixed gases, which absorb a few percent). Radiance is in cd/m^2, as that of all lights
/// (core/color/photometry.h).
#pragma once

#include "core/color/rgb.h"
#include "core/lights/environment.h"
#include "core/lights/sun_position.h"

namespace core {

class Sky {
 public:
  /// Pre: the sun is above the horizon.
  explicit Sky(const SunPosition& sun);

  /// Returns the radiance from a direction (unit, y up). Below the horizon: that of ground with
  /// reflectance kGroundAlbedo.
  Rgb radiance(Vec3 direction) const;
  const SunDisc& sun() const { return sun_; }
  /// Returns the irradiance of a horizontal surface from sky and sun [lux].
  Rgb irradiance() const { return irradiance_; }

  /// Source: ASHRAE Handbook, Fundamentals: ground reflectance if nothing is known.
  static constexpr float kGroundAlbedo = 0.2F;

 private:
  /// Perez distribution of luminance Y or of a chromaticity, relative to its value at the zenith.
  struct Perez {
    double a, b, c, d, e;
    double zenith;
    double value(double cos_theta, double gamma) const;
    double over_zenith(double cos_theta, double gamma, double theta_sun) const;
  };
  Rgb above(Vec3 direction) const;

  SunDisc sun_;
  double theta_sun_ = 0;
  Perez luminance_{};
  Perez x_{};
  Perez y_{};
  Rgb irradiance_;
};

}  // namespace core
