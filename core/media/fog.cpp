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

Fog::Range Fog::range(Vec3 origin, Vec3 direction, float distance_m) const noexcept {
  const Vec3 from = origin - center_;
  const float along = -dot(from, direction);
  const float off2 = length_squared(from + direction * along);
  const float half2 = radius_m_ * radius_m_ - off2;
  if (!(half2 > 0)) {
    return {};
  }
  const float half = std::sqrt(half2);
  const float begin = std::max(along - half, 0.0F);
  return {begin, std::max(std::min(along + half, distance_m), begin)};
}

Fog::Span Fog::span(Vec3 origin, Vec3 direction, float distance_m) const noexcept {
  Span out{.range = range(origin, direction, distance_m)};
  out.density = density(origin + direction * out.range.begin_m);
  out.slope = -falloff_ * direction.y;
  return out;
}

float Fog::depth(Vec3 origin, Vec3 direction, float distance_m) const noexcept {
  const Span s = span(origin, direction, distance_m);
  const float length = s.range.end_m - s.range.begin_m;
  const float exponent = s.slope * length;
  if (std::fabs(exponent) < kStraight) {
    return s.density * length;
  }
  return std::min(s.density * (std::expm1(exponent) / s.slope), std::numeric_limits<float>::max());
}

float Fog::distance(Vec3 origin, Vec3 direction, float depth_m) const noexcept {
  const Span s = span(origin, direction, std::numeric_limits<float>::max());
  const float scaled = depth_m / s.density;
  const float exponent = s.slope * scaled;
  const float length = std::fabs(exponent) < kStraight ? scaled : std::log1p(exponent) / s.slope;
  return std::min(s.range.begin_m + length, s.range.end_m);
}

}  // namespace core
