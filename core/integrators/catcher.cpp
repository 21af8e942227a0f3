#include "core/integrators/catcher.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/integrators/registry.h"
#include "core/samplers/dimensions.h"
#include "core/transport/intersect.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"
#include "core/transport/visibility.h"

namespace core {

Rgb level_irradiance(const Environment& environment, float up) {
  const Environment::Map map = environment.map();
  if (map.width == 0) {
    return map.constant * kPi;
  }
  // The integral of the cosine over a texel is exact; the rotation is about the vertical axis.
  double r = 0;
  double g = 0;
  double b = 0;
  for (int y = 0; y < map.height; ++y) {
    const auto edge = [&](int row) {
      const double cosine = static_cast<double>(up) * std::cos(std::numbers::pi * row / map.height);
      return cosine > 0 ? cosine * cosine : 0.0;
    };
    const double weight = std::numbers::pi / map.width * std::fabs(edge(y) - edge(y + 1));
    for (int x = 0; x < map.width && weight > 0; ++x) {
      const Rgb texel =
          map.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                     static_cast<std::size_t>(x)];
      r += weight * static_cast<double>(texel.r);
      g += weight * static_cast<double>(texel.g);
      b += weight * static_cast<double>(texel.b);
    }
  }
  return Rgb{static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)} +
         environment.sun_irradiance() * std::max(up * environment.sun_world().y, 0.0F);
}

BareGround::BareGround(const SceneData& scene, const Environment* environment, Rgb albedo)
    : scene_(scene), albedo_(albedo) {
  if (environment != nullptr) {
    distant_ = {level_irradiance(*environment, 1), level_irradiance(*environment, -1)};
  }
}

Rgb BareGround::radiance(Vec3 point, float up) const noexcept {
  Rgb irradiance = distant_[up > 0 ? 0 : 1];
  for (const PunctualLight& light : scene_.punctual_lights) {
    Vec3 wi_world;
    float distance_m = 0;
    const Rgb arriving = light.arriving(point, wi_world, distance_m);
    irradiance += arriving * std::max(up * wi_world.y, 0.0F);
  }
  return albedo_ * irradiance * kInvPi;
}

/// Adds a light sample, which the model may occlude.
template <typename Options>
void CatcherTracer<Options>::add_light_sample(TracedPath& path, const PathVertex& vertex,
                                              const Bsdf& bsdf, Change& change) const noexcept {
  const LightSampler& lights = paths_.lights();
  if (lights.empty()) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  const LightSample light =
      lights.sample(vertex.shading.origin, vertex.light_normal, u.x, {u.y, u.z});
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return;
  }
  const BsdfEval f = bsdf.evaluate(vertex.shading.frame.to_local(light.wi_world));
  if (is_black(f.value_cos)) {
    return;
  }
  const float weight =
      light.is_delta ? 1.0F : paths_.options().mis.weight(light.pdf_solid_angle, f.pdf_solid_angle);
  const Rgb value = f.value_cos * light.radiance * (weight / light.pdf_solid_angle);
  const Rgb open = visibility_from(scene_, path, vertex, light.wi_world, light.target, light.is_far)
                       .transmittance;
  if (light.triangle != kNoLight) {
    change.more += value * open;  // an emitter of the model
    return;
  }
  change.more += value * (open - Rgb(1));
  change.blocked += value * (Rgb(1) - open);
}

/// Samples a BSDF direction: it hits the model, or sees the environment with and without the model.
template <typename Options>
void CatcherTracer<Options>::add_direction(TracedPath& path, const PathVertex& vertex,
                                           const Bsdf& bsdf, Change& change) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  const BsdfSample sample = bsdf.sample(u.x, {u.y, u.z});
  if (is_black(sample.weight)) {
    return;
  }
  scatter(scene_, path, vertex, sample, 1);
  RawHit hit;
  ++path.rays;
  if (!scene_.accel->intersect(path.ray, hit)) {
    return;
  }
  Rgb kept_away;
  if (environment_ != nullptr) {
    const Vec3 direction = path.ray.direction;
    const float pdf_light =
        paths_.lights().pdf_environment(direction, vertex.shading.origin, vertex.light_normal);
    kept_away = path.beta * environment_->radiance(direction) *
                paths_.options().mis.weight(path.last.pdf_bsdf, pdf_light);
  }
  path.met = &hit;
  paths_.follow(path);
  change.more += path.out.radiance - kept_away;
  // The ray may leave the scene through holes.
  change.blocked += path.out.hit ? kept_away : Rgb{};
}

template <typename Options>
PathSample CatcherTracer<Options>::trace(const Camera::CameraRay& camera_ray,
                                         const PathSampler& sampler,
                                         std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(camera_ray, sampler, rays)};
  PathVertex vertex;
  const bool is_ground =
      intersect(scene_, path, vertex) && scene_.ground && vertex.point.placed == *scene_.ground;
  if (!is_ground) {
    return paths_.trace(camera_ray, sampler, rays);
  }
  segment_medium(scene_, path, vertex);
  surface_event(scene_, path, vertex);
  const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
  vertex.light_normal = vertex.shading.horizon;
  PathSample out;
  record_first_surface(out, vertex, bsdf.albedo());
  Change change;
  if (!paths_.is_at_max_depth(path)) {
    add_light_sample(path, vertex, bsdf, change);
    add_direction(path, vertex, bsdf, change);
  }
  const Rgb bounced = change.more + change.blocked;
  const Rgb bare = bare_.radiance(vertex.point.position, vertex.wo_world.y > 0 ? 1.0F : -1.0F);
  const auto share = [](float part, float whole) { return whole > 0 ? part / whole : 0.0F; };
  if (const std::optional<Rgb> seen = backdrop_.seen(camera_ray.ray.direction)) {
    const Rgb blocked = {share(change.blocked.r, bare.r), share(change.blocked.g, bare.g),
                         share(change.blocked.b, bare.b)};
    out.radiance = *seen * (Rgb(1) - blocked) + bounced;
    return out;
  }
  out.alpha = share(luminance(change.blocked), luminance(bare));
  out.radiance = change.more + bare * out.alpha;
  return out;
}

std::unique_ptr<const Integrator> make_catcher(const IntegratorInput& input) {
  if (needs_whole_options(input)) {
    return std::make_unique<CatcherTracer<WholeOptions>>(input);
  }
  if (DefaultOptions::serves(input)) {
    return std::make_unique<CatcherTracer<DefaultOptions>>(input);
  }
  return std::make_unique<CatcherTracer<StudyOptions>>(input);
}

}  // namespace core
