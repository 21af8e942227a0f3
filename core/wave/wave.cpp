#include "core/wave/wave.h"

namespace core {

void Wave::clear() noexcept {
  samplers_.clear();
  paths.count = 0;
  shadows.count = 0;
}

void Wave::add(const Camera::CameraRay& camera_ray, const PathSampler& sampler) {
  const std::size_t i = samplers_.size();
  samplers_.push_back(sampler);
  paths.origin.set(i, camera_ray.ray.origin);
  paths.direction.set(i, camera_ray.ray.direction);
  paths.beta.set(i, {1, 1, 1});
  paths.pdf_bsdf.at[i] = 0;
  paths.last_origin.set(i, {});
  paths.last_normal.set(i, {});
  paths.cone_width_m.at[i] = camera_ray.width_m;
  paths.cone_spread_rad.at[i] = camera_ray.spread_rad;
  paths.is_sharp.at[i] = 1;
  paths.base.at[i] = sampler.base();
  paths.index_reversed.at[i] = reverse_bits(sampler.index());
  paths.slot.at[i] = static_cast<std::int32_t>(i);
  paths.count = i + 1;
  results.radiance.set(i, {});
  results.alpha.at[i] = 1;
  results.hit.at[i] = 0;
}

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
    out.depth_m = results.depth_m.at[i];
  }
  return out;
}

}  // namespace core
