#include "core/render/unsampled_light.h"

#include <algorithm>
#include <numbers>

#include "core/scene/scene_data.h"

namespace core {
namespace {

/// Roughness below which a lobe, of less than a degree (alpha 0.01), sees a small emitter whole or
/// not at all.
constexpr float kPolished = 0.1F;

bool is_polished(const Material& material) {
  const MaterialDescription& m = material.factors;
  const bool mirrors = m.roughness < kPolished && (m.metallic > 0 || m.ior != 1);
  const bool is_coated = m.clearcoat > 0 && m.clearcoat_roughness < kPolished;
  return mirrors || is_coated || (m.transmission > 0 && m.roughness < kPolished);
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
