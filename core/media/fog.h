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
  /// Returns whether its density is the same everywhere: the depth then is a length.
  bool is_even() const noexcept { return falloff_ == 0; }
  /// Returns the distance along the ray at which the depth is reached. Pre: the depth is less than
  /// depth() of the whole ray.
  float distance(Vec3 origin, Vec3 direction, float depth_m) const noexcept;
  /// Returns the factor of the coefficients at a point within the sphere.
  float density(Vec3 point) const noexcept;
  /// The interval of a ray inside the sphere [m].
  template <typename F>
  struct RangeOf {
    F begin_m = F(0);
    F end_m = F(0);
  };
  using Range = RangeOf<float>;
  template <typename V, typename F>
  RangeOf<F> range(V origin, V direction, F distance_m) const noexcept {
    const V from = origin - V(center_);
    const F along = -dot(from, direction);
    const V off = from + direction * along;
    const F half2 = radius_m_ * radius_m_ - dot(off, off);
    const F half = sqrt(max(half2, F(0)));
    const F begin = max(along - half, F(0));
    const F end = max(min(along + half, distance_m), begin);
    return {select(half2 > 0, begin, F(0)), select(half2 > 0, end, F(0))};
  }

 private:
  Medium medium_;
  Vec3 center_;
  float radius_m_;
  float falloff_;
  float at_origin_;  ///< exponent of the density at the scene's origin
};

}  // namespace core
