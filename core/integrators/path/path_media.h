/// Steps of PathTracer for paths in scattering media. Included by path.cpp, which instantiates
/// them.
#pragma once

#include <optional>

#include "core/integrators/path/path_tracer.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/equiangular.h"
#include "core/transport/intersect.h"
#include "core/transport/medium_sample.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {

/// A segment of a path in a medium on which light samples choose their own distances.
struct MediumAim {
  MediumStretch stretch;
  Vec3 from;  ///< reference point for choosing lights

  Equiangular distances(const PathState& path, Vec3 light) const noexcept {
    const Fog::Range range = stretch.range();
    return {path.ray.origin, path.ray.direction, range.begin_m, range.end_m, light};
  }
};

template <typename Options>
bool PathTracer<Options>::reach_through_media(TracedPath& path, PathVertex& vertex) const noexcept {
  while (true) {
    const bool is_met = intersect(scene_, path, vertex);
    // There is no solid behind the last surface; if the stack says so, a mesh has a hole.
    const Material* within = is_met ? segment_solid(path, vertex) : nullptr;
    const Medium* solid = within != nullptr ? &within->medium : nullptr;
    [[maybe_unused]] Medium seen;
    if constexpr (Options::is_spectral) {
      if (solid != nullptr) {
        seen = colors(path).medium(*within);
        solid = &seen;
      }
    }
    MediumSample sample;
    std::optional<MediumAim> aim;
    if (is_met || path.media.empty()) {
      const MediumStretch stretch(path, solid, is_met ? vertex.distance_m : kFar);
      sample = stretch.sample(path);
      if (can_aim(path, stretch)) {
        aim = MediumAim{stretch, stretch.median()};
        add_light_along(path, *aim);
      }
    }
    if (!survives(path, sample.weight)) {
      return false;
    }
    path.beta *= sample.weight;
    if (is_black(path.beta)) {
      return false;
    }
    if (sample.scatterer == nullptr && is_met && vertex.face.is_hole) {
      pass_hole(path, vertex);
      continue;
    }
    if (sample.scatterer == nullptr) {
      if (!is_met) {
        add_environment(path);
      }
      return is_met;
    }
    if (!scatter_within(path, sample, aim ? &*aim : nullptr)) {
      return false;
    }
  }
}

/// Scatters in a medium: light sample, next direction, roulette. Returns false if the path ends.
template <typename Options>
bool PathTracer<Options>::scatter_within(TracedPath& path, const MediumSample& sample,
                                         const MediumAim* aim) const noexcept {
  const Medium& medium = *sample.scatterer;
  const Vec3 before = path.ray.direction;
  const Vec3 point = path.ray.origin + before * sample.distance_m;
  if (!path.out.hit) {
    record_first_scattering(path.out, sample, before);
  }
  if (path.medium_scatterings >= kMediumScatterings * options_.max_depth) {
    return false;
  }
  const Vec4 u_light = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  add_light_within(path, sample, aim, u_light);
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  core::scatter_within(path, medium, point, {u.y, u.z});
  path.in_pair = path.last_controlled = path.last_fitted = false;
  path.u_roulette = -1;
  if (options_.roulette == RouletteType::kNone) {
    return true;
  }
  return survives_roulette(path.beta, u_light.w, continuation_probability(path));
}

template <typename Options>
void PathTracer<Options>::add_light_within(TracedPath& path, const MediumSample& sample,
                                           const MediumAim* aim, Vec4 u) const noexcept {
  if (lights_.empty() || (!samples_lights() && !lights_.has_delta())) {
    return;
  }
  const Vec3 point = path.ray.origin + path.ray.direction * sample.distance_m;
  const LightSample light = samples_lights() ? lights_.sample(point, {}, u.x, {u.y, u.z})
                                             : lights_.sample_delta(point, u.x);
  const DirectLight direct = direct_light(light, [&](Vec3 wi) {
    const float phase = henyey_greenstein(dot(path.ray.direction, wi), sample.scatterer->g);
    return BsdfEval{Rgb(phase), phase};
  });
  if (is_black(direct.value)) {
    return;
  }
  float weight = options_.strategy == Strategy::kMis ? direct.weight(rule(false)) : 1.0F;
  if (aim != nullptr && lights_.is_local(light.light)) {
    const LightPoint on_light = lights_.point_of(light);
    const float along = aim->distances(path, on_light.place).pdf_m(sample.distance_m) *
                        lights_.pdf_measure(on_light, aim->from, {});
    weight *=
        rule(false).weight(aim->stretch.at(sample.distance_m).pdf_m * on_light.pdf_measure, along);
  }
  const Ray shadow{point, light.is_far ? light.wi_world : light.target - point, 0,
                   light.is_far ? kFar : 1.0F};
  credit_medium_light(
      path, shadow,
      path.beta * colors(path).values(direct.value) * (weight / light.pdf_solid_angle),
      light.light);
}

/// Adds the contribution of a light sample in a medium if `shadow` is unoccluded.
template <typename Options>
void PathTracer<Options>::credit_medium_light(TracedPath& path, const Ray& shadow, Rgb value,
                                              std::uint32_t light) const noexcept {
  MediumStack media = path.media;
  media.begin_segment();
  Visibility seen = visibility(scene_, path, shadow, media, ClearSurfaces::kPass, colors(path));
  if (is_black(seen.transmittance) || !survives(path, seen.transmittance)) {
    return;
  }
  credit(path, value * seen.transmittance, path.bounces() + 1,
         [&] { return scene_.group_of_light(light); });
}

/// Returns whether light samples choose their own distances. Not inside smooth boundaries, which
/// occlude lights.
template <typename Options>
bool PathTracer<Options>::can_aim(const TracedPath& path,
                                  const MediumStretch& stretch) const noexcept {
  return aims_in_media_ && stretch.scatters() && samples_lights() && lights_.has_local() &&
         path.medium_scatterings < kMediumScatterings * options_.max_depth &&
         (stretch.is_fog() || path.media.material()->is_clear);
}

/// Takes one light sample for the whole segment, at a distance chosen for the light. MIS combines
/// it with the light samples at the distances where the path scatters, by their densities over
/// distance and light, for the part that phase function samples leave to light samples.
template <typename Options>
void PathTracer<Options>::add_light_along(TracedPath& path, const MediumAim& aim) const noexcept {
  const Vec4 u = path.sampler.get_4d(stretch_group(path.depth));
  const LightPoint light = lights_.point_of(lights_.sample(aim.from, {}, u.x, {u.y, u.z}));
  if (!lights_.is_local(light.light)) {
    return;
  }
  const Equiangular distances = aim.distances(path, light.place);
  if (!distances.is_possible()) {
    return;
  }
  const float distance_m = distances.sample(u.w);
  const MediumStretch::Point at = aim.stretch.at(distance_m);
  const LightView view = lights_.view(light, at.point);
  if (!(view.solid_angle > 0)) {
    return;
  }
  const Medium& medium = aim.stretch.medium();
  const float phase = henyey_greenstein(dot(path.ray.direction, view.wi_world), medium.g);
  const float pdf_along = distances.pdf_m(distance_m) * light.pdf_measure;
  const float pdf_there = lights_.pdf_measure(light, at.point, {});
  float weight = rule(false).weight(pdf_along, at.pdf_m * pdf_there);
  if (!view.is_delta && options_.strategy == Strategy::kMis) {
    weight *= rule(false).weight(pdf_there / view.solid_angle, phase);
  }
  credit_medium_light(path, {at.point, lights_.target(light, view, at.point) - at.point, 0, 1},
                      path.beta * medium.sigma_s * at.passed * colors(path).values(view.radiance) *
                          (at.density * phase * weight * view.solid_angle / pdf_along),
                      light.light);
}

}  // namespace core
