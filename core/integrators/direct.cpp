// Direct lighting: emission of the surfaces seen by the camera, and their direct light. Shows how
// little an integrator needs besides core/transport.
#include "core/integrators/integrator.h"
#include "core/integrators/registry.h"
#include "core/lights/backdrop.h"
#include "core/samplers/dimensions.h"
#include "core/transport/direct_light.h"
#include "core/transport/intersect.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

constexpr MisRule kMis{MisType::kPower, 2};

class DirectIntegrator final : public Integrator {
 public:
  explicit DirectIntegrator(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        lights_(input.scene, input.environment, LightPick::kTree, SkyDensity::kCompensated) {}

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;

 private:
  Rgb light_sample(PathState& path, const PathVertex& vertex, const Bsdf& bsdf) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  MisLightSampler lights_;
};

Rgb DirectIntegrator::light_sample(PathState& path, const PathVertex& vertex,
                                   const Bsdf& bsdf) const noexcept {
  const DirectLight direct = sample_direct_light(path, vertex, bsdf, lights_);
  const LightSample& light = direct.light;
  const bool is_page = path.is_clear && backdrop_.is_through_glass() && is_environment(light) &&
                       passes_clear(vertex, light.wi_world);
  const Rgb open = is_page ? Rgb{} : transmittance_to(scene_, path, vertex, direct);
  return is_black(open) ? open
                        : direct.value * open * (direct.weight(kMis) / light.pdf_solid_angle);
}

PathSample DirectIntegrator::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                   std::uint64_t& rays) const noexcept {
  PathSample out;
  PathState path = start_path(scene_, camera_ray, sampler, rays);
  PathVertex vertex;
  while (true) {
    if (!reach(scene_, path, vertex)) {
      if (backdrop_.is_seen(path.depth, path.is_clear)) {
        const std::optional<Rgb> seen = backdrop_.seen(path.ray.direction);
        out.alpha -= seen ? 0.0F : luminance(path.beta);
        out.radiance += path.beta * seen.value_or(Rgb{});
      } else if (environment_ != nullptr) {
        const FoundLight found = found_background(*environment_, lights_, path);
        out.radiance += path.beta * found.radiance * found.weight(kMis, path.last);
      }
      return out;
    }
    const FoundLight found = found_emission(scene_, lights_, path, vertex);
    out.radiance += path.beta * found.radiance * found.weight(kMis, path.last);
    if (scene_.materials[vertex.point.material].factors.unlit) {
      if (!out.hit) {
        vertex.shading.frame.n = vertex.point.normal_shading;
        record_first_surface(out, vertex, found.radiance);
      }
      return out;
    }
    surface_event(scene_, path, vertex);
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!out.hit) {
      record_first_surface(out, vertex, bsdf.albedo());
    }
    const bool is_last = path.scatterings() >= 1;  // clear surfaces may still be passed
    if (path.null_scatterings > kNullScatteringMax ||
        (is_last && is_black(bsdf.null_transmittance()))) {
      return out;
    }
    vertex.light_normal = bsdf.transmits() ? Vec3{} : vertex.shading.horizon;
    if (!is_last) {
      out.radiance += path.beta * light_sample(path, vertex, bsdf);
    }
    const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
    const BsdfSample sample = bsdf.sample(u.x, {u.y, u.z});
    if (is_black(sample.weight)) {
      return out;
    }
    scatter(scene_, path, vertex, sample, 1);
    if (path.scatterings() > 1) {
      return out;
    }
  }
}

}  // namespace

std::unique_ptr<const Integrator> make_direct(const IntegratorInput& input) {
  if (input.settings.spectral) {
    return find_integrator("path")->make(input);  // the same at max_depth 1
  }
  return std::make_unique<DirectIntegrator>(input);
}

}  // namespace core
