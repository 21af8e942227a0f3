#include "core/wave/wave.h"

namespace core {

// Memory of a thread in addition to its tile; a catcher adds WaveCaught, and layers of the light
// their shares of each sample.
static_assert(sizeof(Wave) + kWavePaths * sizeof(PathSampler) <= 160 * 1024);

PathSample Wave::result(std::size_t i) const noexcept {
  PathSample out;
  const Vec3 radiance = results.radiance.get(i);
  out.radiance = {radiance.x, radiance.y, radiance.z};
  out.alpha = results.alpha.at[i];
  out.hit = results.hit.at[i] != 0;
  if (out.hit) {
    const Vec3 albedo = results.albedo.get(i);
    out.albedo = {albedo.x, albedo.y, albedo.z};
    out.normal_world = results.normal.get(i);
    out.depth_m = results.depth_m.at[i] + results.start_m.at[i];
  }
  return out;
}

}  // namespace core
