#include "core/light_samplers/emitted_light.h"

#include <algorithm>
#include <numeric>

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

Rgb triangle_radiance(const SceneData& scene, const TriangleLight& light, Vec2 weights) noexcept {
  if (!light.textured) {
    return light.radiance;
  }
  const MeshData& mesh = scene.meshes[scene.placed[light.placed].mesh];
  const TextureSlot& slot = scene.materials[mesh.material].emissive;
  const TextureDescription& m = slot.description;
  const auto& uv = mesh.uv[static_cast<std::size_t>(m.uv_set)];
  Vec2 p;
  if (!uv.empty()) {
    const std::size_t at = 3 * std::size_t{light.triangle};
    p = uv[mesh.indices[at]] * (1 - weights.x - weights.y) + uv[mesh.indices[at + 1]] * weights.x +
        uv[mesh.indices[at + 2]] * weights.y;
  }
  const auto& x = m.uv_transform;
  const Vec4 c =
      slot.texture->sample({.uv = {x[0] * p.x + x[1] * p.y + x[2], x[3] * p.x + x[4] * p.y + x[5]},
                            .wrap_u = m.wrap_u,
                            .wrap_v = m.wrap_v,
                            .nearest = m.nearest});
  return scene.materials[mesh.material].factors.emissive * Rgb{c.x, c.y, c.z};
}

}  // namespace core
