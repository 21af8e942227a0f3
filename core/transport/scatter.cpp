#include "core/transport/scatter.h"

#include <algorithm>

#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/transport/roulette.h"

namespace core {

void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const BsdfSample& sample, float light_samples) noexcept {
  const Vec3 n = vertex.shading.normal_geometric;
  const Vec3 wi = vertex.shading.frame.to_world(sample.wi_local);
  const bool through = dot(wi, vertex.shading.horizon) < 0;
  path.beta *= sample.weight;
  path.is_clear = path.is_clear && through && (sample.is_delta || passes_clear(vertex, wi));
  if (vertex.drew_wavelength && !through) {
    path.wavelength_nm = 0;  // only refraction disperses
  }
  if (sample.is_null) {
    ++path.null_scatterings;  // path.last stays: emitters are weighted as seen from there
  } else {
    path.last = {sample.is_delta ? 0.0F : sample.pdf_solid_angle, vertex.shading.origin,
                 vertex.light_normal, light_samples};
  }
  path.eta_scale *= sample.eta * sample.eta;
  path.ray.origin = offset_ray(vertex.shading.origin, through ? -n : n, vertex.point.error_m);
  path.ray.direction = wi;
  path.ray.t_max = Ray{}.t_max;
  if (scene.has_volumes) {
    if (through && vertex.face.solid != nullptr) {
      path.media = vertex.beyond;
    }
    path.media.begin_segment(vertex.face);
    path.solid_holes = 0;
    path.passed_m = 0;
  }
  if (!sample.is_delta) {
    path.cone_spread_rad +=
        kConeSpreadOfWidth * std::max(vertex.shading.bsdf.alpha_x, vertex.shading.bsdf.alpha_y);
    path.is_sharp = false;
  }
  ++path.depth;
  path.alpha_tests = 0;  // numbers are by depth too
}

void scatter(const SceneData& scene, PathState& path, const PathVertex& vertex,
             const ScatterSample& sample, TransportMode mode) noexcept {
  BsdfSample local;
  local.wi_local = vertex.shading.frame.to_local(sample.wi_world);
  local.weight = sample.weight;
  local.pdf_solid_angle = sample.pdf_solid_angle;
  local.is_delta = sample.is_delta;
  local.is_null = sample.is_null;
  local.eta = mode == TransportMode::kRadiance ? sample.eta : 1.0F;
  scatter(scene, path, vertex, local, 1);
}

bool scatter_delta(const SceneData& scene, PathState& path, const PathVertex& vertex,
                   const Bsdf& bsdf) noexcept {
  if (!(bsdf.prob_delta() > 0)) {
    return false;
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  const BsdfSample sample = bsdf.sample_delta(u.x, {u.y, u.z});
  if (is_black(sample.weight)) {
    return false;
  }
  scatter(scene, path, vertex, sample, 1);
  return true;
}

float continuation_probability(const PathState& path) noexcept {
  return continuation_probability(throughput_size(path.beta) * path.eta_scale, path.last.pdf_bsdf);
}

}  // namespace core
