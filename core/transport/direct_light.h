/// Direct light: light samples at a scattering event, and light that a path finds by its direction.
///
/// Next-event estimation draws a light and a point on it, evaluates the scattering towards it and
/// traces a shadow ray; MIS weighs it against the directions sampled from the scattering, which
/// find the same light: the background where they leave the scene, or emission of the surface that
/// they hit. Source: Veach 1997, 9.2; PBR 4th ed., 14.1.2 (SampleLd) and 14.1.3.
///
/// Lights: LightSampler or, if every sample gets its MIS weight, MisLightSampler.
#pragma once

#include <cmath>

#include "core/bsdf/bsdf_types.h"
#include "core/light_samplers/light_sampler.h"
#include "core/materials/shade.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/mis.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"
#include "core/transport/visibility.h"

namespace core {

/// A light sample at a scattering event.
struct DirectLight {
  LightSample light;
  Rgb value{};  ///< scattering times cosine times radiance, without shadow; black: no sample
  float pdf_scatter = 0;  ///< density with which the scattering samples the direction [1/sr]

  /// Returns the MIS weight of `samples` light samples against one direction.
  float weight(MisRule rule, float samples = 1) const noexcept {
    return light.is_delta ? 1.0F : rule.weight(samples * light.pdf_solid_angle, pdf_scatter);
  }
};

/// evaluate(wi_world): the scattering, with a value_cos and a pdf_solid_angle.
template <typename Evaluate>
DirectLight direct_light(const LightSample& light, const Evaluate& evaluate) noexcept {
  DirectLight out{light};
  if (light.pdf_solid_angle > 0 && !is_black(light.radiance)) {
    const auto f = evaluate(light.wi_world);
    out.value = f.value_cos * light.radiance;
    out.pdf_scatter = f.pdf_solid_angle;
  }
  return out;
}

/// Samples the lights at a surface, with the path's random numbers of its vertex.
template <typename Lights, typename Surface>
DirectLight sample_direct_light(const PathState& path, const PathVertex& vertex,
                                const Surface& bsdf, const Lights& lights) noexcept {
  if (lights.empty() || !bsdf.has_spread()) {
    return {};
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  return direct_light(lights.sample(vertex.shading.origin, vertex.light_normal, u.x, {u.y, u.z}),
                      [&](Vec3 wi) { return bsdf.evaluate(vertex.shading.frame.to_local(wi)); });
}

/// Returns what a shadow ray to the light sample lets through; black if the sample has no value.
inline Rgb transmittance_to(const SceneData& scene, PathState& path, const PathVertex& vertex,
                            const DirectLight& direct) noexcept {
  if (is_black(direct.value)) {
    return {};
  }
  const LightSample& light = direct.light;
  return visibility_from(scene, path, vertex, light.wi_world, light.target, light.is_far)
      .transmittance;
}

/// Light that the path's direction has found.
struct FoundLight {
  Rgb radiance;
  /// Light samples at path.last could have found it, with this density of direction [1/sr].
  bool is_sampled = false;
  float pdf_solid_angle = 0;

  /// Returns the MIS weight of the direction against the light samples at path.last.
  float weight(MisRule rule, const LastScattering& last) const noexcept {
    return is_sampled ? rule.weight(last.pdf_bsdf, last.light_samples * pdf_solid_angle) : 1.0F;
  }
};

/// Returns the environment along the path's direction, which left the scene. Filtered unless light
/// samples share it.
template <typename Lights>
FoundLight found_background(const Environment& environment, const Lights& lights,
                            const PathState& path) noexcept {
  const Vec3 direction = path.ray.direction;
  if (!(path.last.pdf_bsdf > 0)) {
    return {environment.background(direction), false, 0};
  }
  return {environment.radiance(direction), true,
          lights.pdf_environment(direction, path.last.origin, path.last.light_normal)};
}

/// Returns the emission of the surface that the path has hit, along the path: of an unlit material
/// its colour. Filtered likewise.
template <typename Lights>
FoundLight found_emission(const SceneData& scene, const Lights& lights, const PathState& path,
                          const PathVertex& vertex) noexcept {
  const SurfacePoint& point = vertex.point;
  const Material& material = scene.materials[point.material];
  const bool is_sampled = path.last.pdf_bsdf > 0 && point.light != kNoLight;
  if (!is_sampled && material.factors.unlit) {
    return {unlit_color(material, point, vertex.wo_world, path.footprint()), false, 0};
  }
  FoundLight out = {emitted(material, point, vertex.wo_world), is_sampled, 0};
  if (is_sampled && !is_black(out.radiance)) {
    const float cos_light = std::fabs(dot(point.normal_geometric, vertex.wo_world));
    out.pdf_solid_angle = lights.pdf_triangle(point.light, path.last.origin, path.last.light_normal,
                                              length(point.position - path.last.origin), cos_light);
  }
  return out;
}

}  // namespace core
