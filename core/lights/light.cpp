#include "core/lights/light.h"

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"

namespace core {

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
  if (range_m > 0) {
    const float q = squared / (range_m * range_m);
    factor *= clamp01(1 - q * q);
  }
  if (type == PunctualType::kSpot) {
    const float scale = 1 / std::max(0.001F, cos_inner - cos_outer);
    const float t = clamp01((dot(direction, -wi_world) - cos_outer) * scale);
    factor *= t * t;
  }
  return intensity * factor;
}

}  // namespace core
