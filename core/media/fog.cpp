#include "core/media/fog.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace core {
namespace {

/// For exponents below this, exp(x) - 1 equals x to float precision.
constexpr float kStraight = 1e-5F;
/// Keeps products of densities and lengths finite.
constexpr float kDensest = 1e18F;

}  // namespace

Fog::Fog(const FogSettings& settings, Vec3 center, float radius_m, double height_m) noexcept
    : medium_{settings.scattering + settings.absorption, settings.scattering, settings.g},
      center_(center),
      radius_m_(radius_m),
      falloff_(settings.height_falloff),
      at_origin_(static_cast<float>(static_cast<double>(settings.height_falloff) * -height_m)) {}

float Fog::density(Vec3 point) const noexcept {
  return std::min(std::exp(at_origin_ - falloff_ * point.y), kDensest);
}

/// Anchored at the lower end, where the density is highest: from there it only decreases, so
/// neither factor overflows however high the other end is.
float Fog::depth(Vec3 origin, Vec3 direction, float distance_m) const noexcept {
  const Range r = range(origin, direction, distance_m);
  const float length = r.end_m - r.begin_m;
  const float slope = -falloff_ * direction.y;
  const float densest = density(origin + direction * (slope > 0 ? r.end_m : r.begin_m));
  const float exponent = std::fabs(slope) * length;
  if (exponent < kStraight) {
    return densest * length;
  }
  return std::min(densest * (-std::expm1(-exponent) / std::fabs(slope)),
                  std::numeric_limits<float>::max());
}

float Fog::distance(Vec3 origin, Vec3 direction, float depth_m) const noexcept {
  const Range r = range(origin, direction, std::numeric_limits<float>::max());
  if (!(depth_m > 0)) {
    return r.begin_m;
  }
  const Vec3 start = origin + direction * r.begin_m;
  const float slope = -falloff_ * direction.y;
  const float scaled = depth_m / density(start);
  const float exponent = slope * scaled;
  float length = scaled;
  if (exponent >= 1) {
    // log(1 + exponent) from the logarithm of the exponent: the density at the start may underflow.
    const float log_exponent = std::log(slope) + std::log(depth_m) + falloff_ * start.y;
    length = (log_exponent + std::log1p(std::exp(-log_exponent))) / slope;
  } else if (std::fabs(exponent) >= kStraight) {
    length = std::log1p(std::max(exponent, -1.0F)) / slope;
  }
  return std::min(r.begin_m + length, r.end_m);
}

}  // namespace core
