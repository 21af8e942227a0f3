/// Fog: a medium within a sphere whose density decreases with height.
///
/// The optical path along a ray is its length weighted with the density exp(-falloff * y). Height
/// is linear along the ray, so the integral has a closed form and a closed inverse: distances are
/// sampled exactly, and transmittance is exact. Null collisions (Woodcock 1965) would sample the
/// same distances with more steps and make transmittance noisy.
#pragma once

#include "core/media/medium.h"
#include "core/settings/settings.h"

namespace core {

class Fog {
 public:
  /// center, radius_m: the sphere. height_m: of the scene's origin in the file.
  Fog(const FogSettings& settings, Vec3 center, float radius_m, double height_m = 0) noexcept;

  const Medium& medium() const noexcept { return medium_; }
  /// Returns the same fog with other coefficients.
  Fog with(const Medium& medium) const noexcept {
    Fog other = *this;
    other.medium_ = medium;
    return other;
  }
  /// Returns the depth along a ray of unit direction up to `distance_m`, which may be infinite [m
  /// at y = 0].
  float depth(Vec3 origin, Vec3 direction, float distance_m) const noexcept;
  /// Returns the distance along the ray at which the depth is reached. Pre: the depth is less than
  /// depth() of the whole ray.
  float distance(Vec3 origin, Vec3 direction, float depth_m) const noexcept;
  /// Returns the factor of the coefficients at a point within the sphere.
  float density(Vec3 point) const noexcept;
  /// The interval of a ray inside the sphere [m].
  struct Range {
    float begin_m = 0;
    float end_m = 0;
  };
  Range range(Vec3 origin, Vec3 direction, float distance_m) const noexcept;

 private:
  Medium medium_;
  Vec3 center_;
  float radius_m_;
  float falloff_;
  float at_origin_;  ///< exponent of the density at the scene's origin
};

}  // namespace core
