#include "core/lights/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/color/photometry.h"
#include "core/color/wavelength.h"

namespace core {
namespace {

constexpr double kPiExact = std::numbers::pi;
/// Turbidity: 2 is a very clear day, 3 a clear one (Preetham et al., figure 3).
constexpr double kTurbidity = 3;

/// Spectral irradiance of the sun outside the atmosphere [W/(m^2 nm)]: Planck's law at the sun's
/// effective temperature. Source: IAU 2015 resolution B3 (5772 K, radius 695,700 km; astronomical
/// unit 149,597,870.7 km).
constexpr double kSunKelvin = 5772;
constexpr double kSunRadiusAu = 695700.0 / 149597870.7;

double sun_radiance_per_nm(double nm) {
  constexpr double kFirst = 1.191042972e-16;  // 2 h c^2 [W m^2]
  constexpr double kSecond = 0.01438776877;   // h c / k [m K]
  const double m = nm * 1e-9;
  return kFirst / std::pow(m, 5) / (std::exp(kSecond / (m * kSunKelvin)) - 1) * 1e-9;
}

/// Returns the transmittance of the atmosphere for sunlight (Preetham et al., appendix A.1).
double transmittance(double nm, double theta_sun) {
  const double degrees = theta_sun * 180 / kPiExact;
  const double mass = 1 / (std::cos(theta_sun) + 0.15 * std::pow(93.885 - degrees, -1.253));
  const double um = nm * 1e-3;
  const double rayleigh = std::exp(-0.008735 * std::pow(um, -4.08) * mass);
  const double beta = 0.04608 * kTurbidity - 0.04586;
  const double aerosol = std::exp(-beta * std::pow(um, -1.3) * mass);
  return rayleigh * aerosol;
}

}  // namespace

double Sky::Perez::value(double cos_theta, double gamma) const {
  return (1 + a * std::exp(b / cos_theta)) *
         (1 + c * std::exp(d * gamma) + e * std::cos(gamma) * std::cos(gamma));
}

double Sky::Perez::over_zenith(double cos_theta, double gamma, double theta_sun) const {
  return zenith * value(cos_theta, gamma) / value(1, theta_sun);
}

Sky::Sky(const SunPosition& sun) {
  constexpr double kT = kTurbidity;
  sun_.direction = sun_direction(sun);
  sun_.angular_radius_rad = static_cast<float>(std::asin(kSunRadiusAu / sun.distance_au));
  theta_sun_ = (90 - sun.elevation_degrees) * kPiExact / 180;
  const double s = theta_sun_;
  const double chi = (4.0 / 9 - kT / 120) * (kPiExact - 2 * s);
  // Appendix A.2, where the zenith luminance is in kcd/m^2.
  luminance_ = {0.17872 * kT - 1.46303,
                -0.35540 * kT + 0.42749,
                -0.02266 * kT + 5.32505,
                0.12064 * kT - 2.57705,
                -0.06696 * kT + 0.37027,
                1000 * ((4.0453 * kT - 4.9710) * std::tan(chi) - 0.2155 * kT + 2.4192)};
  x_ = {-0.01925 * kT - 0.25922,
        -0.06651 * kT + 0.00081,
        -0.00041 * kT + 0.21247,
        -0.06409 * kT - 0.89887,
        -0.00325 * kT + 0.04517,
        kT * kT * (0.00166 * s * s * s - 0.00375 * s * s + 0.00209 * s) +
            kT * (-0.02903 * s * s * s + 0.06377 * s * s - 0.03202 * s + 0.00394) +
            0.11693 * s * s * s - 0.21196 * s * s + 0.06052 * s + 0.25886};
  y_ = {-0.01669 * kT - 0.26078,
        -0.09495 * kT + 0.00921,
        -0.00792 * kT + 0.21023,
        -0.04405 * kT - 1.65369,
        -0.01092 * kT + 0.05291,
        kT * kT * (0.00275 * s * s * s - 0.00610 * s * s + 0.00317 * s) +
            kT * (-0.04214 * s * s * s + 0.08970 * s * s - 0.04153 * s + 0.00516) +
            0.15346 * s * s * s - 0.26756 * s * s + 0.06670 * s + 0.26688};
  for (int nm = 380; nm <= 780; ++nm) {
    const double arrives = sun_radiance_per_nm(nm) * transmittance(nm, s);
    sun_.radiance +=
        color_matching(static_cast<float>(nm)) * static_cast<float>(arrives * kLumensPerWatt);
  }
  sun_.radiance = {std::max(sun_.radiance.r, 0.0F), std::max(sun_.radiance.g, 0.0F),
                   std::max(sun_.radiance.b, 0.0F)};
  const double radius = static_cast<double>(sun_.angular_radius_rad);
  irradiance_ = sun_.radiance *
                static_cast<float>(kPiExact * std::sin(radius) * std::sin(radius) * std::cos(s));
  constexpr int kRows = 90;  // midpoints over cos^2 and the azimuth
  constexpr int kColumns = 180;
  for (int i = 0; i < kRows; ++i) {
    const auto y = static_cast<float>(std::sqrt((i + 0.5) / kRows));
    const float level = std::sqrt(1 - y * y);
    for (int k = 0; k < kColumns; ++k) {
      const double phi = 2 * kPiExact * (k + 0.5) / kColumns;
      const Vec3 d = {level * static_cast<float>(std::cos(phi)), y,
                      level * static_cast<float>(std::sin(phi))};
      irradiance_ += above(d) * static_cast<float>(kPiExact / (kRows * kColumns));
    }
  }
}

Rgb Sky::above(Vec3 d) const {
  const auto cos_theta = static_cast<double>(std::max(d.y, 1e-4F));
  const double gamma =
      std::acos(std::clamp(static_cast<double>(dot(d, sun_.direction)), -1.0, 1.0));
  const double big_y = luminance_.over_zenith(cos_theta, gamma, theta_sun_);  // cd/m^2
  const double x = x_.over_zenith(cos_theta, gamma, theta_sun_);
  const double y = y_.over_zenith(cos_theta, gamma, theta_sun_);
  const auto cx = static_cast<float>(x / y * big_y);
  const auto cy = static_cast<float>(big_y);
  const auto cz = static_cast<float>((1 - x - y) / y * big_y);
  // Out-of-gamut values are clipped.
  const Rgb c = rgb_from_xyz(cx, cy, cz);
  return {std::max(c.r, 0.0F), std::max(c.g, 0.0F), std::max(c.b, 0.0F)};
}

Rgb Sky::radiance(Vec3 direction) const {
  return direction.y > 0 ? above(direction)
                         : irradiance_ * (kGroundAlbedo / static_cast<float>(kPiExact));
}

}  // namespace core
