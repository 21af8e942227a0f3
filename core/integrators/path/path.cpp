
#include "core/integrators/path/closed_form.h"
#include "core/integrators/path/light_candidates.h"
#include "core/integrators/path/pair_fit.h"
#include "core/integrators/path/path_media.h"
#include "core/integrators/path/path_tracer.h"
#include "core/integrators/path/study_directions.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/reservoir.h"
#include "core/settings/choices.h"
#include "core/transport/intersect.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {

template <typename Options>
PathSample PathTracer<Options>::trace(const Camera::CameraRay& camera_ray,
                                      const PathSampler& sampler,
                                      std::uint64_t& rays) const noexcept {
  return trace_shares(camera_ray, sampler, rays, {});
}

template <typename Options>
PathSample PathTracer<Options>::trace_shares(const Camera::CameraRay& camera_ray,
                                             const PathSampler& sampler, std::uint64_t& rays,
                                             std::span<Rgb> shares) const noexcept {
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  if constexpr (Options::has_media) {
    path.fog = fog();
    path.shares = shares.empty() ? nullptr : shares.data();
  }
  if constexpr (Options::is_spectral) {
    const Wavelengths wavelengths(sampler.get_4d(dimension_group(0, BounceGroup::kVolume)).z);
    path.wavelengths = &wavelengths;
    std::optional<Fog> fog_seen;
    if (fog_) {
      path.fog = &fog_seen.emplace(fog_->with(colors(path).medium(fog_->medium())));
    }
    follow(path);
    return path.out;
  }
  follow(path);
  return path.out;
}

template <typename Options>
void PathTracer<Options>::follow(TracedPath& path) const noexcept {
  PathVertex vertex;
  while (next_vertex(path, vertex) && go_on(path, vertex)) {
  }
}

template <typename Options>
bool PathTracer<Options>::go_on(TracedPath& path, PathVertex& vertex,
                                bool may_split) const noexcept {
  const Surface bsdf = surface(path, vertex);
  if (!visit(path, vertex, bsdf)) {
    return false;
  }
  if (!is_at_max_depth(path)) {
    if (may_split && options_.split_count > 1 && path.depth == 0) {
      split(path, vertex, bsdf);
      return false;
    }
    add_direct_light(path, vertex, bsdf);
  }
  return extend(path, vertex, bsdf);
}

template <typename Options>
bool PathTracer<Options>::reach_surface(TracedPath& path, PathVertex& vertex) const noexcept {
  if constexpr (Options::has_media) {
    return reach_through_media(path, vertex);
  }
  while (intersect(scene_, path, vertex)) {
    Rgb passed = segment_transmittance(path, vertex);
    if (!survives(path, passed)) {
      return false;
    }
    path.beta *= passed;
    if (!vertex.face.is_hole) {
      return true;
    }
    pass_hole(path, vertex);
  }
  add_environment(path);
  return false;
}

template <typename Options>
bool PathTracer<Options>::next_vertex(TracedPath& path, PathVertex& vertex) const noexcept {
  if (!reach_surface(path, vertex)) {
    return false;
  }
  const Material& material = scene_.materials[vertex.point.material];
  if (material.factors.unlit) {
    if (!path.out.hit) {
      vertex.shading.frame.n = vertex.point.normal_shading;
      record_first_surface(path.out, vertex,
                           unlit_color(material, vertex.point, vertex.wo_world, path.footprint()));
    }
    add_emission(path, vertex);
    return false;
  }
  if constexpr (Options::is_spectral) {
    colors(path).surface_event(scene_, path, vertex, path.out);
  } else {
    surface_event(scene_, path, vertex);
  }
  return true;
}

template <typename Options>
bool PathTracer<Options>::visit(TracedPath& path, PathVertex& vertex,
                                const Surface& bsdf) const noexcept {
  if (!path.out.hit) {
    record_first_surface(path.out, vertex, bsdf.albedo());
  }
  if (scene_.materials[vertex.point.material].is_emissive) {
    add_emission(path, vertex);
  }
  vertex.light_normal = bsdf.transmits() ? Vec3{} : vertex.shading.horizon;
  // At the last vertex a path may still pass clear surfaces.
  return path.null_scatterings <= kNullScatteringMax &&
         (!is_at_max_depth(path) || !is_black(bsdf.null_transmittance()));
}

template <typename Options>
void PathTracer<Options>::add_found(TracedPath& path, const FoundLight& found,
                                    std::uint32_t group) const noexcept {
  if (found.is_sampled && options_.strategy == Strategy::kLight) {
    return;
  }
  float weight = 1;
  if (options_.strategy == Strategy::kMis) {
    weight = found.weight(rule(path.last_fitted), path.last);
  }
  const Rgb value = path.beta * colors(path).values(found.radiance) * weight;
  credit(path, value, path.bounces(), [group] { return group; });
  if (found.is_sampled && path.in_pair && !path.passed_hole) {
    note_pair(path.out.fit, 1 - weight, value);
  }
}

template <typename Options>
void PathTracer<Options>::add_environment(TracedPath& path) const noexcept {
  if (sees_backdrop(path)) {
    if (const std::optional<Rgb> seen = backdrop_.seen(path.ray.direction)) {
      credit(path, path.beta * colors(path).values(*seen), path.bounces(),
             [] { return kEnvironmentGroup; });
    } else {
      path.out.alpha -= luminance(colors(path).color(path.beta));
    }
    return;
  }
  if (environment_ != nullptr) {
    add_found(path, found_background(*environment_, lights_, path), kEnvironmentGroup);
  }
}

template <typename Options>
void PathTracer<Options>::add_emission(TracedPath& path, const PathVertex& vertex) const noexcept {
  const FoundLight found = found_emission(scene_, lights_, path, vertex);
  if (is_black(found.radiance) ||
      (found.is_sampled && path.last_controlled &&
       has_closed_form(scene_.triangle_lights[vertex.point.light], path.last.origin))) {
    return;
  }
  add_found(path, found, scene_.placed[vertex.point.placed].group);
}

template <typename Options>
void PathTracer<Options>::add_direct_light(TracedPath& path, const PathVertex& vertex,
                                           const Surface& bsdf) const noexcept {
  if (!bsdf.has_spread() || lights_.empty() || (!samples_lights() && !lights_.has_delta())) {
    return;
  }
  PathLight direct = sample_light(path, vertex, bsdf);
  const Rgb value = arriving(path, vertex, direct);
  credit(path, value, path.bounces() + 1,
         [&] { return scene_.group_of_light(direct.light.light); });
  if (fits_weights(path.depth, bsdf)) {
    note_light_sample(path.out.fit, direct.mis_weight, value, direct.in_pair);
  } else if (fits_control(path.depth, bsdf)) {
    note_control(path.out.fit, direct.control, value);
  } else {
    path.out.radiance += direct.control;
  }
}

/// Takes one light sample; with several candidates, selects one by resampled importance sampling
/// (core/integrators/path/light_candidates.h).
template <typename Options>
PathLight PathTracer<Options>::sample_light(TracedPath& path, const PathVertex& vertex,
                                            const Surface& bsdf) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  path.u_roulette = u.w;
  const Vec3 p = vertex.shading.origin;
  if (!samples_lights()) {
    return unoccluded(path, vertex, bsdf, lights_.sample_delta(p, u.x));
  }
  const int count = candidates(path.depth);
  if (count == 1) {
    return unoccluded(path, vertex, bsdf, lights_.sample(p, vertex.light_normal, u.x, {u.y, u.z}));
  }
  WeightedReservoir<PathLight> reservoir(
      static_cast<double>(path.sampler.get_4d(choice_group(path.depth)).x));
  Rgb control;
  for (int i = 0; i < count; ++i) {
    const auto at = candidate(u, i, count);
    const PathLight one =
        unoccluded(path, vertex, bsdf, lights_.sample(p, vertex.light_normal, at.pick, at.place));
    control += one.control * (1 / static_cast<float>(count));
    reservoir.add(one, static_cast<double>(size_of(one.value) * one.scale));
  }
  PathLight taken;
  if (!reservoir.empty()) {
    taken = reservoir.item();
    taken.scale *= reservoir.scale(count);
  }
  taken.control = control;
  return taken;
}

template <typename Options>
PathLight PathTracer<Options>::unoccluded(const TracedPath& path, const PathVertex& vertex,
                                          const Surface& bsdf, LightSample light) const noexcept {
  PathLight out;
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return out;
  }
  const bool asked = is_controlled(bsdf);
  const bool closed =
      (asked || fits_control(path.depth, bsdf)) && light.triangle != kNoLight &&
      has_closed_form(scene_.triangle_lights[light.triangle], vertex.shading.origin);
  if (closed) {
    out.control = path.beta * light_control(scene_.triangle_lights[light.triangle], light,
                                            vertex.shading, bsdf.albedo());
  }
  light.radiance = colors(path).values(light.radiance);
  static_cast<DirectLight&>(out) = direct_light(
      light, [&](Vec3 wi) { return bsdf.evaluate(vertex.shading.frame.to_local(wi)); });
  if (is_black(out.value)) {
    return out;
  }
  if (options_.strategy == Strategy::kMis && !(closed && asked)) {
    out.mis_weight = out.weight(rule(fits_weights(path.depth, bsdf)), light_samples(path));
  }
  out.value = path.beta * out.value;
  out.scale = out.mis_weight / light.pdf_solid_angle;
  return out;
}

template <typename Options>
Rgb PathTracer<Options>::arriving(TracedPath& path, const PathVertex& vertex,
                                  PathLight& direct) const noexcept {
  if (is_black(direct.value)) {
    return {};
  }
  if (options_.shadow_threshold > 0) {
    // Russian roulette for shadow rays: faint ones are traced in proportion to their contribution.
    const float survive =
        size_of(direct.value) * direct.scale * path.branch_weight / options_.shadow_threshold;
    if (survive < 1) {
      if (path.sampler.get_4d(choice_group(path.depth)).y >= survive) {
        return {};
      }
      direct.scale /= survive;
    }
  }
  const LightSample& light = direct.light;
  if (path.is_clear && backdrop_.is_through_glass() && is_environment(light) &&
      passes_clear(vertex, light.wi_world)) {
    return {};
  }
  Visibility seen = visibility_from(scene_, path, vertex, light.wi_world, light.target,
                                    light.is_far, ClearSurfaces::kPass, colors(path));
  if (is_black(seen.transmittance) || !survives(path, seen.transmittance)) {
    return {};
  }
  direct.in_pair = seen.is_clear && !light.is_delta;
  return direct.value * seen.transmittance * direct.scale;
}

template <typename Options>
BsdfSample PathTracer<Options>::sample_direction(TracedPath& path,
                                                 const Surface& bsdf) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  if constexpr (!Options::is_spectral) {
    if (options_.strategy == Strategy::kCosine || options_.strategy == Strategy::kUniform) {
      return sample_study_direction(bsdf, options_.strategy == Strategy::kCosine, u);
    }
  }
  return bsdf.sample(u.x, {u.y, u.z});
}

template <typename Options>
bool PathTracer<Options>::extend(TracedPath& path, const PathVertex& vertex,
                                 const Surface& bsdf) const noexcept {
  BsdfSample sample = sample_direction(path, bsdf);
  if (is_black(sample.weight) || !survives(path, sample.weight)) {
    return false;
  }
  const int depth = path.depth;
  const bool fitted = fits_weights(depth, bsdf);
  path.in_pair = fitted && !sample.is_null && !sample.is_delta;
  if (!sample.is_null) {
    path.last_controlled = is_controlled(bsdf);
    path.last_fitted = fitted;
  }
  scatter(scene_, path, vertex, sample, light_samples(path));
  if (options_.roulette != RouletteType::kNone && !path.in_pair) {
    // Fitted weights need the density of the direction, so Russian roulette waits for the next
    // surface.
    const float survive = continuation_probability(path);
    if (survive < 1) {
      if (path.u_roulette < 0) {
        path.u_roulette = path.sampler.get_4d(dimension_group(depth, BounceGroup::kLight)).w;
      }
      if (!survives_roulette(path.beta, path.u_roulette, survive)) {
        return false;
      }
    }
  }
  path.u_roulette = -1;
  return path.scatterings() <= options_.max_depth;
}

/// Continues from the first surface several times with independent random numbers, for the cost of
/// one camera segment, and averages the continuations.
template <typename Options>
void PathTracer<Options>::split(TracedPath& path, const PathVertex& vertex,
                                const Surface& bsdf) const noexcept {
  const float share = 1 / static_cast<float>(options_.split_count);
  Rgb sum;
  for (int i = 0; i < options_.split_count; ++i) {
    TracedPath branch = path;
    branch.sampler = path.sampler.branch(i, options_.split_count);
    branch.branch_weight = share;
    branch.out.radiance = {};
    branch.out.alpha = 0;
    branch.out.fit = {};
    add_direct_light(branch, vertex, bsdf);
    if (extend(branch, vertex, bsdf)) {
      follow(branch);
    }
    sum += branch.out.radiance;
    path.out.alpha += branch.out.alpha * share;
    add_branch(path.out.fit, branch.out.fit, share);
  }
  path.out.radiance += sum * share;
}

/// Analog absorption, used if expected values are off: replaces a factor below 1 by 1 or 0 with the
/// same mean. Returns false if the path or the light sample ends.
template <typename Options>
bool PathTracer<Options>::survives(TracedPath& path, Rgb& factor) const noexcept {
  if (options_.expected_values) {
    return true;
  }
  const float survive = throughput_size(factor);
  if (survive >= 1) {
    return true;
  }
  constexpr std::uint32_t kAnalogDraws = 0x80000000U;  // distinct from holes, which count from 0
  if (path.sampler.extra_1d(path.depth, kAnalogDraws + path.analog_draws++) >= survive) {
    return false;
  }
  factor *= 1 / survive;
  return true;
}

template <typename Options>
std::unique_ptr<GroupTracer> PathTracer<Options>::make_group_tracer() const {
  return nullptr;
}

template <>
std::unique_ptr<GroupTracer> StudyTracer::make_group_tracer() const {
  return shares_lights_ ? make_shared_lights_tracer(*this) : nullptr;
}

template class PathTracer<StudyOptions>;
template class PathTracer<DefaultOptions>;
template class PathTracer<WholeOptions>;
template class PathTracer<SpectralOptions>;

std::unique_ptr<const Integrator> make_path_tracer(const IntegratorInput& input) {
  if (has_catcher(input.settings)) {
    return make_catcher(input);
  }
  if (input.settings.spectral) {
    return std::make_unique<SpectralTracer>(input);
  }
  if (needs_whole_options(input)) {
    return std::make_unique<WholeTracer>(input);
  }
  if (DefaultOptions::serves(input)) {
    return std::make_unique<PathTracer<DefaultOptions>>(input);
  }
  return std::make_unique<StudyTracer>(input);
}

}  // namespace core
