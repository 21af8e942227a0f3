#include <algorithm>
#include <cmath>

#include "core/bsdf/fresnel.h"
#include "core/color/wavelength.h"
#include "core/integrators/path_state.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/warp.h"

namespace core {

PathIntegrator::PathIntegrator(const IntegratorInput& input)
    : scene_(input.scene),
      environment_(input.environment),
      lights_(input.scene, input.environment, input.settings.light_sampler),
      mis_(input.settings.estimator.mis == MisType::kOptimal
               ? MisRule{MisType::kPower, 2}
               : MisRule{input.settings.estimator.mis, input.settings.estimator.mis_exponent}),
      strategy_(input.settings.estimator.strategy),
      roulette_(input.settings.estimator.roulette),
      control_variate_(input.settings.estimator.control_variate),
      fit_(fit_type(input.settings)),
      shadow_threshold_(roulette_ == RouletteType::kThreshold ? input.settings.estimator.roulette_delta : 0.0F),
      candidates_(input.settings.light_sampler == LightSamplerType::kRis ? input.settings.light_candidates : 1),
      first_candidates_(input.settings.light_sampler == LightSamplerType::kRestir ? input.settings.block_candidates
                                                                                  : candidates_),
      shares_(input.settings.light_sampler == LightSamplerType::kRestir &&
              (strategy_ == Strategy::kMis || strategy_ == Strategy::kLight)),
      expected_values_(input.settings.estimator.expected_values),
      split_count_(input.settings.estimator.splitting == SplittingType::kFixed ? input.settings.estimator.split_count : 1),
      max_depth_(input.settings.max_depth) {}

/// Follows the ray to a surface that is there (holes of MASK and BLEND are passed at random, with
/// the right probability). False: it left the scene.
bool PathIntegrator::find_surface(State& path, Vertex& vertex) const noexcept {
  RawHit hit;
  Ray ray = path.ray;
  float travelled = 0;
  for (int pass = 0; pass < kPassThroughMax; ++pass) {
    ++path.rays;
    if (!scene_.accel->intersect(ray, hit)) {
      return false;
    }
    if (scene_.has_alpha) {
      const float coverage = scene_.coverage(hit, ray);
      if (coverage < 1 &&
          !(coverage > 0 && path.sampler.extra_1d(path.depth, path.pass_through++) < coverage)) {
        const SurfacePoint hole = scene_.surface_point(hit, ray);
        const float side = dot(hole.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
        travelled += length(hole.position - ray.origin);
        path.in_pair = false;
        ray.origin = offset_ray(hole.position, hole.normal_geometric * side);
        continue;
      }
    }
    vertex.point = scene_.surface_point(hit, ray);
    vertex.wo_world = -ray.direction;
    vertex.distance_m = travelled + length(vertex.point.position - ray.origin);
    return true;
  }
  return false;
}

void PathIntegrator::add_background(State& path) const noexcept {
  const bool seen = path.depth == 0 && !path.out.hit;
  if (seen && environment_ != nullptr && !environment_->visible()) {
    path.out.alpha = 0;
    return;
  }
  if (environment_ == nullptr) {
    return;
  }
  if (!(path.pdf_bsdf > 0)) {
    path.out.radiance += path.beta * environment_->background(path.ray.direction);
    return;
  }
  if (strategy_ == Strategy::kLight) {
    return;
  }
  float weight = 1;
  if (strategy_ == Strategy::kMis) {
    weight = rule(path.last_fitted).weight(path.pdf_bsdf, path.last_count * lights_.pdf_environment(path.ray.direction));
  }
  const Rgb value = path.beta * environment_->radiance(path.ray.direction) * weight;
  path.out.radiance += value;
  if (path.in_pair) {
    note_pair(path, 1 - weight, value);
  }
}

void PathIntegrator::add_emission(State& path, const Vertex& vertex) const noexcept {
  const Rgb radiance = emitted(scene_, vertex.point, vertex.wo_world);
  if (is_black(radiance)) {
    return;
  }
  float weight = 1;
  if (path.pdf_bsdf > 0 && vertex.point.light != kNoLight) {
    if (strategy_ == Strategy::kLight ||
        (path.last_controlled && has_closed_form(vertex.point.light, path.last_point))) {
      return;
    }
    if (strategy_ == Strategy::kMis) {
      const Vec3 d = vertex.point.position - path.last_point;
      const float cos_light = std::fabs(dot(vertex.point.normal_geometric, vertex.wo_world));
      weight = rule(path.last_fitted)
                   .weight(path.pdf_bsdf, path.last_count * lights_.pdf_triangle(vertex.point.light, path.last_point,
                                                                                path.last_normal, length(d), cos_light));
    }
  }
  const Rgb value = path.beta * radiance * weight;
  path.out.radiance += value;
  if (path.in_pair && vertex.point.light != kNoLight) {
    note_pair(path, 1 - weight, value);
  }
}

/// By the BSDF, or for study by the cosine or uniformly: delta lobes always by the BSDF.
BsdfSample PathIntegrator::sample_direction(State& path, const Bsdf& bsdf) const noexcept {
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
  if (strategy_ != Strategy::kCosine && strategy_ != Strategy::kUniform) {
    return bsdf.sample(u.x, {u.y, u.z});
  }
  const float prob_delta = bsdf.prob_delta();
  if (u.w < prob_delta) {
    BsdfSample s = bsdf.sample_delta(u.x, {u.y, u.z});
    s.weight = s.weight / prob_delta;
    return s;
  }
  BsdfSample s;
  const bool cosine = strategy_ == Strategy::kCosine;
  s.wi_local = cosine ? cosine_hemisphere({u.y, u.z}) : uniform_hemisphere({u.y, u.z});
  float pdf = (1 - prob_delta) * (cosine ? cosine_hemisphere_pdf_solid_angle(s.wi_local.z) : 0.5F * kInvPi);
  if (bsdf.transmits()) {
    pdf *= 0.5F;
    if (u.x < 0.5F) {
      s.wi_local.z = -s.wi_local.z;
    }
  }
  const BsdfEval f = bsdf.evaluate(s.wi_local);
  if (pdf > 0) {
    s.weight = f.value_cos / pdf;
    s.pdf_solid_angle = pdf;
  }
  return s;
}

bool PathIntegrator::scatter(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept {
  const BsdfSample s = sample_direction(path, bsdf);
  if (is_black(s.weight)) {
    return false;
  }
  Rgb weight = s.weight;
  if (!lets_through(path, weight)) {
    return false;
  }
  const Vec3 n = vertex.shading.normal_geometric;
  const Vec3 wi = vertex.shading.frame.to_world(s.wi_local);
  const bool through = dot(wi, vertex.shading.horizon) < 0;
  path.beta *= weight;
  path.in_pair = false;
  if (vertex.drew_wavelength && !through) {
    path.wavelength_nm = 0;  // the colours parted in what went through
  }
  if (s.is_straight) {
    ++path.straight;  // seen from the last vertex, the light is where it was
  } else {
    path.pdf_bsdf = s.is_delta ? 0.0F : s.pdf_solid_angle;
    path.last_point = vertex.shading.origin;
    path.last_normal = vertex.light_normal;
    path.last_count = light_count(path);
    path.last_controlled = is_controlled(bsdf);
    path.last_fitted = fits_weights(path.depth, bsdf);
    path.in_pair = path.last_fitted && !s.is_delta;
  }
  path.eta_scale *= s.eta * s.eta;
  path.ray.origin = offset_ray(vertex.shading.origin, through ? -n : n);
  path.ray.direction = wi;
  if (through && scene_.has_volumes) {
    const Material& material = scene_.materials[vertex.point.material];
    if (material.is_volume) {
      path.media.cross(material, vertex.shading.front);
    }
  }
  if (!s.is_delta) {
    path.cone_spread_rad += 0.1F * std::max(vertex.shading.bsdf.alpha_x, vertex.shading.bsdf.alpha_y);
    path.is_sharp = false;
  }
  if (roulette_ != RouletteType::kNone && !path.in_pair) {
    // Where weights are fitted the density of what goes on has to be known: the next surface throws the dice.
    // Paths are left alone until their weight falls below one half, and weigh at least that after;
    // measured against thresholds from 1/4 to 1 this gives the least error for the time.
    // eta_scale takes the n^2 of radiance in denser media out: it comes back when the path leaves.
    constexpr float kThreshold = 0.5F;
    const Rgb size = {std::fabs(path.beta.r), std::fabs(path.beta.g), std::fabs(path.beta.b)};
    const float survive = max_component(size) * path.eta_scale / kThreshold;
    if (survive < 1) {
      if (path.u_roulette < 0) {
        path.u_roulette = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight)).w;
      }
      if (path.u_roulette >= survive) {
        return false;
      }
      path.beta *= 1 / survive;
    }
  }
  path.u_roulette = -1;
  ++path.depth;
  return true;
}

bool PathIntegrator::go_on(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept {
  return scatter(path, vertex, bsdf) && path.depth - path.straight <= max_depth_;
}

/// Index of refraction that this path sees, at its wavelength once it has one.
float PathIntegrator::ior_of(const State& path, const Material* material) noexcept {
  if (material == nullptr) {
    return 1;
  }
  const MaterialDescription& f = material->factors;
  const bool at_wavelength = f.dispersion > 0 && path.wavelength_nm > 0;
  return at_wavelength ? dispersive_ior(f.ior, f.dispersion, path.wavelength_nm) : std::max(f.ior, 1.0F);
}

/// A solid's boundary bends light by its index over that of what surrounds it here. front: seen from
/// outside, for a path inside `media`.
float PathIntegrator::relative_ior(const State& path, const MediumStack& media, const Material& material,
                                   bool front) noexcept {
  const Material* around = front ? media.top() : media.without(&material);
  const float inner = ior_of(path, &material);
  return inner / ior_of(path, around);
}

/// From the first dispersive boundary on a path follows one wavelength. Met from outside, what is reflected keeps
/// all of them: each channel then counts with the reflectance at its own mean index (of 1 / wavelength^2, in which the
/// index is linear), over that at the wavelength drawn, which decides.
void PathIntegrator::meet_solid(State& path, const Material& material, Vertex& vertex) noexcept {
  BsdfParameters& b = vertex.shading.bsdf;
  const bool front = vertex.shading.front;
  const Material* around = front ? path.media.top() : path.media.without(&material);
  const MaterialDescription& f = material.factors;
  const bool disperses_around = around != nullptr && around->factors.dispersion > 0;
  if ((f.dispersion > 0 || disperses_around) && !(path.wavelength_nm > 0)) {
    const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume));
    const WavelengthSample sample = sample_wavelength(u.w);
    path.wavelength_nm = sample.wavelength_nm;
    if (front && !disperses_around) {
      const float outer = ior_of(path, around);
      const float cos_o = std::max(dot(vertex.shading.frame.n, vertex.wo_world), 0.0F);
      const float here = fresnel_dielectric(cos_o, ior_of(path, &material) / outer);
      const Rgb n = mean_dispersive_ior(f.ior, f.dispersion);
      b.reflection_weight = here > 0 ? Rgb{fresnel_dielectric(cos_o, n.r / outer), fresnel_dielectric(cos_o, n.g / outer),
                                           fresnel_dielectric(cos_o, n.b / outer)} / here
                                     : Rgb(1);
      b.refraction_weight = sample.weight;
      vertex.drew_wavelength = true;
    } else {
      path.beta *= sample.weight;
    }
  }
  b.ior = relative_ior(path, path.media, material, front);
}

void PathIntegrator::record_first(State& path, const Vertex& vertex, Rgb albedo) noexcept {
  path.out.hit = true;
  path.out.albedo = albedo;
  path.out.normal_world = vertex.shading.frame.n;
  path.out.depth_m = vertex.distance_m;
}

/// Goes on from the first surface several times, with random numbers of their own, for the price of one way there;
/// what they bring is averaged.
void PathIntegrator::split(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept {
  const float share = 1 / static_cast<float>(split_count_);
  Rgb sum;
  for (int i = 0; i < split_count_; ++i) {
    State branch = path;
    branch.sampler = path.sampler.branch(i, split_count_);
    branch.share = share;
    branch.out.radiance = {};
    branch.out.fit = {};
    add_direct(branch, vertex, bsdf);
    if (go_on(branch, vertex, bsdf)) {
      follow(branch);
    }
    sum += branch.out.radiance;
    FitSample& fit = path.out.fit;
    const FitSample& more = branch.out.fit;
    fit = {.control = fit.control + more.control * share,
           .n = fit.n + more.n,
           .x = fit.x + more.x,
           .xx = fit.xx + more.xx,
           .y = fit.y + more.y,
           .xy = fit.xy + more.xy};
  }
  path.out.radiance += sum * share;
}

/// To the next surface, shading included. False: the path is over.
bool PathIntegrator::meet(State& path, Vertex& vertex) const noexcept {
  if (!find_surface(path, vertex)) {
    add_background(path);
    return false;
  }
  path.cone_width_m += path.cone_spread_rad * vertex.distance_m;
  const Material& material = scene_.materials[vertex.point.material];
  const bool inner = dot(vertex.point.normal_geometric, vertex.wo_world) < 0;
  if (inner && material.is_volume && path.media.top() == nullptr) {
    path.media.enter(&material);  // the eye is inside, or the solid was entered through a hole
  }
  const Material* medium = path.media.top();
  if (medium != nullptr) {
    Rgb share = absorbed(medium->sigma_a, vertex.distance_m);
    if (!lets_through(path, share)) {
      return false;
    }
    path.beta *= share;
  }
  if (material.factors.unlit) {
    const Rgb color = unlit_color(scene_, vertex.point, vertex.wo_world, path.footprint());
    if (!path.out.hit) {
      vertex.shading.frame.n = vertex.point.normal_shading;
      record_first(path, vertex, color);
    }
    path.out.radiance += path.beta * color;
    return false;
  }
  shade(scene_, vertex.point, vertex.wo_world, path.footprint(), vertex.shading);
  vertex.drew_wavelength = false;
  if (material.is_volume) {
    meet_solid(path, material, vertex);
  }
  return true;
}

/// What is seen of the surface itself. kLast: the path may go straight on, at most.
PathIntegrator::Stage PathIntegrator::arrive(State& path, Vertex& vertex, const Bsdf& bsdf) const noexcept {
  if (!path.out.hit) {
    record_first(path, vertex, bsdf.albedo());
  }
  if (scene_.materials[vertex.point.material].is_emissive) {
    add_emission(path, vertex);
  }
  const bool at_end = path.depth - path.straight >= max_depth_;
  if (path.straight > kPassThroughMax || (at_end && is_black(bsdf.straight()))) {
    return Stage::kOver;
  }
  vertex.light_normal = bsdf.transmits() ? Vec3{} : vertex.shading.horizon;
  return at_end ? Stage::kLast : Stage::kOpen;
}

/// From the path's ray to its end.
void PathIntegrator::follow(State& path) const noexcept {
  Vertex vertex;
  while (meet(path, vertex)) {
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    const Stage stage = arrive(path, vertex, bsdf);
    if (stage == Stage::kOver) {
      return;
    }
    if (path.depth == 0 && split_count_ > 1 && stage == Stage::kOpen) {
      split(path, vertex, bsdf);
      return;
    }
    if (stage == Stage::kOpen) {
      add_direct(path, vertex, bsdf);
    }
    if (!go_on(path, vertex, bsdf)) {
      return;
    }
  }
}

PathSample PathIntegrator::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                 std::uint64_t& rays) const noexcept {
  State path{.sampler = sampler, .rays = rays};
  path.ray = camera_ray.ray;
  path.cone_width_m = camera_ray.width_m;
  path.cone_spread_rad = camera_ray.spread_rad;
  follow(path);
  return path.out;
}

std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input) {
  return std::make_unique<PathIntegrator>(input);
}

}  // namespace core
