// Light tracing: particles leave the lights, and every surface that one meets is connected to the
// camera. What the camera sees directly, and what reaches it by a delta lobe of the first surface,
// no connection finds: camera paths bring exactly that, and light paths the rest, so that both add
// up to the picture without weights.
// Source: Veach 1997, 8.3 and 10.2 (t = 1); PBR 3rd ed. 16.1.2, Dutre, Lafortune and Willems 1993.
#include "core/integrators/path_tracer.h"
#include "core/integrators/registry.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/materials/adjoint_bsdf.h"
#include "core/samplers/dimensions.h"
#include "core/transport/intersect.h"
#include "core/transport/light_path.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

class LightTracer final : public Integrator {
 public:
  explicit LightTracer(const IntegratorInput& input)
      : scene_(input.scene),
        emission_(input.scene, input.environment),
        camera_paths_(input),
        max_depth_(input.settings.max_depth) {}

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;
  void trace_light(const PathSampler& sampler, std::uint64_t& rays,
                   CameraSplats& splats) const noexcept override;

 private:
  /// power: that arrives at the vertex.
  void connect(PathState& path, Rgb power, const PathVertex& vertex, const ScatterPoint& at,
               const SeenSurface& from_light, CameraSplats& splats) const noexcept;
  bool extend(PathState& path, Rgb power, const PathVertex& vertex, const ScatterPoint& at,
              const SeenSurface& from_light) const noexcept;

  const SceneData& scene_;
  EmissionSampler emission_;
  PathTracer<DefaultOptions> camera_paths_;
  int max_depth_;
};

PathSample LightTracer::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                              std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(camera_ray, sampler, rays)};
  PathVertex vertex;
  if (!camera_paths_.next_vertex(path, vertex)) {
    return path.out;
  }
  const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
  if (!camera_paths_.visit(path, vertex, bsdf) || !(bsdf.prob_delta() > 0)) {
    return path.out;
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  const BsdfSample sample = bsdf.sample_delta(u.x, {u.y, u.z});
  if (!is_black(sample.weight)) {
    scatter(scene_, path, vertex, sample, 1);
    if (path.scatterings() <= max_depth_) {
      camera_paths_.follow(path);
    }
  }
  return path.out;
}

void LightTracer::trace_light(const PathSampler& sampler, std::uint64_t& rays,
                              CameraSplats& splats) const noexcept {
  PathState path = start_path({}, sampler, rays);
  const EmissionSample light = start_light_path(path, emission_);
  const float first_size = throughput_size(path.beta);
  PathVertex vertex;
  while (first_size > 0 && path.scatterings() < max_depth_ &&
         path.null_scatterings <= kNullScatteringMax && intersect(scene_, path, vertex)) {
    path.beta *= segment_transmittance(scene_, path, vertex);
    const Material& material = scene_.materials[vertex.point.material];
    if (material.factors.unlit) {
      return;
    }
    surface_event(scene_, path, vertex);
    const BsdfParameters& b = vertex.shading.bsdf;
    const ScatterPoint at = {material, vertex.point,        path.footprint(),
                             b.ior,    b.reflection_weight, b.refraction_weight};
    const SeenSurface from_light(at, vertex.wo_world);
    Rgb power = path.beta;
    if (path.scatterings() == 0) {  // a range ends at the first surface that scatters
      power *=
          emission_.range_factor(light.light, length(vertex.point.position - path.last.origin));
    }
    connect(path, power, vertex, at, from_light, splats);
    const int depth = path.depth;
    if (!extend(path, power, vertex, at, from_light) ||
        !survives_roulette(path, path.sampler.get_4d(vertex_group(depth)).z,
                           throughput_size(path.beta) / first_size)) {
      return;
    }
  }
}

void LightTracer::connect(PathState& path, Rgb power, const PathVertex& vertex,
                          const ScatterPoint& at, const SeenSurface& from_light,
                          CameraSplats& splats) const noexcept {
  if (!from_light.bsdf().has_spread()) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(vertex_group(path.depth));
  const Camera::ImportanceSample to = splats.camera().sample_wi(vertex.shading.origin, {u.x, u.y});
  if (!(to.pdf_solid_angle > 0) || !splats.reaches(to.importance.film_px)) {
    return;
  }
  const SeenSurface from_camera(at, to.wi_world);
  const Rgb f = evaluate_scatter(from_light, from_camera, TransportMode::kImportance).value_cos;
  if (is_black(f)) {
    return;
  }
  const Visibility seen =
      visibility_from(scene_, path, vertex, to.wi_world, to.origin, false, ClearSurfaces::kBlock);
  splats.add(to.importance.film_px,
             power * f * seen.transmittance * (to.importance.we / to.pdf_solid_angle));
}

/// False: the path is over.
bool LightTracer::extend(PathState& path, Rgb power, const PathVertex& vertex,
                         const ScatterPoint& at, const SeenSurface& from_light) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  const ScatterSample next =
      sample_scatter(at, from_light, u.x, {u.y, u.z}, TransportMode::kImportance);
  if (is_black(next.weight)) {
    return false;
  }
  if (!next.is_straight) {
    path.beta = power;
  }
  scatter(scene_, path, vertex, next, TransportMode::kImportance);
  return true;
}

}  // namespace

std::unique_ptr<const Integrator> make_light_tracer(const IntegratorInput& input) {
  return std::make_unique<LightTracer>(input);
}

}  // namespace core
