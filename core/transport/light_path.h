/// Paths that begin at a light.
#pragma once

#include <type_traits>

#include "core/light_samplers/emission_sampler.h"
#include "core/materials/adjoint_bsdf.h"
#include "core/samplers/dimensions.h"
#include "core/transport/intersect.h"
#include "core/transport/path_state.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {

/// Starts `path` at a light, with the random numbers of kStartGroup and kAimGroup: its ray, where
/// the ray began, the solids around that place, and its throughput, the emitted power. A throughput
/// of 0: nothing was sampled.
EmissionSample start_light_path(const SceneData& scene, PathState& path,
                                const EmissionSampler& emission) noexcept;

/// A surface that a light path has met.
struct LightVertex {
  const EmissionSample& light;  ///< where the path began
  const PathVertex& surface;
  const ScatterPoint& at;
  const SeenSurface& from_light;
  Rgb power;       ///< that arrives
  bool is_smooth;  ///< every scattering so far
  bool is_sharp;   ///< likewise; smooth ones are
};

/// Starts `path` at a light and follows it to its end; visit(vertex) at each surface, before it
/// scatters there. It may return whether the path goes on.
template <typename Visit>
void follow_light_path(const SceneData& scene, const EmissionSampler& emission, int max_depth,
                       PathState& path, Visit&& visit) {
  const EmissionSample light = start_light_path(scene, path, emission);
  const float first_size = throughput_size(path.beta);
  bool is_smooth = true;
  bool is_sharp = true;
  PathVertex vertex;
  while (first_size > 0 && path.scatterings() < max_depth &&
         path.null_scatterings <= kNullScatteringMax && reach(scene, path, vertex)) {
    const Material& material = scene.materials[vertex.point.material];
    if (material.factors.unlit) {
      return;
    }
    surface_event(scene, path, vertex);
    const BsdfParameters& b = vertex.shading.bsdf;
    const ScatterPoint at = {material, vertex.point,        path.footprint(),
                             b.ior,    b.reflection_weight, b.refraction_weight};
    const SeenSurface from_light(at, vertex.wo_world);
    Rgb power = path.beta;
    if (path.scatterings() == 0) {  // a range ends at the first surface that scatters
      power *= emission.range_factor(light.light, length(vertex.point.position - path.last.origin));
    }
    is_sharp = is_sharp && path.last.is_sharp();
    const LightVertex met = {light, vertex, at, from_light, power, is_smooth, is_sharp};
    if constexpr (std::is_void_v<decltype(visit(met))>) {
      visit(met);
    } else if (!visit(met)) {
      return;
    }
    const int depth = path.depth;
    const Vec4 u = path.sampler.get_4d(dimension_group(depth, BounceGroup::kBsdf));
    const ScatterSample next =
        sample_scatter(at, from_light, u.x, {u.y, u.z}, TransportMode::kImportance);
    if (is_black(next.weight)) {
      return;
    }
    if (!next.is_null) {
      path.beta = power;
    }
    is_smooth = is_smooth && (next.is_delta || next.is_null);
    scatter(scene, path, vertex, next, TransportMode::kImportance);
    if (!survives_roulette(path.beta, path.sampler.get_4d(vertex_group(depth)).z,
                           throughput_size(path.beta) / first_size)) {
      return;
    }
  }
}

}  // namespace core
