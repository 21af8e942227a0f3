#include "core/integrators/path/irradiance.h"

#include <algorithm>

#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/warp.h"
#include "core/transport/direct_light.h"
#include "core/transport/intersect.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

RenderSettings plain(const RenderSettings& asked) {
  RenderSettings settings;
  settings.max_depth = asked.max_depth;
  settings.fog = asked.fog;
  return settings;
}

}  // namespace

IrradianceTracer::IrradianceTracer(const IntegratorInput& input)
    : scene_(input.scene), paths_({input.scene, input.environment, plain(input.settings)}) {}

MediumStack IrradianceTracer::media_at(Vec3 point, Vec3 normal) const noexcept {
  return solids_around(scene_, origin_at(point, normal));
}

/// The origin of rays: surfaces of the scene may pass through the point.
Vec3 IrradianceTracer::origin_at(Vec3 point, Vec3 normal) const noexcept {
  return offset_ray(point, normal, kPlaneError * (taxicab(point) + 4 * scene_.radius_m));
}

Rgb IrradianceTracer::sample(Vec3 point, Vec3 normal, const MediumStack& media,
                             const PathSampler& sampler, std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(sampler, rays)};
  path.media = media;
  return sample_at(path, point, normal, origin_at(point, normal));
}

Rgb IrradianceTracer::sample_seen(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                  std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  PathVertex vertex;
  if (!reach(scene_, path, vertex)) {
    return {};
  }
  path.media.begin_segment(vertex.face);
  const auto facing = [&](Vec3 n) { return dot(n, vertex.wo_world) < 0 ? -n : n; };
  const SurfacePoint& point = vertex.point;
  return sample_at(path, point.position, facing(point.normal_shading),
                   offset_ray(point.position, facing(point.normal_geometric), point.error_m));
}

/// origin: of rays, off the surface.
Rgb IrradianceTracer::sample_at(TracedPath& path, Vec3 point, Vec3 normal,
                                Vec3 origin) const noexcept {
  if (paths_.options().max_depth < 1) {
    return {};
  }
  const MisLightSampler& lights = paths_.lights();
  path.fog = paths_.fog();
  path.out.hit = true;  // no first surface to record
  const Vec4 u = path.sampler.get_4d(dimension_group(0, BounceGroup::kLight));
  const DirectLight sampled = direct_light(
      lights.empty() ? LightSample{} : lights.sample(point, normal, u.x, {u.y, u.z}), [&](Vec3 wi) {
        const float cosine = std::max(dot(normal, wi), 0.0F);
        return BsdfEval{Rgb(cosine), cosine_hemisphere_pdf_solid_angle(cosine)};
      });
  Rgb direct;
  if (!is_black(sampled.value)) {
    const LightSample& light = sampled.light;
    Ray shadow;
    shadow.origin = origin;
    shadow.direction = light.is_far ? light.wi_world : light.target - origin;
    shadow.t_max = light.is_far ? kFar : 1.0F;
    MediumStack media = path.media;
    direct = sampled.value * visibility(scene_, path, shadow, media).transmittance *
             (sampled.weight(paths_.options().mis) / light.pdf_solid_angle);
  }
  const Vec4 v = path.sampler.get_4d(dimension_group(0, BounceGroup::kBsdf));
  const Vec3 local = cosine_hemisphere({v.y, v.z});
  path.beta = Rgb(1);
  path.ray = {.origin = origin,
              .direction = frame_from_normal(normal).to_world(local),
              .time = path.ray.time};
  path.last = {cosine_hemisphere_pdf_solid_angle(local.z), point, normal, 1};
  path.depth = 1;
  path.is_sharp = path.is_clear = false;
  paths_.follow(path);
  return direct + path.out.radiance * kPi;
}

}  // namespace core
