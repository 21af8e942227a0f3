#include "core/integrators/path/closed_form.h"

#include <algorithm>
#include <cmath>

#include "core/lights/triangle_irradiance.h"
#include "core/math/numbers.h"

namespace core {

bool has_closed_form(const TriangleLight& light, Vec3 point) noexcept {
  constexpr float kSolidAngleLeast = 1e-3F;
  constexpr float kHeightLeast = 1e-3F;  // relative to the side of a square of the same area
  const Vec3 to = light.p0 + (light.edge1 + light.edge2) * (1.0F / 3) - point;
  if (light.varies || !(light.area_m2 > kSolidAngleLeast * dot(to, to))) {
    return false;
  }
  const float before = -dot(light.normal, to);
  const float height = light.two_sided ? std::fabs(before) : before;
  return height > 0 && height * height > kHeightLeast * kHeightLeast * light.area_m2;
}

Rgb light_control(const TriangleLight& light, const LightSample& sample, const Shading& shading,
                  Rgb albedo) noexcept {
  const Vec3 n = shading.frame.n;
  const auto mean = static_cast<float>(triangle_irradiance(
      shading.origin, n, light.p0, light.p0 + light.edge1, light.p0 + light.edge2));
  const float sampled = std::max(dot(n, sample.wi_world), 0.0F) / sample.pdf_solid_angle;
  return albedo * sample.radiance * (kInvPi * (mean / sample.prob_light - sampled));
}

}  // namespace core
