#include "core/transport/light_path.h"

#include "core/samplers/dimensions.h"

namespace core {

EmissionSample start_light_path(PathState& path, const EmissionSampler& emission) noexcept {
  const Vec4 from = path.sampler.get_4d(kStartGroup);
  const Vec4 towards = path.sampler.get_4d(kAimGroup);
  const EmissionSample light = emission.sample(from.x, {from.y, from.z}, {towards.x, towards.y});
  path.ray = light.ray;
  path.last.origin = light.ray.origin;
  path.beta = light.weight();
  return light;
}

}  // namespace core
