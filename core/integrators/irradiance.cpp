#include "core/integrators/irradiance.h"

#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/warp.h"
#include "core/transport/intersect.h"
#include "core/transport/surface_event.h"
#include "core/transport/visibility.h"

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

Rgb IrradianceTracer::sample(Vec3 point, Vec3 normal, const PathSampler& sampler,
                             std::uint64_t& rays) const noexcept {
  TracedPath path{PathState{.sampler = sampler, .rays = rays}};
  // Surfaces of the scene may pass through the point.
  const float error_m = kPlaneError * (taxicab(point) + 4 * scene_.radius_m);
  return sample_at(path, point, normal, offset_ray(point, normal, error_m));
}

Rgb IrradianceTracer::sample_seen(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                  std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(camera_ray, sampler, rays)};
  PathVertex vertex;
  if (!intersect(scene_, path, vertex)) {
    return {};
  }
  segment_medium(scene_, path, vertex);
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
  const LightSampler& lights = paths_.lights();
  path.fog = paths_.fog();
  path.out.hit = true;  // no first surface to record
  const Vec4 u = path.sampler.get_4d(dimension_group(0, BounceGroup::kLight));
  Rgb direct;
  const LightSample light =
      lights.empty() ? LightSample{} : lights.sample(point, normal, u.x, {u.y, u.z});
  const float cosine = dot(normal, light.wi_world);
  if (light.pdf_solid_angle > 0 && cosine > 0 && !is_black(light.radiance)) {
    const float weight =
        light.is_delta ? 1.0F
                       : paths_.options().mis.weight(light.pdf_solid_angle,
                                                     cosine_hemisphere_pdf_solid_angle(cosine));
    Ray shadow;
    shadow.origin = origin;
    shadow.direction = light.is_far ? light.wi_world : light.target - origin;
    shadow.t_max = light.is_far ? kFar : 1.0F;
    MediumStack media = path.media;
    const Visibility seen = visibility(scene_, path, shadow, media);
    direct = light.radiance * seen.transmittance * (cosine * weight / light.pdf_solid_angle);
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
