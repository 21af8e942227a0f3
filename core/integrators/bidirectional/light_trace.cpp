// Light tracing: particles leave the lights, and every surface that they hit is connected to the
// camera. Connections cannot find light seen directly, or by a delta lobe of the first surface:
// camera paths contribute exactly that light and light paths the rest, so both add up to the image
// without weights. Source: Veach 1997, 8.3 and 10.2 (t = 1); PBR 3rd ed. 16.1.2, Dutre, Lafortune
// and Willems 1993.
#include "core/integrators/path/path_tracer.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/samplers/dimensions.h"
#include "core/transport/light_path.h"
#include "core/transport/scatter.h"

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
  void connect(PathState& path, const LightVertex& vertex, CameraSplats& splats) const noexcept;

  const SceneData& scene_;
  EmissionSampler emission_;
  PathTracer<DefaultOptions> camera_paths_;
  int max_depth_;
};

PathSample LightTracer::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                              std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  PathVertex vertex;
  if (!camera_paths_.next_vertex(path, vertex)) {
    return path.out;
  }
  const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
  if (camera_paths_.visit(path, vertex, bsdf) && scatter_delta(scene_, path, vertex, bsdf) &&
      path.scatterings() <= max_depth_) {
    camera_paths_.follow(path);
  }
  return path.out;
}

void LightTracer::trace_light(const PathSampler& sampler, std::uint64_t& rays,
                              CameraSplats& splats) const noexcept {
  PathState path = start_path(sampler, rays);
  follow_light_path(scene_, emission_, max_depth_, path,
                    [&](const LightVertex& vertex) { connect(path, vertex, splats); });
}

void LightTracer::connect(PathState& path, const LightVertex& vertex,
                          CameraSplats& splats) const noexcept {
  if (!vertex.from_light.bsdf().has_spread()) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(vertex_group(path.depth));
  const Camera::ImportanceSample to =
      splats.camera().sample_wi(vertex.surface.shading.origin, {u.x, u.y});
  if (!(to.pdf_solid_angle > 0) || !splats.reaches(to.importance.film_px)) {
    return;
  }
  const SeenSurface from_camera(vertex.at, to.wi_world);
  const Rgb f =
      evaluate_scatter(vertex.from_light, from_camera, TransportMode::kImportance).value_cos;
  if (is_black(f)) {
    return;
  }
  const Visibility seen = visibility_from(scene_, path, vertex.surface, to.wi_world, to.origin,
                                          false, ClearSurfaces::kBlock);
  splats.add(to.importance.film_px,
             vertex.power * f * seen.transmittance * (to.importance.we / to.pdf_solid_angle));
}

}  // namespace

std::unique_ptr<const Integrator> make_light_tracer(const IntegratorInput& input) {
  return std::make_unique<LightTracer>(input);
}

}  // namespace core
