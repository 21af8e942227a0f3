#include "core/light_samplers/emitted_light.h"

#include <algorithm>
#include <numeric>

#include "core/materials/shade.h"
#include "core/math/numbers.h"

namespace core {

float light_disk_radius_m(const SceneData& scene) noexcept {
  return scene.radius_m > 0 ? scene.radius_m : 1.0F;
}

std::vector<float> light_powers(const SceneData& scene, const Environment* environment) {
  const float section = kPi * square(light_disk_radius_m(scene));
  std::vector<float> powers;
  for (const TriangleLight& t : scene.triangle_lights) {
    powers.push_back(luminance(t.radiance) * t.area_m2 * kPi * (t.two_sided ? 2.0F : 1.0F));
  }
  for (const PunctualLight& p : scene.punctual_lights) {
    powers.push_back(luminance(p.intensity) *
                     (p.type == PunctualType::kDirectional ? section : p.shape_integral_sr()));
  }
  if (environment != nullptr) {
    powers.push_back(environment->power_luminance() * section);
  }
  const double total = std::accumulate(powers.begin(), powers.end(), 0.0);
  for (float& power : powers) {
    if (power > 0) {
      power = std::max(power, static_cast<float>(total) * 0x1p-20F);
    }
  }
  return powers;
}

Rgb triangle_radiance(const SceneData& scene, const TriangleLight& light, Vec3 place,
                      Vec3 wo_world) noexcept {
  if (!light.varies) {
    return light.radiance;
  }
  const RawHit hit = scene.hit_of(light);
  const Ray down = {place, -light.normal};
  const float coverage = scene.coverage(hit, down);
  if (!(coverage > 0)) {
    return {};
  }
  const SurfacePoint point = scene.surface_point(hit, down);
  return emitted(scene.materials[point.material], point, wo_world) * coverage;
}

}  // namespace core
