#include "core/lights/light.h"

#include <algorithm>
#include <cmath>

#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Scale of KHR_lights_punctual's falloff t^2, t = (cosine - cos_outer) * scale.
float spot_scale(const PunctualLight& light) noexcept {
  return 1 / std::max(0.001F, light.cos_inner - light.cos_outer);
}

/// A spot's intensity by cosine: a falloff where t grows from 0, and a cap of full intensity.
struct Cap {
  float width = 0;  ///< of the falloff, in cosine
  float rim = 0;    ///< integrals
  float full = 0;
};

Cap spot_cap(const PunctualLight& light) noexcept {
  const float scale = spot_scale(light);
  const float width = std::min(1 / scale, 1 - light.cos_outer);
  return {width, width * width * width * scale * scale / 3, 1 - light.cos_outer - width};
}

}  // namespace

PunctualLight punctual_light(const PunctualLightDescription& description,
                             const IesProfile* profile) {
  PunctualLight light;
  light.type = description.type;
  light.position = description.to_world.t;
  light.direction = normalize_or(-description.to_world.z, {0, 0, -1});
  light.intensity = description.intensity;
  light.range_m = description.range_m;
  light.cos_inner = std::cos(description.inner_cone_rad);
  light.cos_outer = std::cos(description.outer_cone_rad);
  light.profile = profile;
  const Frame frame = frame_from_normal_tangent(-light.direction, description.to_world.x);
  light.up = frame.s;
  light.side = description.to_world.determinant() < 0 ? -frame.t : frame.t;
  return light;
}

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
  factor *= shape(-wi_world);
  return intensity * factor;
}

float PunctualLight::range_factor(float distance_squared) const noexcept {
  const float q = range_m > 0 ? distance_squared / (range_m * range_m) : 0.0F;
  return clamp01(1 - q * q);
}

float PunctualLight::shape(Vec3 direction_world) const noexcept {
  if (type == PunctualType::kProfile) {
    return profile->candela(to_profile(direction_world));
  }
  if (type != PunctualType::kSpot) {
    return 1;
  }
  const float t = clamp01((dot(direction, direction_world) - cos_outer) * spot_scale(*this));
  return t * t;
}

float PunctualLight::shape_integral_sr() const noexcept {
  if (type == PunctualType::kProfile) {
    return static_cast<float>(profile->lumens());
  }
  const Cap cap = spot_cap(*this);
  return type == PunctualType::kSpot ? kTwoPi * (cap.rim + cap.full) : 4 * kPi;
}

float PunctualLight::pdf_solid_angle(Vec3 direction_world) const noexcept {
  return type == PunctualType::kProfile ? profile->pdf_solid_angle(to_profile(direction_world))
                                        : shape(direction_world) / shape_integral_sr();
}

Vec3 PunctualLight::sample_direction(Vec2 u) const noexcept {
  if (type == PunctualType::kProfile) {
    const Vec3 d = profile->sample(u);
    return up * d.x + side * d.y - direction * d.z;
  }
  if (type != PunctualType::kSpot) {
    return uniform_sphere(u);
  }
  const Cap cap = spot_cap(*this);
  const float at = u.x * (cap.rim + cap.full);
  // The integral of t^2 over the falloff is a cube.
  const float below =
      at < cap.rim ? 1 - cos_outer - cap.width * std::cbrt(at / cap.rim) : cap.rim + cap.full - at;
  return frame_from_normal(direction).to_world(in_cone(below, u.y));
}

}  // namespace core
