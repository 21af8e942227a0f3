/// Paths through media that scatter: the steps of PathTracer that differ. For path.cpp, which
/// instantiates them.
#pragma once

#include "core/integrators/path_tracer.h"
#include "core/samplers/dimensions.h"
#include "core/transport/intersect.h"
#include "core/transport/medium_sample.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {

/// Scatterings in media do not count as bounces, for milk has hundreds where a room has two; there
/// are at most so many for each bounce that max_depth allows. At an albedo of 0.99, which loses
/// half of the light in 69 scatterings, roulette ends nearly all paths before.
inline constexpr int kMediumScatterings = 64;

/// Widening of the ray cone [rad]: that of a rough surface.
inline constexpr float kMediumConeSpread = 0.1F;

template <typename Options>
bool PathTracer<Options>::reach_through_media(TracedPath& path, PathVertex& vertex) const noexcept {
  while (true) {
    const bool is_met = intersect(scene_, path, vertex);
    // Behind the last surface there is no solid: where the stack says so, a mesh has a hole.
    const Medium* solid = is_met ? segment_medium(scene_, path, vertex) : nullptr;
    [[maybe_unused]] Medium seen;
    if constexpr (Options::is_spectral) {
      if (solid != nullptr) {
        seen = colors(path).medium(*path.media.top());
        solid = &seen;
      }
    }
    MediumSample sample;
    if (is_met || path.media.top() == nullptr) {
      sample = sample_medium(path, solid, is_met ? vertex.distance_m : kFar);
    }
    if (!survives(path, sample.weight)) {
      return false;
    }
    path.beta *= sample.weight;
    if (is_black(path.beta)) {
      return false;
    }
    if (sample.scatterer == nullptr) {
      if (!is_met) {
        add_environment(path);
      }
      return is_met;
    }
    if (!scatter_within(path, *sample.scatterer, sample.distance_m)) {
      return false;
    }
  }
}

/// Scatters in a medium: a light sample, the next direction, roulette. False: the path is over.
template <typename Options>
bool PathTracer<Options>::scatter_within(TracedPath& path, const Medium& medium,
                                         float distance_m) const noexcept {
  const Vec3 before = path.ray.direction;
  const Vec3 point = path.ray.origin + before * distance_m;
  if (!path.out.hit) {
    path.out.hit = true;
    path.out.albedo = {medium.sigma_t.r > 0 ? medium.sigma_s.r / medium.sigma_t.r : 0.0F,
                       medium.sigma_t.g > 0 ? medium.sigma_s.g / medium.sigma_t.g : 0.0F,
                       medium.sigma_t.b > 0 ? medium.sigma_s.b / medium.sigma_t.b : 0.0F};
    path.out.normal_world = -before;
    path.out.depth_m = distance_m;
  }
  if (path.medium_scatterings >= kMediumScatterings * options_.max_depth) {
    return false;
  }
  const Vec4 u_light = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  add_light_within(path, medium, point, u_light);
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  path.ray.origin = point;
  path.ray.direction = sample_henyey_greenstein(before, medium.g, {u.y, u.z});
  path.last = {henyey_greenstein(dot(before, path.ray.direction), medium.g), point, {}, 1};
  path.cone_spread_rad += kMediumConeSpread;
  path.is_sharp = false;
  path.in_pair = path.last_controlled = path.last_fitted = false;
  path.u_roulette = -1;
  ++path.depth;
  ++path.medium_scatterings;
  if (options_.roulette == RouletteType::kNone) {
    return true;
  }
  return survives_roulette(path, u_light.w, continuation_probability(path));
}

template <typename Options>
void PathTracer<Options>::add_light_within(TracedPath& path, const Medium& medium, Vec3 point,
                                           Vec4 u) const noexcept {
  if (lights_.empty() || (!samples_lights() && !lights_.has_delta())) {
    return;
  }
  const LightSample light = samples_lights() ? lights_.sample(point, {}, u.x, {u.y, u.z})
                                             : lights_.sample_delta(point, u.x);
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return;
  }
  const float phase = henyey_greenstein(dot(path.ray.direction, light.wi_world), medium.g);
  const bool is_shared = !light.is_delta && options_.strategy == Strategy::kMis;
  const float weight = is_shared ? rule(false).weight(light.pdf_solid_angle, phase) : 1.0F;
  Ray shadow{point, light.is_far ? light.wi_world : light.target - point, 0,
             light.is_far ? kFar : 1.0F};
  MediumStack media = path.media;
  Visibility seen = visibility(scene_, path, shadow, media, ClearSurfaces::kPass, colors(path));
  if (is_black(seen.transmittance) || !survives(path, seen.transmittance)) {
    return;
  }
  credit(path,
         path.beta * colors(path).values(light.radiance) * seen.transmittance *
             (phase * weight / light.pdf_solid_angle),
         path.bounces() + 1, [&] { return scene_.group_of_light(light.light); });
}

}  // namespace core
