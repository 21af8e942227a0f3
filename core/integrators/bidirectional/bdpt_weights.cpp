// All terms are squares of densities, relative to the density of the current strategy.
#include "core/integrators/bidirectional/bdpt_weights.h"

#include <cmath>

#include "core/integrators/registry.h"

namespace core {
namespace {

/// Joint density of the point and direction of an emitted ray, and of its light.
double density(const EmissionPdf& pdf) noexcept {
  return static_cast<double>(pdf.prob_light) * static_cast<double>(pdf.pdf_area) *
         static_cast<double>(pdf.pdf_solid_angle);
}

}  // namespace

BdptWeights::BdptWeights(const IntegratorInput& input, const LightSampler& lights,
                         const EmissionSampler& emission)
    : scene_(input.scene),
      environment_(input.environment),
      camera_(*input.camera),
      lights_(lights),
      emission_(emission),
      light_paths_(static_cast<double>(input.settings.film.width) * input.settings.film.height),
      has_media_(input.scene.has_scattering ||
                 (input.settings.fog && max_component(input.settings.fog->scattering) > 0)),
      connects_(integrator_splats(input.settings)) {}

double BdptWeights::beyond(const PartialSums& sums, double reverse,
                           TransportMode mode) const noexcept {
  const bool is_light = mode == TransportMode::kImportance;
  // Light passes a camera subpath in the reverse direction.
  const bool is_sharp = is_light || is_sharp_density(reverse);
  const double vc = connects_ || is_sharp ? sums.vc : 0;
  return (connects_ || is_light ? sums.vcm : 0) +
         (vc + (is_sharp ? sums.merged_before : 0)) * squared(reverse);
}

PartialSums BdptWeights::from_camera(const Ray& ray) const noexcept {
  return {squared(light_paths_ / camera_density(camera_.importance(ray.origin, ray.direction))), 0};
}

PartialSums BdptWeights::after_scattering(const PartialSums& here, double cosine, double forward,
                                          double reverse, TransportMode mode) const noexcept {
  const double back = squared(cosine / forward);
  const bool is_light = mode == TransportMode::kImportance;
  return {squared(1 / forward), back * (beyond(here, reverse, mode) + (is_light ? here.merged : 0)),
          0, is_light ? 0 : back * here.merged};
}

PartialSums BdptWeights::after_flight(const Subpath& path, Rgb extinction) const noexcept {
  if (!has_media_) {
    return path.sums;
  }
  const double forward = flight_density(path.flight_depth, extinction);
  const double back = flight_density(path.flight_depth, path.last_extinction);
  return forward > 0
             ? PartialSums{path.sums.vcm / squared(forward), path.sums.vc * squared(back / forward),
                           0, path.sums.merged_before * squared(back / forward)}
             : PartialSums{};
}

PartialSums BdptWeights::after_segment(const Subpath& path, const Vertex& vertex) const noexcept {
  const PartialSums sums = after_flight(path, vertex.extinction);
  const Vec3 d = vertex.position() - path.last.origin;
  const double cosine2 = squared(static_cast<double>(vertex.cosine(vertex.wo_world())));
  const double distance4 = squared(static_cast<double>(dot(d, d)));
  return cosine2 > 0 ? PartialSums{sums.vcm * distance4 / cosine2, sums.vc / cosine2, 0,
                                   sums.merged_before / cosine2}
                     : PartialSums{};
}

/// Rays of an orthographic camera do not diverge.
PartialSums BdptWeights::at_camera_vertex(const Subpath& path,
                                          const Vertex& vertex) const noexcept {
  PartialSums sums;
  if (path.bounces() > 0 || !camera_.is_orthographic()) {
    sums = after_segment(path, vertex);
  } else {
    const double cosine2 = squared(static_cast<double>(vertex.cosine(vertex.wo_world())));
    sums.vcm = cosine2 > 0 ? after_flight(path, vertex.extinction).vcm / cosine2 : 0;
  }
  sums.merged = vertex.can_merge() ? path.merged : 0;
  return sums;
}

/// The first vertex determines the density with which its light sample would be the start of the
/// subpath.
PartialSums BdptWeights::at_light_vertex(const Subpath& path, const EmissionSample& light,
                                         const Vertex& vertex) const noexcept {
  if (path.bounces() > 0) {
    PartialSums sums = after_segment(path, vertex);
    sums.merged = path.arrives_sharply() && vertex.can_merge() ? path.merged : 0;
    sums.vcm = connects_ ? sums.vcm : 0;
    return sums;
  }
  const Vec3 d = path.last.origin - vertex.origin();
  const float distance_m = length(d);
  const double emitted = density(light.pdf) * flight(path.flight_depth, vertex.extinction);
  const auto cosine = static_cast<double>(vertex.cosine(vertex.wo_world()));
  if (!(emitted > 0) || !(cosine > 0) || !(distance_m > 0)) {
    return {};
  }
  const bool is_triangle = light.light < scene_.triangle_lights.size();
  const float cos_light = is_triangle ? std::fabs(dot(light.normal, path.ray.direction)) : 1.0F;
  double direct = 0;  // solid-angle density, or the probability of the light for delta lights
  if (light.is_delta_position || light.is_delta_direction) {
    direct = static_cast<double>(
        lights_.prob_light(light.light, vertex.origin(), vertex.light_normal()));
    direct *= light.is_delta_position ? static_cast<double>(dot(d, d)) : 1.0;
  } else if (is_triangle) {
    direct = static_cast<double>(lights_.pdf_triangle(
        light.light, vertex.origin(), vertex.light_normal(), distance_m, cos_light));
    direct *= static_cast<double>(cos_light);
  } else {
    direct = static_cast<double>(
        lights_.pdf_environment(-path.ray.direction, vertex.origin(), vertex.light_normal()));
  }
  const bool is_delta = light.is_delta_position || light.is_delta_direction;
  const double back = static_cast<double>(cos_light) * flight(path.flight_depth, Rgb(1));
  return {squared(direct / (cosine * emitted)), is_delta ? 0 : squared(back / (emitted * cosine))};
}

double BdptWeights::background(const Subpath& path) const noexcept {
  const Vec3 direction = path.ray.direction;
  const auto light =
      static_cast<std::uint32_t>(scene_.triangle_lights.size() + scene_.punctual_lights.size());
  const PartialSums sums = after_flight(path, Rgb(1));
  double others = 0;
  if (sums.vcm > 0) {
    others = squared(static_cast<double>(
                 lights_.pdf_environment(direction, path.last.origin, path.last.light_normal))) *
             sums.vcm;
  }
  if (sums.vc > 0 && !environment_->is_black()) {
    others += squared(density(emission_.pdf(light, path.last.origin, -direction))) * sums.vc;
  }
  return 1 / (1 + others);
}

double BdptWeights::emission(const Subpath& path, const Vertex& vertex) const noexcept {
  const PathVertex& met = vertex.surface;
  const std::uint32_t light = met.point.light;
  const float distance_m = length(met.point.position - path.last.origin);
  const float cos_light = vertex.cosine(met.wo_world);
  const double direct =
      static_cast<double>(lights_.pdf_triangle(light, path.last.origin, path.last.light_normal,
                                               distance_m, cos_light)) *
      static_cast<double>(cos_light) / squared(static_cast<double>(distance_m));
  double others = squared(direct) * vertex.sums.vcm;
  if (vertex.sums.vc > 0) {
    others +=
        squared(density(emission_.pdf(light, met.point.position, met.wo_world))) * vertex.sums.vc;
  }
  return 1 / (1 + others);
}

double BdptWeights::light_sample(const Vertex& vertex, const LightSample& light,
                                 const ScatterEval& f, Rgb flight_depth) const noexcept {
  const auto pdf = static_cast<double>(light.pdf_solid_angle);
  double direct = pdf;
  if (light.is_delta && !light.is_far) {
    const Vec3 d = light.target - vertex.origin();
    direct *= static_cast<double>(dot(d, d));
  } else if (light.triangle != kNoLight) {
    direct *= static_cast<double>(
        std::fabs(dot(scene_.triangle_lights[light.triangle].normal, light.wi_world)));
  }
  double others =
      light.is_delta
          ? 0
          : squared(static_cast<double>(f.pdf_solid_angle) * flight(flight_depth, Rgb(1)) / pdf);
  const double before = beyond(vertex.sums, f.pdf_reverse, TransportMode::kRadiance);
  if (before > 0) {
    const Vec3 on_ray = light.is_far ? vertex.origin() : light.target;
    const double emitted = density(emission_.pdf(light.light, on_ray, -light.wi_world)) *
                           flight(flight_depth, vertex.extinction);
    others +=
        squared(emitted * static_cast<double>(vertex.cosine(light.wi_world)) / direct) * before;
  }
  return 1 / (1 + others);
}

double BdptWeights::splat(const Vertex& vertex, const Camera::ImportanceSample& to,
                          const ScatterEval& f, Rgb flight_depth) const noexcept {
  const double geometry =
      camera_.is_orthographic() ? 1.0 : 1.0 / squared(static_cast<double>(to.distance_m));
  const double from_there = camera_density(to.importance) * geometry *
                            flight(flight_depth, vertex.extinction) *
                            static_cast<double>(vertex.cosine(to.wi_world)) / light_paths_;
  const double others =
      beyond(vertex.sums, f.pdf_reverse, TransportMode::kImportance) + vertex.sums.merged;
  return 1 / (1 + squared(from_there) * others);
}

double BdptWeights::connection(const Vertex& from_camera, const Vertex& from_light, Vec3 wi_world,
                               const ScatterEval& f, const ScatterEval& g,
                               Rgb flight_depth) const noexcept {
  const Vec3 d = from_light.origin() - from_camera.origin();
  const auto distance2 = static_cast<double>(dot(d, d));
  const auto reached = [&](float pdf, const Vertex& at) {
    return squared(static_cast<double>(pdf) * static_cast<double>(at.cosine(wi_world)) / distance2 *
                   flight(flight_depth, at.extinction));
  };
  const bool would_merge = is_sharp_density(static_cast<double>(g.pdf_solid_angle));
  const double others = reached(f.pdf_solid_angle, from_light) *
                            (beyond(from_light.sums, g.pdf_reverse, TransportMode::kImportance) +
                             from_light.sums.merged) +
                        reached(g.pdf_solid_angle, from_camera) *
                            (beyond(from_camera.sums, f.pdf_reverse, TransportMode::kRadiance) +
                             (would_merge ? from_camera.sums.merged : 0));
  return 1 / (1 + others);
}

double BdptWeights::merging(const PartialSums& from_camera, const PartialSums& from_light,
                            const ScatterEval& f) const noexcept {
  const double others = beyond(from_camera, f.pdf_reverse, TransportMode::kRadiance) +
                        beyond(from_light, f.pdf_solid_angle, TransportMode::kImportance);
  return 1 / (1 + others / from_camera.merged);
}

}  // namespace core
