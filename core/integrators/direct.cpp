// Direct lighting: emission of the surfaces seen by the camera, and their direct light. Shows how
// little an integrator needs besides core/transport.
#include <cmath>

#include "core/integrators/registry.h"
#include "core/light_samplers/light_sampler.h"
#include "core/lights/backdrop.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/mis.h"
#include "core/transport/intersect.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"
#include "core/transport/visibility.h"

namespace core {
namespace {

constexpr MisRule kMis{MisType::kPower, 2};

class DirectIntegrator final : public Integrator {
 public:
  explicit DirectIntegrator(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        lights_(input.scene, input.environment, LightSamplerType::kTree, SkyDensity::kCompensated) {
  }

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;

 private:
  Rgb background(const PathState& path) const noexcept;
  Rgb emission(const PathState& path, const PathVertex& vertex) const noexcept;
  Rgb light_sample(PathState& path, const PathVertex& vertex, const Bsdf& bsdf) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  LightSampler lights_;
};

/// Returns the environment's radiance along the path's ray, with its MIS weight against light
/// samples of the last vertex.
Rgb DirectIntegrator::background(const PathState& path) const noexcept {
  if (environment_ == nullptr) {
    return {};
  }
  const Vec3 direction = path.ray.direction;
  if (!(path.last.pdf_bsdf > 0)) {
    return environment_->background(direction);
  }
  return environment_->radiance(direction) *
         kMis.weight(path.last.pdf_bsdf,
                     lights_.pdf_environment(direction, path.last.origin, path.last.light_normal));
}

Rgb DirectIntegrator::emission(const PathState& path, const PathVertex& vertex) const noexcept {
  const Rgb radiance =
      emitted(scene_.materials[vertex.point.material], vertex.point, vertex.wo_world);
  if (is_black(radiance) || !(path.last.pdf_bsdf > 0) || vertex.point.light == kNoLight) {
    return radiance;
  }
  const float distance_m = length(vertex.point.position - path.last.origin);
  const float cos_light = std::fabs(dot(vertex.point.normal_geometric, vertex.wo_world));
  return radiance *
         kMis.weight(path.last.pdf_bsdf,
                     lights_.pdf_triangle(vertex.point.light, path.last.origin,
                                          path.last.light_normal, distance_m, cos_light));
}

Rgb DirectIntegrator::light_sample(PathState& path, const PathVertex& vertex,
                                   const Bsdf& bsdf) const noexcept {
  if (!bsdf.has_spread() || lights_.empty()) {
    return {};
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  const LightSample light =
      lights_.sample(vertex.shading.origin, vertex.light_normal, u.x, {u.y, u.z});
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return {};
  }
  const BsdfEval f = bsdf.evaluate(vertex.shading.frame.to_local(light.wi_world));
  const bool is_page = path.is_clear && backdrop_.is_through_glass() && is_environment(light) &&
                       passes_clear(vertex, light.wi_world);
  if (is_black(f.value_cos) || is_page) {
    return {};
  }
  const float weight =
      light.is_delta ? 1.0F : kMis.weight(light.pdf_solid_angle, f.pdf_solid_angle);
  const Visibility seen =
      visibility_from(scene_, path, vertex, light.wi_world, light.target, light.is_far);
  return f.value_cos * light.radiance * seen.transmittance * (weight / light.pdf_solid_angle);
}

PathSample DirectIntegrator::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                   std::uint64_t& rays) const noexcept {
  PathSample out;
  PathState path = start_path(camera_ray, sampler, rays);
  PathVertex vertex;
  while (true) {
    if (!intersect(scene_, path, vertex)) {
      if (backdrop_.is_seen(path.depth, path.is_clear)) {
        const std::optional<Rgb> seen = backdrop_.seen(path.ray.direction);
        out.alpha -= seen ? 0.0F : luminance(path.beta);
        out.radiance += path.beta * seen.value_or(Rgb{});
      } else {
        out.radiance += path.beta * background(path);
      }
      return out;
    }
    path.beta *= segment_transmittance(scene_, path, vertex);
    const Material& material = scene_.materials[vertex.point.material];
    if (material.factors.unlit) {
      const Rgb color = unlit_color(material, vertex.point, vertex.wo_world, path.footprint());
      if (!out.hit) {
        vertex.shading.frame.n = vertex.point.normal_shading;
        record_first_surface(out, vertex, color);
      }
      out.radiance += path.beta * color;
      return out;
    }
    surface_event(scene_, path, vertex);
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!out.hit) {
      record_first_surface(out, vertex, bsdf.albedo());
    }
    out.radiance += path.beta * emission(path, vertex);
    const bool is_last = path.scatterings() >= 1;  // clear surfaces may still be passed
    if (path.null_scatterings > kNullScatteringMax || (is_last && is_black(bsdf.straight()))) {
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
    return make_path_tracer(input);  // the same at max_depth 1
  }
  return std::make_unique<DirectIntegrator>(input);
}

}  // namespace core
