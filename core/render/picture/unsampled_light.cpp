#include "core/render/picture/unsampled_light.h"

#include <algorithm>
#include <numbers>

#include "core/scene/scene_data.h"

namespace core {
namespace {

/// Peak of a lobe, relative to a diffuse surface, from which emitters reflected in it are rare
/// events: ten times brighter, seen from a tenth of the directions.
constexpr float kPeak = 10;

/// Returns whether a GGX lobe that carries `share` of the light has such a peak: about 1 / (4
/// alpha^2) for a perpendicular mirror, 1 / pi for a diffuse surface.
bool is_rare(float share, float roughness) {
  const float alpha = roughness * roughness;
  return share * std::numbers::pi_v<float> > kPeak * 4 * alpha * alpha && share > 0;
}

/// Reflectance of a dielectric at normal incidence.
float fresnel_of(float ior) {
  const float root = (ior - 1) / (ior + 1);
  return ior > 0 ? root * root : 1.0F;
}

bool is_polished(const Material& material) {
  const MaterialDescription& m = material.factors;
  const float dielectric = m.specular * fresnel_of(m.ior);
  const float coat = m.clearcoat * fresnel_of(1.5F);
  return is_rare(std::max({m.metallic, m.transmission, dielectric}), m.roughness) ||
         is_rare(coat, m.clearcoat_roughness);
}

double largest_radiance(const Environment& environment) {
  const Environment::Map map = environment.map();
  double most = static_cast<double>(luminance(map.constant));
  for (std::ptrdiff_t i = 0; i < std::ptrdiff_t{map.width} * map.height; ++i) {
    most = std::max(most, static_cast<double>(luminance(map.texels[i])));
  }
  return environment.has_sun()
             ? most +
                   static_cast<double>(luminance(environment.sun_radiance(environment.sun_world())))
             : most;
}

}  // namespace

double unsampled_path_light(const View& view) {
  const SceneData& scene = view.scene->data();
  if (std::none_of(scene.materials.begin(), scene.materials.end(), is_polished)) {
    return 0;
  }
  double most = view.environment ? largest_radiance(*view.environment) : 0;
  for (const TriangleLight& light : scene.triangle_lights) {
    most = std::max(most, static_cast<double>(luminance(light.radiance)));
  }
  return std::numbers::pi * most;
}

}  // namespace core
