// Light samples of the path integrator, and what stands in their way.
#include <algorithm>
#include <cmath>

#include "core/integrators/path_state.h"
#include "core/lights/triangle_irradiance.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/reservoir.h"

namespace core {

/// Share of light that gets along the ray, which starts inside `media`: 0 behind surfaces; through BLEND
/// 1 - alpha, its expected value rather than a throw of dice (unless those were asked for); through clear
/// surfaces what they let straight through. scatter() takes those for no vertex at all, so light sampling and
/// BSDF sampling share the paths through them by MIS.
PathIntegrator::Passage PathIntegrator::transmittance(State& path, const Ray& shadow, MediumStack& media) const noexcept {
  ++path.rays;
  Rgb open(1);
  const auto absorb = [&open, &media](Vec3 way) {
    if (media.top() != nullptr) {
      open *= absorbed(media.top()->sigma_a, length(way));
    }
  };
  if (!scene_.has_alpha && !scene_.has_clear) {
    if (scene_.accel->occluded(shadow)) {
      return {};
    }
    if (shadow.t_max <= 1) {
      absorb(shadow.direction);
    }
    return {lets_through(path, open) ? open : Rgb{}, true};
  }
  Ray ray = shadow;
  const Vec3 end = shadow.origin + shadow.direction;
  const bool far = shadow.t_max > 1;
  for (int pass = 0; pass < kPassThroughMax; ++pass) {
    RawHit hit;
    if (!scene_.accel->intersect(ray, hit)) {
      if (!far) {
        absorb(ray.direction);
      }
      return {lets_through(path, open) ? open : Rgb{}, pass == 0};
    }
    const float coverage = scene_.coverage(hit, ray);
    const Material& material = scene_.materials[scene_.meshes[scene_.placed_mesh(hit).mesh].material];
    if (coverage >= 1 && !material.is_clear) {
      return {};
    }
    const SurfacePoint hole = scene_.surface_point(hit, ray);
    absorb(hole.position - ray.origin);
    Rgb share(1 - coverage);
    if (material.is_clear && coverage > 0) {
      const Vec3 wo = -normalize(ray.direction);
      Shading shading;
      shade(scene_, hole, wo, path.footprint(), shading);
      if (material.is_volume) {
        shading.bsdf.ior = relative_ior(path, media, material, shading.front);
        media.cross(material, shading.front);
      }
      share += make_bsdf(shading, wo).straight() * coverage;
    }
    open *= share;
    if (is_black(open) || !lets_through(path, open)) {
      return {};
    }
    ++path.rays;
    const float side = dot(hole.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
    ray.origin = offset_ray(hole.position, hole.normal_geometric * side);
    if (!far) {
      ray.direction = end - ray.origin;
    }
  }
  return {};
}

/// Without expected values: all of what gets through or nothing, with the same mean.
bool PathIntegrator::lets_through(State& path, Rgb& share) const noexcept {
  if (expected_values_) {
    return true;
  }
  const float survive = max_component(Rgb{std::fabs(share.r), std::fabs(share.g), std::fabs(share.b)});
  if (survive >= 1) {
    return true;
  }
  constexpr std::uint32_t kDice = 0x80000000U;  // apart from holes, which count from 0
  if (path.sampler.extra_1d(path.depth, kDice + path.dice++) >= survive) {
    return false;
  }
  share *= 1 / survive;
  return true;
}

/// Does the control variate stand in for BSDF samples at this surface?
bool PathIntegrator::is_controlled(const Bsdf& bsdf) const noexcept {
  return control_variate_ == ControlVariateType::kAnalytic && bsdf.is_wide() &&
         (strategy_ == Strategy::kMis || strategy_ == Strategy::kLight);
}

/// Does a light sample here get a control variate with the pixel's own factor? BSDF samples go on as ever.
bool PathIntegrator::fits_control(int depth, const Bsdf& bsdf) const noexcept {
  return fit_ == FitType::kRegression && depth == 0 && bsdf.is_wide() &&
         (strategy_ == Strategy::kMis || strategy_ == Strategy::kLight);
}

/// Are the samples at this surface weighted by the pixel's own 2x2 system?
bool PathIntegrator::fits_weights(int depth, const Bsdf& bsdf) const noexcept {
  return fit_ == FitType::kOptimalMis && depth == 0 && bsdf.has_spread() && !lights_.empty();
}

/// A sample that has both densities, as light and as BSDF sample; value: f / m. Light samples of anything else (delta lights, what
/// is black, out of sight or not quite clear) are noted with all of the weight, such BSDF samples with none and need not be
/// noted: those are outcomes that the other technique does not have, so that densities integrate to 1 all the same.
void PathIntegrator::note_pair(State& path, float share_light, Rgb value) noexcept {
  if (is_black(value)) {
    return;
  }
  FitSample& fit = path.out.fit;
  fit.control += Rgb(share_light);
  fit.x += share_light;
  fit.xx += share_light * share_light;
  fit.y += value;
  fit.xy += value * share_light;
}

/// Uniform triangles that are not too small or too far for it to matter, with the point clearly before them (at either
/// side of two-sided ones): in their plane rounding would decide which of their points count.
bool PathIntegrator::has_closed_form(std::uint32_t light, Vec3 point) const noexcept {
  if (light == kNoLight) {
    return false;
  }
  constexpr float kSolidAngleLeast = 1e-3F;
  constexpr float kHeightLeast = 1e-3F;  // over the side of a square of the same area
  const TriangleLight& t = scene_.triangle_lights[light];
  const Vec3 to = t.p0 + (t.edge1 + t.edge2) * (1.0F / 3) - point;
  if (t.textured || !(t.area_m2 > kSolidAngleLeast * dot(to, to))) {
    return false;
  }
  const float before = -dot(t.normal, to);
  const float height = t.two_sided ? std::fabs(before) : before;
  return height > 0 && height * height > kHeightLeast * kHeightLeast * t.area_m2;
}

/// With h = albedo / pi cos L, the light that a Lambert surface of the same albedo would get if nothing stood in between,
/// and H its integral over the light in closed form, H - h/p has the mean 0: added to V f L / p it leaves of the noise
/// what comes from shadows and from the difference between the BSDF and Lambert's. BSDF samples that find the light
/// count for nothing then, since light samples are not weighted.
Rgb PathIntegrator::control(const State& path, const Vertex& vertex, const Bsdf& bsdf,
                            const LightSample& light) const noexcept {
  const TriangleLight& t = scene_.triangle_lights[light.triangle];
  const Vec3 n = vertex.shading.frame.n;
  const auto mean = static_cast<float>(
      triangle_irradiance(vertex.shading.origin, n, t.p0, t.p0 + t.edge1, t.p0 + t.edge2));
  const float sampled = std::max(dot(n, light.wi_world), 0.0F) / light.pdf_solid_angle;
  return path.beta * bsdf.albedo() * light.radiance * (kInvPi * (mean / light.prob_light - sampled));
}

PathIntegrator::DirectLight PathIntegrator::unshadowed(const State& path, const Vertex& vertex, const Bsdf& bsdf,
                                                       const LightSample& light) const noexcept {
  DirectLight out;
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return out;
  }
  const bool asked = is_controlled(bsdf);
  const bool closed = (asked || fits_control(path.depth, bsdf)) && has_closed_form(light.triangle, vertex.shading.origin);
  const bool controlled = closed && asked;
  if (closed) {
    out.control = control(path, vertex, bsdf, light);
  }
  const BsdfEval f = bsdf.evaluate(vertex.shading.frame.to_local(light.wi_world));
  if (is_black(f.value_cos)) {
    return out;
  }
  float weight = 1;
  if (!light.is_delta && strategy_ == Strategy::kMis && !controlled) {
    weight = rule(fits_weights(path.depth, bsdf)).weight(light_count(path) * light.pdf_solid_angle, f.pdf_solid_angle);
  }
  out.share = weight;
  out.light = light;
  out.value = path.beta * f.value_cos * light.radiance;
  out.scale = weight / light.pdf_solid_angle;
  return out;
}

/// One light sample; with several candidates, one of them by resampled importance sampling (Talbot 2005).
///
/// The candidates y_i, i < M, together follow the light sampler's density p. Let
/// g(y) = w(y) f(y) L(y) be the light without shadows times the weight w that MIS gives M samples of p beside one of
/// the BSDF's density, and t_i = |g(y_i)| / p(y_i). Candidate j is taken with probability t_j / sum t,
/// and its g/p is multiplied by sum t / (M t_j), so that, given the candidates, the mean of what is added is
/// (1/M) sum V(y_i) g(y_i) / p(y_i), V being visibility, and over candidates the integral of V g. Weights are taken
/// before the choice, with densities that are known, so BSDF samples get 1 - w, both together the integral of V f L,
/// and the density of the taken candidate, which has no closed form, is never asked for.
PathIntegrator::DirectLight PathIntegrator::sample_light(State& path, const Vertex& vertex,
                                                         const Bsdf& bsdf) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  path.u_roulette = u.w;
  const Vec3 p = vertex.shading.origin;
  if (strategy_ != Strategy::kMis && strategy_ != Strategy::kLight) {
    return unshadowed(path, vertex, bsdf, lights_.sample_delta(p, u.x));
  }
  const int all = candidates(path.depth);
  if (all == 1) {
    return unshadowed(path, vertex, bsdf, lights_.sample(p, vertex.light_normal, u.x, {u.y, u.z}));
  }
  const auto count = static_cast<float>(all);
  WeightedReservoir<DirectLight> reservoir(
      static_cast<double>(path.sampler.get_4d(choice_group(path.depth)).x));
  Rgb control;
  for (int i = 0; i < all; ++i) {
    const Candidate at = candidate(u, i, all);
    const DirectLight one = unshadowed(path, vertex, bsdf, lights_.sample(p, vertex.light_normal, at.pick, at.place));
    control += one.control * (1 / count);
    reservoir.add(one, static_cast<double>(size_of(one.value) * one.scale));
  }
  DirectLight taken;
  if (!reservoir.empty()) {
    taken = reservoir.item();
    taken.scale *= static_cast<float>(reservoir.sum() / (static_cast<double>(count) * reservoir.weight()));
  }
  taken.control = control;
  return taken;
}

/// What a light sample brings; asks for what is in the way.
Rgb PathIntegrator::arriving(State& path, const Vertex& vertex, DirectLight& direct) const noexcept {
  if (is_black(direct.value)) {
    return {};
  }
  if (shadow_threshold_ > 0) {
    // The shadow ray of what would hardly be seen is traced now and then, and counts for those that were not.
    const float survive = size_of(direct.value) * direct.scale * path.share / shadow_threshold_;
    if (survive < 1) {
      if (path.sampler.get_4d(choice_group(path.depth)).y >= survive) {
        return {};
      }
      direct.scale /= survive;
    }
  }
  const LightSample& light = direct.light;
  const Vec3 n = vertex.shading.normal_geometric;
  const float side = dot(vertex.shading.horizon, light.wi_world) >= 0 ? 1.0F : -1.0F;
  Ray shadow;
  shadow.origin = offset_ray(vertex.shading.origin, n * side);
  shadow.direction = light.is_far ? light.wi_world : light.target - shadow.origin;
  shadow.t_max = light.is_far ? kFar : 1.0F;
  MediumStack media = path.media;
  const Material& material = scene_.materials[vertex.point.material];
  if (side < 0 && material.is_volume) {
    media.cross(material, vertex.shading.front);
  }
  const Passage passage = transmittance(path, shadow, media);
  direct.in_pair = passage.is_empty && !light.is_delta;
  return direct.value * passage.share * direct.scale;
}

void PathIntegrator::add_direct(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept {
  const bool all = strategy_ == Strategy::kMis || strategy_ == Strategy::kLight;
  if (!bsdf.has_spread() || lights_.empty() || (!all && !lights_.has_delta())) {
    return;
  }
  DirectLight direct = sample_light(path, vertex, bsdf);
  const Rgb value = arriving(path, vertex, direct);
  path.out.radiance += value;
  FitSample& fit = path.out.fit;
  if (fits_weights(path.depth, bsdf)) {
    fit.n += 2;
    fit.control += Rgb(-1);
    if (direct.in_pair && !is_black(value)) {
      note_pair(path, direct.share, value);
    } else {
      fit.control += Rgb(1);
      fit.x += 1;
      fit.xx += 1;
    }
  } else if (fits_control(path.depth, bsdf)) {
    const float x = luminance(direct.control);
    const float y = luminance(value);
    fit.n += 1;
    fit.control += direct.control;
    fit.x += x;
    fit.xx += x * x;
    fit.y += Rgb(y);
    fit.xy += Rgb(x * y);
  } else {
    path.out.radiance += direct.control;
  }
}

}  // namespace core
