#include "core/lights/light.h"

#include <algorithm>
#include <cmath>

#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Of KHR_lights_punctual's falloff t^2, t = (cosine - cos_outer) * scale.
float spot_scale(const PunctualLight& light) noexcept {
  return 1 / std::max(0.001F, light.cos_inner - light.cos_outer);
}

/// A spot's intensity over the cosine: a falloff where t grows from 0, and a cap of full intensity.
struct Cap {
  float width = 0;  ///< of the falloff, in the cosine
  float rim = 0;    ///< integrals
  float full = 0;
};

Cap spot_cap(const PunctualLight& light) noexcept {
  const float scale = spot_scale(light);
  const float width = std::min(1 / scale, 1 - light.cos_outer);
  return {width, width * width * width * scale * scale / 3, 1 - light.cos_outer - width};
}

}  // namespace

Rgb PunctualLight::arriving(Vec3 to, Vec3& wi_world, float& distance_m) const noexcept {
  if (type == PunctualType::kDirectional) {
    wi_world = -direction;
    distance_m = 3.4e38F;
    return intensity;
  }
  const Vec3 d = position - to;
  const float squared = dot(d, d);
  if (!(squared > 0)) {
    return {};
  }
  distance_m = std::sqrt(squared);
  wi_world = d * (1 / distance_m);
  float factor = 1 / squared;
  factor *= range_factor(squared);
  factor *= cone(dot(direction, -wi_world));
  return intensity * factor;
}

float PunctualLight::range_factor(float distance_squared) const noexcept {
  const float q = range_m > 0 ? distance_squared / (range_m * range_m) : 0.0F;
  return clamp01(1 - q * q);
}

float PunctualLight::cone(float cosine) const noexcept {
  if (type != PunctualType::kSpot) {
    return 1;
  }
  const float t = clamp01((cosine - cos_outer) * spot_scale(*this));
  return t * t;
}

float PunctualLight::cone_integral_sr() const noexcept {
  const Cap cap = spot_cap(*this);
  return type == PunctualType::kSpot ? kTwoPi * (cap.rim + cap.full) : 4 * kPi;
}

Vec3 PunctualLight::sample_direction(Vec2 u) const noexcept {
  if (type != PunctualType::kSpot) {
    return uniform_sphere(u);
  }
  const Cap cap = spot_cap(*this);
  const float at = u.x * (cap.rim + cap.full);
  // 1 - cosine, which keeps its digits in narrow cones. The integral of t^2 over the falloff is a
  // cube.
  const float below =
      at < cap.rim ? 1 - cos_outer - cap.width * std::cbrt(at / cap.rim) : cap.rim + cap.full - at;
  const float r = safe_sqrt(below * (2 - below));
  const float phi = kTwoPi * u.y;
  return frame_from_normal(direction).to_world({r * std::cos(phi), r * std::sin(phi), 1 - below});
}

}  // namespace core
