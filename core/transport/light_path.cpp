#include "core/transport/light_path.h"

#include "core/samplers/dimensions.h"

namespace core {

EmissionSample start_light_path(const SceneData& scene, PathState& path,
                                const EmissionSampler& emission) noexcept {
  const Vec4 from = path.sampler.get_4d(kStartGroup);
  const Vec4 towards = path.sampler.get_4d(kAimGroup);
  const EmissionSample light = emission.sample(from.x, {from.y, from.z}, {towards.x, towards.y});
  path.ray = light.ray;
  path.last.origin = light.ray.origin;
  path.beta = light.weight();
  path.is_from_light = true;
  if (light.start != nullptr) {
    path.media = light.start->varies ? solids_around(scene, light.ray.origin) : light.start->media;
  }
  return light;
}

}  // namespace core
