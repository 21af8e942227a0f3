#include <array>
#include <cmath>
#include <cstddef>
#include <list>
#include <memory_resource>
#include <optional>

#include "core/color/wavelength.h"
#include "core/integrators/bidirectional/bdpt_tracer.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/transport/direct_light.h"
#include "core/transport/intersect.h"
#include "core/transport/light_path.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

/// Keeps all vertices of a light subpath.
struct KeptVertices {
  std::pmr::list<Vertex> vertices;
  template <typename... From>
  Vertex& place(const From&... from) {
    return vertices.emplace_back(from...);
  }
  void operator()(Subpath&, const Vertex&) {}
};

/// Keeps one vertex at a time and calls visit(path, vertex).
template <typename Visit>
struct VisitedVertices {
  Visit visit;
  std::optional<Vertex> vertex{};
  template <typename... From>
  Vertex& place(const From&... from) {
    return vertex.emplace(from...);
  }
  void operator()(Subpath& path, const Vertex& at) { visit(path, at); }
};

/// Keeps all vertices and calls visit(path, vertex).
template <typename Visit>
struct KeptVisitedVertices : KeptVertices {
  Visit visit;
  void operator()(Subpath& path, const Vertex& at) { visit(path, at); }
};

/// Passes the splat of a vertex on to `to`.
class VertexSplat final : public CameraSplats {
 public:
  VertexSplat(const CameraSplats& film, StrategyLights& to, const Vertex& vertex)
      : film_(film), to_(to), strategy_{vertex.length() + 1, 1} {}
  const Camera& camera() const noexcept override { return film_.camera(); }
  bool reaches(Vec2 film_px) const noexcept override { return film_.reaches(film_px); }
  void add(Vec2 film_px, Rgb value) noexcept override { to_.splat(strategy_, film_px, value); }

 private:
  const CameraSplats& film_;
  StrategyLights& to_;
  SubpathLengths strategy_;
};

/// Memory for the vertices of light subpaths. Most fit into the buffer.
class VertexMemory {
 public:
  std::pmr::list<Vertex> vertices() { return std::pmr::list<Vertex>(&memory_); }

 private:
  static constexpr std::size_t kBuffer = std::size_t{16} << 10U;
  std::array<std::byte, kBuffer> buffer_;
  std::pmr::monotonic_buffer_resource memory_{buffer_.data(), buffer_.size()};
};

}  // namespace

void BidirectionalPathTracer::begin(Subpath& path, const PathSampler& numbers) const noexcept {
  path.fog = fog_ ? &*fog_ : nullptr;
  if (has_dispersion_) {
    path.u_wavelength = numbers.get_4d(dimension_group(0, BounceGroup::kVolume)).w;
    path.wavelength_color = sample_wavelength(path.u_wavelength).weight;
  }
}

BidirectionalPathTracer::Event BidirectionalPathTracer::next_event(
    Subpath& path, PathVertex& met, MediumSample& sample) const noexcept {
  if (!weights_.has_media() && path.fog == nullptr) {
    return reach(scene_, path, met) ? Event::kSurface : Event::kEscape;
  }
  while (true) {
    const bool is_met = intersect(scene_, path, met);
    sample = {};
    const Material* solid = is_met ? segment_solid(path, met) : nullptr;
    // No solid extends beyond the last surface: if the stack contains one, its mesh has a hole.
    if (is_met || path.media.empty()) {
      const MediumStretch stretch(path, solid != nullptr ? &solid->medium : nullptr,
                                  is_met ? met.distance_m : kFar);
      sample = stretch.sample(path);
      path.beta *= sample.weight;
      if (stretch.scatters()) {
        path.flight_depth += stretch.medium().sigma_t * sample.depth_m;
      }
    }
    if (sample.scatterer != nullptr) {
      return Event::kMedium;
    }
    if (!is_met || !met.face.is_hole) {
      return is_met ? Event::kSurface : Event::kEscape;
    }
    pass_hole(path, met);
  }
}

/// Samples the next direction. Returns false if the path ends.
bool BidirectionalPathTracer::extend(Subpath& path, const Vertex& vertex,
                                     TransportMode mode) const noexcept {
  const int depth = path.depth;
  const Vec4 u = path.sampler.get_4d(dimension_group(depth, BounceGroup::kBsdf));
  const PartialSums& here = vertex.sums;
  if (vertex.medium != nullptr) {
    path.beta = vertex.beta;
    scatter_within(path, *vertex.medium, vertex.origin(), {u.y, u.z});
    const auto phase = static_cast<double>(path.last.pdf_bsdf);
    path.sums = weights_.after_scattering(here, 1, phase, phase, mode);
    path.last_extinction = vertex.extinction;
    path.flight_depth = {};
    return !is_black(path.beta);
  }
  const Vertex::Scattering& at = *vertex.scattering;
  const ScatterSample next = sample_scatter(at.at, at.seen, u.x, {u.y, u.z}, mode);
  if (is_black(next.weight)) {
    return false;
  }
  if (!next.is_null) {
    const auto cosine = static_cast<double>(vertex.cosine(next.wi_world));
    path.sums = next.is_delta ? BdptWeights::after_delta(here, cosine)
                              : weights_.after_scattering(
                                    here, cosine, static_cast<double>(next.pdf_solid_angle),
                                    static_cast<double>(next.pdf_reverse), mode);
    path.beta = vertex.beta;
    path.last_extinction = vertex.extinction;
    path.flight_depth = {};
  }
  scatter(scene_, path, vertex.surface, next, mode);
  return path.null_scatterings <= kNullScatteringMax;
}

template <typename Visit>
void BidirectionalPathTracer::follow_light(Subpath& path, const Strategies& strategies,
                                           Visit& visit) const noexcept {
  const EmissionSample light = start_light_path(scene_, path, emission_);
  const float first_size = throughput_size(path.beta);
  PathVertex met;
  MediumSample sample;
  // A path that may not scatter at further surfaces may still scatter in media.
  while (first_size > 0 && (weights_.has_media() || path.scatterings() < max_depth_)) {
    const Event event = next_event(path, met, sample);
    if (event == Event::kEscape) {
      return;
    }
    if (event == Event::kSurface) {
      if (scene_.materials[met.point.material].factors.unlit) {
        return;
      }
      surface_event(scene_, path, met);
    }
    Vertex& vertex =
        event == Event::kSurface ? visit.place(scene_, path, met) : visit.place(path, sample);
    if (path.bounces() == 0) {
      vertex.beta *=
          emission_.range_factor(light.light, length(vertex.position() - path.last.origin));
    }
    vertex.light = light.light;
    vertex.sums = weights_.at_light_vertex(path, light, vertex);
    if (is_allowed(vertex.surfaces, vertex.in_media)) {
      visit(path, vertex);
    } else if (vertex.medium != nullptr || is_black(vertex.bsdf().null_transmittance())) {
      return;
    }
    const int depth = path.depth;
    if (!extend(path, vertex, TransportMode::kImportance) || path.scatterings() > max_depth_ ||
        !strategies.has_light_vertices(path.bounces() + 2)) {
      return;
    }
    if (!weights_.connects() && path.bounces() > 0 && !path.arrives_sharply()) {
      return;
    }
    if (!strategies.only &&
        !survives_roulette(path.beta, path.sampler.get_4d(vertex_group(depth)).z,
                           throughput_size(path.beta) / first_size)) {
      return;
    }
  }
}

/// Traces a shadow ray from a vertex, like visibility_from(), and adds the optical depth of
/// scattering media to flight_depth.
Visibility BidirectionalPathTracer::visibility_of(PathState& path, const Vertex& vertex, Vec3 wi,
                                                  Vec3 target, bool is_far,
                                                  Rgb& flight_depth) const noexcept {
  const FlightColors colors(flight_depth);
  if (vertex.medium == nullptr) {
    return visibility_from(scene_, path, vertex.surface, wi, target, is_far, ClearSurfaces::kPass,
                           colors);
  }
  MediumStack media = path.media;
  media.begin_segment();
  const Ray shadow{vertex.origin(), is_far ? wi : target - vertex.origin(), 0,
                   is_far ? kFar : 1.0F};
  return visibility(scene_, path, shadow, media, ClearSurfaces::kPass, colors);
}

void BidirectionalPathTracer::splat(Subpath& path, const Vertex& vertex,
                                    CameraSplats& splats) const noexcept {
  if (!vertex.has_spread()) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(vertex_group(path.depth));
  const Camera::ImportanceSample to = splats.camera().sample_wi(vertex.origin(), {u.x, u.y});
  if (!(to.pdf_solid_angle > 0) || !splats.reaches(to.importance.film_px)) {
    return;
  }
  const ScatterEval f = vertex.evaluate(to.wi_world, TransportMode::kImportance);
  const bool is_page = shows_backdrop(vertex, to.wi_world) && is_environment(vertex.light);
  if (is_black(f.value_cos) || is_page) {
    return;
  }
  Rgb flight_depth;
  const Visibility seen = visibility_of(path, vertex, to.wi_world, to.origin, false, flight_depth);
  const auto weight = static_cast<float>(weights_.splat(vertex, to, f, flight_depth));
  const Rgb color = path.color(vertex.disperses(to.wi_world));
  const Found found = {vertex.beta * f.value_cos * seen.transmittance * color *
                           (weight * to.importance.we / to.pdf_solid_angle),
                       weight};
  splats.add(to.importance.film_px, found.value);
  if (!ledger_.empty() && !is_black(found.value)) {
    ledger_.each({vertex.length(), scene_.group_of_light(vertex.light), {vertex.length() + 1, 1}},
                 [&](std::size_t share, bool is_weighted) {
                   splats.add_to_share(to.importance.film_px, share,
                                       is_weighted ? found.value : found.unweighted());
                 });
  }
}

void BidirectionalPathTracer::trace_light(const PathSampler& sampler, std::uint64_t& rays,
                                          CameraSplats& splats) const noexcept {
  const auto to_camera = [&](Subpath& path, const Vertex& at) { splat(path, at, splats); };
  Subpath path{start_path(sampler, rays)};
  begin(path, sampler);
  path.merged = merging_.merged(static_cast<int>(sampler.index()));
  VisitedVertices<decltype(to_camera)> visited{to_camera};
  follow_light(path, {}, visited);
}

std::unique_ptr<Prepass> BidirectionalPathTracer::start_prepass(int sample) const {
  if (!merging_.is_on) {
    return nullptr;
  }
  const float radius_m = merging_.radius_m(sample / settings_.replicates);
  return std::make_unique<MergedPhotons>(sample, merging_.paths, radius_m);
}

void BidirectionalPathTracer::run_prepass(Prepass& pass, int part, std::uint64_t& rays) const {
  auto& photons = static_cast<MergedPhotons&>(pass);
  photons.each_path(part, settings_,
                    [&](const PathSampler& sampler, std::vector<MergedPhoton>& out) {
                      const auto keep = [&out](Subpath&, const Vertex& at) {
                        if (at.sums.merged > 0 && is_finite(at.beta)) {
                          out.emplace_back(at);
                        }
                      };
                      Subpath path{start_path(sampler, rays)};
                      begin(path, sampler);
                      path.merged = squared(merging_.in_disk(photons.radius_m));
                      VisitedVertices<decltype(keep)> visited{keep};
                      follow_light(path, {}, visited);
                    });
}

PathSample BidirectionalPathTracer::gather(const Camera::CameraRay& camera_ray,
                                           const PathSampler& sampler, const Prepass& pass,
                                           std::uint64_t& rays) const noexcept {
  return trace_pair(camera_ray, sampler, rays, {}, &static_cast<const MergedPhotons&>(pass));
}

void BidirectionalPathTracer::credit(CameraSubpath& path, const Found& found,
                                     const LightOrigin& from) const noexcept {
  path.out.radiance += found.value;
  if (path.lights != nullptr) {
    path.lights->add(from.strategy, found.value);
  }
  if (!path.shares.empty() && !is_black(found.value)) {
    ledger_.each(from, [&](std::size_t share, bool is_weighted) {
      path.shares[share] += is_weighted ? found.value : found.unweighted();
    });
  }
}

/// Adds the radiance of the background where the path leaves the scene.
void BidirectionalPathTracer::add_background(CameraSubpath& path) const noexcept {
  const Rgb arriving = path.beta * path.color(path.wavelength_nm > 0);
  if (backdrop_.is_seen(path.depth, path.is_clear)) {
    const std::optional<Rgb> seen = backdrop_.seen(path.ray.direction);
    path.out.alpha -= seen ? 0.0F : luminance(arriving);
    credit(path, {arriving * seen.value_or(Rgb{})},
           {path.bounces(), kEnvironmentGroup, {0, path.bounces() + 2}});
    return;
  }
  if (environment_ == nullptr) {
    return;
  }
  const Vec3 direction = path.ray.direction;
  Found found = {environment_->background(direction)};
  if (path.bounces() > 0) {
    found.weight = static_cast<float>(weights_.background(path));
    // Light subpaths start with the unfiltered radiance. All strategies that share a path need the
    // same one; only behind mirrors and clear glass is there no other strategy.
    found.value =
        (path.is_shared() ? environment_->radiance(direction) : found.value) * found.weight;
  }
  found.value = arriving * found.value;
  credit(path, found, {path.bounces(), kEnvironmentGroup, {0, path.bounces() + 2}});
}

/// Adds the radiance that the surface emits towards the camera subpath.
void BidirectionalPathTracer::add_emission(CameraSubpath& path,
                                           const Vertex& vertex) const noexcept {
  const PathVertex& met = vertex.surface;
  const Material& material = vertex.scattering->at.material;
  // As for the background, all strategies that share a path need the same radiance.
  const bool is_filtered = material.factors.unlit && !path.is_shared();
  const Rgb radiance = is_filtered
                           ? unlit_color(material, met.point, met.wo_world, path.footprint())
                           : emitted(material, met.point, met.wo_world);
  Found found = {radiance};
  if (!is_black(radiance) && path.bounces() > 0 && met.point.light != kNoLight) {
    found.weight = static_cast<float>(weights_.emission(path, vertex));
    found.value = radiance * found.weight;
  }
  found.value = path.beta * path.color(vertex.is_dispersed) * found.value;
  credit(path, found, {path.bounces(), group_at(met), {0, path.bounces() + 2}});
}

void BidirectionalPathTracer::add_light_sample(CameraSubpath& path,
                                               const Vertex& vertex) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  const LightSample light = lights_.sample(vertex.origin(), vertex.light_normal(), u.x, {u.y, u.z});
  ScatterEval f;
  const DirectLight direct = direct_light(
      light, [&](Vec3 wi) { return f = vertex.evaluate(wi, TransportMode::kRadiance); });
  const bool is_page = shows_backdrop(vertex, light.wi_world) && is_environment(light.light);
  if (is_black(direct.value) || is_page) {
    return;
  }
  Rgb flight_depth;
  const Visibility seen =
      visibility_of(path, vertex, light.wi_world, light.target, light.is_far, flight_depth);
  const auto weight = static_cast<float>(weights_.light_sample(vertex, light, f, flight_depth));
  credit(path,
         {vertex.beta * direct.value * seen.transmittance *
              path.color(vertex.disperses(light.wi_world)) * (weight / light.pdf_solid_angle),
          weight},
         {vertex.length(), scene_.group_of_light(light.light), {1, vertex.length() + 1}});
}

/// Connects a vertex of the camera subpath to one of the light subpath.
Found BidirectionalPathTracer::connection(Subpath& path, const Vertex& vertex,
                                          const Vertex& from_light) const noexcept {
  const Vec3 d = from_light.origin() - vertex.origin();
  const float distance2 = dot(d, d);
  if (!(distance2 > 0)) {
    return {};
  }
  const Vec3 wi = d * (1 / std::sqrt(distance2));
  const ScatterEval f = vertex.evaluate(wi, TransportMode::kRadiance);
  if (is_black(f.value_cos)) {
    return {};
  }
  const ScatterEval g = from_light.evaluate(-wi, TransportMode::kImportance);
  const bool is_page = shows_backdrop(vertex, wi) && shows_backdrop(from_light, -wi) &&
                       is_environment(from_light.light);
  if (is_black(g.value_cos) || is_page) {
    return {};
  }
  Vec3 target = from_light.origin();
  if (from_light.medium == nullptr) {
    const SurfacePoint& point = from_light.surface.point;
    const Vec3 n = point.normal_geometric;
    target = offset_ray(target, dot(n, wi) < 0 ? n : -n,
                        plane_error_m(point.error_m, std::sqrt(distance2)));
  }
  Rgb flight_depth;
  const Visibility seen = visibility_of(path, vertex, wi, target, false, flight_depth);
  const auto weight =
      static_cast<float>(weights_.connection(vertex, from_light, wi, f, g, flight_depth));
  const Rgb color = path.color(vertex.disperses(wi) || from_light.disperses(-wi));
  return {vertex.beta * f.value_cos * from_light.beta * g.value_cos * seen.transmittance * color *
              (weight / distance2),
          weight};
}

void BidirectionalPathTracer::add_photons(CameraSubpath& path,
                                          const Vertex& vertex) const noexcept {
  // As for sppm: 1e-6 of diffuse light arrives from below.
  constexpr float kCosLeast = 1e-3F;
  const Vec3 n = vertex.surface.point.normal_geometric;
  Rgb sum;
  path.photons->map.each(vertex.position(), [&](const MergedPhoton& photon) {
    // Both subpaths have counted the vertex.
    if (!is_allowed(vertex.surfaces + photon.surfaces - 1, vertex.in_media + photon.in_media) ||
        !faces_alike(photon.normal.unpacked(), n)) {
      return;
    }
    const Vec3 wi = photon.wi_world.unpacked();
    const ScatterEval f = vertex.evaluate(wi, TransportMode::kRadiance);
    const bool is_page =
        shows_backdrop(vertex, wi) && photon.is_clear && is_environment(photon.light);
    if (is_black(f.value_cos) || is_page) {
      return;
    }
    const auto weight = static_cast<float>(weights_.merging(vertex.sums, photon.sums, f));
    sum += f.value_cos * photon.beta * (weight / std::max(vertex.cosine(wi), kCosLeast));
  });
  const auto over = static_cast<float>(1 / merging_.in_disk(path.photons->radius_m));
  path.out.radiance += path.beta * sum * over;
}

template <typename LightVertices>
void BidirectionalPathTracer::add_connections(CameraSubpath& path, const Vertex& vertex,
                                              const Strategies& strategies,
                                              const LightVertices& light_vertices) const noexcept {
  for (const Vertex& from_light : light_vertices) {
    if (strategies.has(from_light.length() + 1, vertex.length() + 1) &&
        is_allowed(vertex.surfaces + from_light.surfaces, vertex.in_media + from_light.in_media) &&
        from_light.has_spread()) {
      credit(path, connection(path, vertex, from_light),
             {vertex.length() + from_light.length(),
              scene_.group_of_light(from_light.light),
              {from_light.length() + 1, vertex.length() + 1}});
    }
  }
}

template <typename LightVertices>
void BidirectionalPathTracer::follow_camera(CameraSubpath& path, const Strategies& strategies,
                                            const LightVertices& light_vertices) const noexcept {
  PathVertex met;
  MediumSample sample;
  std::optional<Vertex> place;
  while (true) {
    const Event event = next_event(path, met, sample);
    const bool may_meet_light = strategies.has(0, path.bounces() + 2);
    if (event == Event::kEscape) {
      if (may_meet_light) {
        add_background(path);
      }
      return;
    }
    if (event == Event::kSurface) {
      if (scene_.materials[met.point.material].factors.unlit) {
        met.shading = {};
        met.drew_wavelength = false;
        met.shading.frame.n = met.point.normal_shading;
      } else {
        surface_event(scene_, path, met);
      }
      place.emplace(scene_, path, met);
    } else {
      place.emplace(path, sample);
    }
    Vertex& vertex = *place;
    vertex.sums = weights_.at_camera_vertex(path, vertex);
    if (event == Event::kSurface) {
      const Material& material = vertex.scattering->at.material;
      if (!path.out.hit) {
        record_first_surface(path.out, met,
                             material.factors.unlit
                                 ? unlit_color(material, met.point, met.wo_world, path.footprint())
                                 : vertex.bsdf().albedo());
      }
      if (may_meet_light) {
        add_emission(path, vertex);
      }
      if (material.factors.unlit) {
        return;
      }
    } else if (!path.out.hit) {
      record_first_scattering(path.out, sample, path.ray.direction);
    }
    const bool can_scatter = is_allowed(vertex.surfaces, vertex.in_media);
    if (!can_scatter &&
        (vertex.medium != nullptr || is_black(vertex.bsdf().null_transmittance()))) {
      return;
    }
    if (can_scatter && vertex.has_spread()) {
      if (!lights_.empty() && strategies.has(1, vertex.length() + 1)) {
        add_light_sample(path, vertex);
      }
      add_connections(path, vertex, strategies, light_vertices);
    }
    if (path.photons != nullptr && can_scatter && vertex.can_merge()) {
      add_photons(path, vertex);
    }
    vertex.surface.light_normal = vertex.light_normal();
    const int depth = path.depth;
    if (!extend(path, vertex, TransportMode::kRadiance) || path.scatterings() > max_depth_ ||
        !strategies.has_camera_vertices(path.bounces() + 2)) {
      return;
    }
    if (!strategies.only &&
        !survives_roulette(path.beta,
                           path.sampler.get_4d(dimension_group(depth, BounceGroup::kLight)).w,
                           continuation_probability(path))) {
      return;
    }
  }
}

PathSample BidirectionalPathTracer::trace_shares(const Camera::CameraRay& camera_ray,
                                                 const PathSampler& sampler, std::uint64_t& rays,
                                                 std::span<Rgb> shares) const noexcept {
  return trace_pair(camera_ray, sampler, rays, shares, nullptr);
}

PathSample BidirectionalPathTracer::trace_pair(const Camera::CameraRay& camera_ray,
                                               const PathSampler& sampler, std::uint64_t& rays,
                                               std::span<Rgb> shares,
                                               const MergedPhotons* photons) const noexcept {
  const double merged = photons != nullptr ? squared(merging_.in_disk(photons->radius_m)) : 0;
  VertexMemory memory;
  KeptVertices light{memory.vertices()};
  if (weights_.connects()) {
    Subpath light_path{start_path(sampler.branch(1, 2), rays)};
    begin(light_path, sampler);
    light_path.merged = merged;
    follow_light(light_path, {}, light);
  }

  CameraSubpath path{{start_path(scene_, camera_ray, sampler, rays)}, {}, shares};
  begin(path, sampler);
  path.merged = merged;
  path.photons = photons;
  path.last.origin = camera_ray.from_lens();
  path.sums = weights_.from_camera(path.ray);
  follow_camera(path, {}, light.vertices);
  return path.out;
}

void BidirectionalPathTracer::trace_strategies(const SubpathPair& from,
                                               const Strategies& strategies, std::uint64_t& rays,
                                               const CameraSplats& film,
                                               StrategyLights& out) const noexcept {
  const auto to_camera = [&](Subpath& path, const Vertex& at) {
    if (strategies.has(at.length() + 1, 1)) {
      VertexSplat splats(film, out, at);
      splat(path, at, splats);
    }
  };
  VertexMemory memory;
  KeptVisitedVertices<decltype(to_camera)> light{{memory.vertices()}, to_camera};
  if (strategies.has_light_vertices(2)) {
    Subpath path{start_path(from.from_light, rays)};
    begin(path, from.from_camera);
    follow_light(path, strategies, light);
    const int reached = light.vertices.empty() ? 1 : light.vertices.back().length() + 1;
    if (strategies.only && reached < strategies.only->light) {
      return;
    }
  }
  if (strategies.has_camera_vertices(2)) {
    CameraSubpath path{{start_path(scene_, from.camera_ray, from.from_camera, rays)}, {}, {}, &out};
    begin(path, from.from_camera);
    path.last.origin = from.camera_ray.from_lens();
    path.sums = weights_.from_camera(path.ray);
    follow_camera(path, strategies, light.vertices);
  }
}

std::unique_ptr<const Integrator> make_bdpt(const IntegratorInput& input) {
  return std::make_unique<BidirectionalPathTracer>(input);
}

}  // namespace core
