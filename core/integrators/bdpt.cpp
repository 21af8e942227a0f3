// Bidirectional path tracing: subpaths from the camera and from the lights, each vertex of one
// connected to each of the other. Strategies (s, t) have s vertices of the light's subpath and t of
// the camera's; those with t = 1 splat (trace_light(), a light subpath of its own), the others add
// to the pixel of the camera's path. Weights are the power heuristic over all strategies, carried
// along both subpaths as two partial sums. Surfaces that a path passes straight are no vertices.
//
// Sources: Veach 1997, ch. 10; the partial sums: van Antwerpen 2011, "Recursive MIS computation for
// streaming BDPT on the GPU", and Georgiev 2012, "Implementing vertex connection and merging".
// Dispersion is left out: both subpaths would need the same wavelength.
// Russian roulette and the random choice of straight passes stay out of the weights, which need the
// same value for the same path in every strategy, not exact densities.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <list>
#include <memory_resource>
#include <optional>

#include "core/integrators/bdpt_vertex.h"
#include "core/integrators/light_ledger.h"
#include "core/integrators/registry.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/light_samplers/light_sampler.h"
#include "core/lights/backdrop.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/transport/intersect.h"
#include "core/transport/light_path.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"
#include "core/transport/visibility.h"

namespace core {
namespace {

class BidirectionalPathTracer final : public Integrator {
 public:
  explicit BidirectionalPathTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        camera_(*input.camera),
        lights_(input.scene, input.environment, LightSamplerType::kTree),
        emission_(input.scene, input.environment),
        ledger_(input),
        max_depth_(input.settings.max_depth),
        light_paths_(static_cast<double>(input.settings.film.width) * input.settings.film.height) {}

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override {
    return trace_shares(camera_ray, sampler, rays, {});
  }
  PathSample trace_shares(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                          std::uint64_t& rays, std::span<Rgb> shares) const noexcept override;
  void trace_light(const PathSampler& sampler, std::uint64_t& rays,
                   CameraSplats& splats) const noexcept override;

 private:
  /// Follows a light subpath; visit(path, vertex) for each of its vertices.
  template <typename Visit>
  void follow_light(Subpath& path, Visit& visit) const noexcept;
  PartialSums after_light(const Subpath& path, const EmissionSample& light,
                          const Vertex& vertex) const noexcept;
  PartialSums after_camera(const Subpath& path, const Vertex& vertex) const noexcept;
  PartialSums after_segment(const Subpath& path, const Vertex& vertex) const noexcept;
  bool extend(Subpath& path, const Vertex& vertex, TransportMode mode) const noexcept;

  /// Adds light to the picture, and to its shares.
  void credit(CameraSubpath& path, const Found& found, const LightOrigin& from) const noexcept;
  std::uint32_t group_at(const PathVertex& met) const noexcept {
    return scene_.placed[met.point.placed].group;
  }
  Found background(const Subpath& path) const noexcept;
  Found emission(const Subpath& path, const Vertex& vertex) const noexcept;
  void add_light_sample(CameraSubpath& path, const Vertex& vertex) const noexcept;
  Found connection(Subpath& path, const Vertex& vertex, const Vertex& from_light) const noexcept;
  void splat(Subpath& path, const Vertex& vertex, CameraSplats& splats) const noexcept;
  double camera_density(const Camera::Importance& importance) const noexcept {
    return static_cast<double>(camera_.is_orthographic() ? importance.pdf_area
                                                         : importance.pdf_solid_angle);
  }

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  const Camera& camera_;
  LightSampler lights_;
  EmissionSampler emission_;
  LightLedger ledger_;
  int max_depth_;
  double light_paths_;  ///< one for each pixel of the full film
};

/// Joint density of the point and direction of an emitted ray, and of its light.
double density(const EmissionPdf& pdf) noexcept {
  return static_cast<double>(pdf.prob_light) * static_cast<double>(pdf.pdf_area) *
         static_cast<double>(pdf.pdf_solid_angle);
}

PartialSums BidirectionalPathTracer::after_segment(const Subpath& path,
                                                   const Vertex& vertex) const noexcept {
  const Vec3 d = vertex.surface.point.position - path.last.origin;
  const double cosine2 = squared(static_cast<double>(vertex.cosine(vertex.surface.wo_world)));
  const double distance4 = squared(static_cast<double>(dot(d, d)));
  return cosine2 > 0 ? PartialSums{path.sums.vcm * distance4 / cosine2, path.sums.vc / cosine2}
                     : PartialSums{};
}

/// At the first vertex of the camera's subpath; rays of an orthographic camera do not diverge.
PartialSums BidirectionalPathTracer::after_camera(const Subpath& path,
                                                  const Vertex& vertex) const noexcept {
  if (path.scatterings() > 0 || !camera_.is_orthographic()) {
    return after_segment(path, vertex);
  }
  const double cosine2 = squared(static_cast<double>(vertex.cosine(vertex.surface.wo_world)));
  return {cosine2 > 0 ? path.sums.vcm / cosine2 : 0, 0};
}

/// At the first vertex of a light's subpath, where it is known how likely a light sample of that
/// vertex is to be the point that the subpath began at.
PartialSums BidirectionalPathTracer::after_light(const Subpath& path, const EmissionSample& light,
                                                 const Vertex& vertex) const noexcept {
  if (path.scatterings() > 0) {
    return after_segment(path, vertex);
  }
  const Vec3 d = path.last.origin - vertex.origin();
  const float distance_m = length(d);
  const double emitted = density(light.pdf);
  const auto cosine = static_cast<double>(vertex.cosine(vertex.surface.wo_world));
  if (!(emitted > 0) || !(cosine > 0) || !(distance_m > 0)) {
    return {};
  }
  const bool is_triangle = light.light < scene_.triangle_lights.size();
  const float cos_light = is_triangle ? std::fabs(dot(light.normal, path.ray.direction)) : 1.0F;
  double direct = 0;  // in solid angle, or of the pick alone
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
  return {squared(direct / (cosine * emitted)),
          is_delta ? 0 : squared(static_cast<double>(cos_light) / (emitted * cosine))};
}

/// Samples the next direction, with roulette. False: the path is over.
bool BidirectionalPathTracer::extend(Subpath& path, const Vertex& vertex,
                                     TransportMode mode) const noexcept {
  const int depth = path.depth;
  const Vec4 u = path.sampler.get_4d(dimension_group(depth, BounceGroup::kBsdf));
  const ScatterSample next = sample_scatter(vertex.at, vertex.seen, u.x, {u.y, u.z}, mode);
  if (is_black(next.weight)) {
    return false;
  }
  if (!next.is_straight) {
    const auto cosine = static_cast<double>(vertex.cosine(next.wi_world));
    const PartialSums& here = vertex.sums;
    if (next.is_delta) {
      path.sums = {0, here.vc * squared(cosine)};
    } else {
      const auto forward = static_cast<double>(next.pdf_solid_angle);
      path.sums = {squared(1 / forward),
                   squared(cosine / forward) *
                       (here.vc * squared(static_cast<double>(next.pdf_reverse)) + here.vcm)};
    }
    path.beta = vertex.beta;
  }
  scatter(scene_, path, vertex.surface, next, mode);
  return path.null_scatterings <= kNullScatteringMax;
}

template <typename Visit>
void BidirectionalPathTracer::follow_light(Subpath& path, Visit& visit) const noexcept {
  const EmissionSample light = start_light_path(path, emission_);
  const float first_size = throughput_size(path.beta);
  PathVertex met;
  while (first_size > 0 && path.scatterings() < max_depth_ && intersect(scene_, path, met)) {
    path.beta *= segment_transmittance(scene_, path, met);
    if (scene_.materials[met.point.material].factors.unlit) {
      return;
    }
    surface_event(scene_, path, met);
    Vertex& vertex = visit.place(path, met);
    if (path.scatterings() == 0) {
      vertex.beta *=
          emission_.range_factor(light.light, length(met.point.position - path.last.origin));
    }
    vertex.light = light.light;
    vertex.sums = after_light(path, light, vertex);
    visit(path, vertex);
    const int depth = path.depth;
    if (!extend(path, vertex, TransportMode::kImportance) ||
        !survives_roulette(path, path.sampler.get_4d(vertex_group(depth)).z,
                           throughput_size(path.beta) / first_size)) {
      return;
    }
  }
}

void BidirectionalPathTracer::splat(Subpath& path, const Vertex& vertex,
                                    CameraSplats& splats) const noexcept {
  if (!vertex.seen.bsdf().has_spread()) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(vertex_group(path.depth));
  const Camera::ImportanceSample to = splats.camera().sample_wi(vertex.origin(), {u.x, u.y});
  if (!(to.pdf_solid_angle > 0) || !splats.reaches(to.importance.film_px)) {
    return;
  }
  const SeenSurface from_camera(vertex.at, to.wi_world);
  const ScatterEval f = evaluate_scatter(vertex.seen, from_camera, TransportMode::kImportance);
  if (is_black(f.value_cos)) {
    return;
  }
  const double falloff =
      camera_.is_orthographic() ? 1.0 : 1.0 / squared(static_cast<double>(to.distance_m));
  const double from_there = camera_density(to.importance) * falloff *
                            static_cast<double>(vertex.cosine(to.wi_world)) / light_paths_;
  const double others =
      squared(from_there) *
      (vertex.sums.vcm + vertex.sums.vc * squared(static_cast<double>(f.pdf_reverse)));
  const Visibility seen =
      visibility_from(scene_, path, vertex.surface, to.wi_world, to.origin, false);
  const auto weight = static_cast<float>(1 / (1 + others));
  const Found found = {vertex.beta * f.value_cos * seen.transmittance *
                           (weight * to.importance.we / to.pdf_solid_angle),
                       weight};
  splats.add(to.importance.film_px, found.value);
  if (!ledger_.empty() && !is_black(found.value)) {
    ledger_.each(
        {vertex.scatterings + 1, scene_.group_of_light(vertex.light), {vertex.scatterings + 2, 1}},
        [&](std::size_t share, bool is_weighted) {
          splats.add_to_share(to.importance.film_px, share,
                              is_weighted ? found.value : found.unweighted());
        });
  }
}

void BidirectionalPathTracer::trace_light(const PathSampler& sampler, std::uint64_t& rays,
                                          CameraSplats& splats) const noexcept {
  struct Visit {
    const BidirectionalPathTracer& owner;
    CameraSplats& splats;
    std::optional<Vertex> vertex{};
    Vertex& place(const PathState& path, const PathVertex& met) {
      return vertex.emplace(owner.scene_, path, met);
    }
    void operator()(Subpath& path, const Vertex& at) { owner.splat(path, at, splats); }
  };
  Subpath path{start_path({}, sampler, rays)};
  Visit visit{*this, splats};
  follow_light(path, visit);
}

void BidirectionalPathTracer::credit(CameraSubpath& path, const Found& found,
                                     const LightOrigin& from) const noexcept {
  path.out.radiance += found.value;
  if (!path.shares.empty() && !is_black(found.value)) {
    ledger_.each(from, [&](std::size_t share, bool is_weighted) {
      path.shares[share] += is_weighted ? found.value : found.unweighted();
    });
  }
}

Found BidirectionalPathTracer::background(const Subpath& path) const noexcept {
  const Vec3 direction = path.ray.direction;
  if (path.scatterings() == 0) {
    return {environment_->background(direction)};
  }
  const auto light =
      static_cast<std::uint32_t>(scene_.triangle_lights.size() + scene_.punctual_lights.size());
  const double others =
      squared(static_cast<double>(
          lights_.pdf_environment(direction, path.last.origin, path.last.light_normal))) *
          path.sums.vcm +
      squared(environment_->is_black() ? 0 : density(emission_.pdf(light, -direction))) *
          path.sums.vc;
  const bool is_seen = path.last.pdf_bsdf > 0;
  const auto weight = static_cast<float>(1 / (1 + others));
  return {
      (is_seen ? environment_->radiance(direction) : environment_->background(direction)) * weight,
      weight};
}

/// What the surface emits towards the camera's subpath.
Found BidirectionalPathTracer::emission(const Subpath& path, const Vertex& vertex) const noexcept {
  const PathVertex& met = vertex.surface;
  const Rgb radiance = emitted(vertex.at.material, met.point, met.wo_world);
  const std::uint32_t light = met.point.light;
  if (is_black(radiance) || path.scatterings() == 0 || light == kNoLight) {
    return {radiance};
  }
  const float distance_m = length(met.point.position - path.last.origin);
  const float cos_light = vertex.cosine(met.wo_world);
  const double direct =
      static_cast<double>(lights_.pdf_triangle(light, path.last.origin, path.last.light_normal,
                                               distance_m, cos_light)) *
      static_cast<double>(cos_light) / squared(static_cast<double>(distance_m));
  const double others = squared(direct) * vertex.sums.vcm +
                        squared(density(emission_.pdf(light, met.wo_world))) * vertex.sums.vc;
  const auto weight = static_cast<float>(1 / (1 + others));
  return {radiance * weight, weight};
}

void BidirectionalPathTracer::add_light_sample(CameraSubpath& path,
                                               const Vertex& vertex) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  const LightSample light = lights_.sample(vertex.origin(), vertex.light_normal(), u.x, {u.y, u.z});
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return;
  }
  const SeenSurface from_light(vertex.at, light.wi_world);
  const ScatterEval f = evaluate_scatter(vertex.seen, from_light, TransportMode::kRadiance);
  if (is_black(f.value_cos)) {
    return;
  }
  const auto pdf = static_cast<double>(light.pdf_solid_angle);
  double direct = pdf;
  if (light.is_delta && !light.is_far) {
    const Vec3 d = light.target - vertex.origin();
    direct *= static_cast<double>(dot(d, d));
  } else if (light.triangle != kNoLight) {
    direct *= static_cast<double>(
        std::fabs(dot(scene_.triangle_lights[light.triangle].normal, light.wi_world)));
  }
  const double emitted = density(emission_.pdf(light.light, -light.wi_world));
  const double by_bsdf = light.is_delta ? 0 : squared(static_cast<double>(f.pdf_solid_angle) / pdf);
  const double others =
      by_bsdf +
      squared(emitted * static_cast<double>(vertex.cosine(light.wi_world)) / direct) *
          (vertex.sums.vcm + vertex.sums.vc * squared(static_cast<double>(f.pdf_reverse)));
  const Visibility seen =
      visibility_from(scene_, path, vertex.surface, light.wi_world, light.target, light.is_far);
  const auto weight = static_cast<float>(1 / (1 + others));
  credit(path,
         {vertex.beta * f.value_cos * light.radiance * seen.transmittance *
              (weight / light.pdf_solid_angle),
          weight},
         {vertex.scatterings + 1, scene_.group_of_light(light.light), {1, vertex.scatterings + 2}});
}

/// Of a vertex of the camera's subpath with one of the light's.
Found BidirectionalPathTracer::connection(Subpath& path, const Vertex& vertex,
                                          const Vertex& from_light) const noexcept {
  const Vec3 d = from_light.origin() - vertex.origin();
  const float distance2 = dot(d, d);
  if (!(distance2 > 0)) {
    return {};
  }
  const Vec3 wi = d * (1 / std::sqrt(distance2));
  const SeenSurface here(vertex.at, wi);
  const ScatterEval f = evaluate_scatter(vertex.seen, here, TransportMode::kRadiance);
  if (is_black(f.value_cos)) {
    return {};
  }
  const SeenSurface there(from_light.at, -wi);
  const ScatterEval g = evaluate_scatter(from_light.seen, there, TransportMode::kImportance);
  if (is_black(g.value_cos)) {
    return {};
  }
  const auto area = [&](float pdf, const Vertex& at) {
    return squared(static_cast<double>(pdf) * static_cast<double>(at.cosine(wi)) /
                   static_cast<double>(distance2));
  };
  const auto before = [](const PartialSums& sums, float pdf_reverse) {
    return sums.vcm + sums.vc * squared(static_cast<double>(pdf_reverse));
  };
  const double others =
      area(f.pdf_solid_angle, from_light) * before(from_light.sums, g.pdf_reverse) +
      area(g.pdf_solid_angle, vertex) * before(vertex.sums, f.pdf_reverse);
  const Vec3 n = from_light.surface.point.normal_geometric;
  const Vec3 target = offset_ray(from_light.origin(), dot(n, wi) < 0 ? n : -n);
  const Visibility seen = visibility_from(scene_, path, vertex.surface, wi, target, false);
  const auto weight = static_cast<float>(1 / (1 + others));
  return {vertex.beta * f.value_cos * from_light.beta * g.value_cos * seen.transmittance *
              (weight / distance2),
          weight};
}

PathSample BidirectionalPathTracer::trace_shares(const Camera::CameraRay& camera_ray,
                                                 const PathSampler& sampler, std::uint64_t& rays,
                                                 std::span<Rgb> shares) const noexcept {
  // Vertices of most light subpaths fit the buffer; longer ones go on in memory of their own.
  constexpr std::size_t kBuffer = std::size_t{16} << 10U;
  std::array<std::byte, kBuffer> buffer;
  std::pmr::monotonic_buffer_resource memory(buffer.data(), buffer.size());
  struct Visit {
    const SceneData& scene;
    std::pmr::list<Vertex> vertices;
    Vertex& place(const PathState& path, const PathVertex& met) {
      return vertices.emplace_back(scene, path, met);
    }
    void operator()(Subpath&, const Vertex&) {}
  };
  Visit light{scene_, std::pmr::list<Vertex>(&memory)};
  Subpath light_path{start_path({}, sampler.branch(1, 2), rays)};
  follow_light(light_path, light);

  CameraSubpath path{{start_path(camera_ray, sampler, rays)}, {}, shares};
  PathSample& out = path.out;
  path.last.origin = path.ray.origin;
  path.sums.vcm = squared(light_paths_ /
                          camera_density(camera_.importance(path.ray.origin, path.ray.direction)));
  PathVertex met;
  while (true) {
    if (!intersect(scene_, path, met)) {
      if (path.depth == 0 && !backdrop_.is_environment()) {
        const std::optional<Rgb> seen = backdrop_.seen(path.ray.direction);
        out.alpha = seen ? 1.0F : 0.0F;
        out.radiance += path.beta * seen.value_or(Rgb{});
      } else if (environment_ != nullptr) {
        Found found = background(path);
        found.value = path.beta * found.value;
        credit(path, found, {path.scatterings(), kEnvironmentGroup, {0, path.scatterings() + 2}});
      }
      return out;
    }
    path.beta *= segment_transmittance(scene_, path, met);
    const Material& material = scene_.materials[met.point.material];
    if (material.factors.unlit) {
      const Rgb color = unlit_color(material, met.point, met.wo_world, path.footprint());
      if (!out.hit) {
        met.shading.frame.n = met.point.normal_shading;
        record_first_surface(out, met, color);
      }
      credit(path, {path.beta * color},
             {path.scatterings(), group_at(met), {0, path.scatterings() + 2}});
      return out;
    }
    surface_event(scene_, path, met);
    Vertex vertex(scene_, path, met);
    vertex.sums = after_camera(path, vertex);
    const Bsdf& bsdf = vertex.seen.bsdf();
    if (!out.hit) {
      record_first_surface(out, met, bsdf.albedo());
    }
    const int scatterings = path.scatterings();
    Found found = emission(path, vertex);
    found.value = path.beta * found.value;
    credit(path, found, {scatterings, group_at(met), {0, scatterings + 2}});
    if (scatterings >= max_depth_ && is_black(bsdf.straight())) {
      return out;
    }
    if (scatterings < max_depth_ && bsdf.has_spread()) {
      if (!lights_.empty()) {
        add_light_sample(path, vertex);
      }
      for (const Vertex& from_light : light.vertices) {
        if (scatterings + from_light.scatterings + 2 <= max_depth_ &&
            from_light.seen.bsdf().has_spread()) {
          credit(path, connection(path, vertex, from_light),
                 {scatterings + from_light.scatterings + 2,
                  scene_.group_of_light(from_light.light),
                  {from_light.scatterings + 2, scatterings + 2}});
        }
      }
    }
    vertex.surface.light_normal = vertex.light_normal();
    const int depth = path.depth;
    if (!extend(path, vertex, TransportMode::kRadiance) || path.scatterings() > max_depth_ ||
        !survives_roulette(path, path.sampler.get_4d(dimension_group(depth, BounceGroup::kLight)).w,
                           continuation_probability(path))) {
      return out;
    }
  }
}

}  // namespace

std::unique_ptr<const Integrator> make_bdpt(const IntegratorInput& input) {
  return std::make_unique<BidirectionalPathTracer>(input);
}

}  // namespace core
