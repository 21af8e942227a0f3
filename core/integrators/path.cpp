#include "core/integrators/path.h"

#include <algorithm>
#include <cmath>

#include "core/color/wavelength.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Holes and clear surfaces do not count as scattering; this bounds a path that meets nothing
/// else.
constexpr int kPassThroughMax = 4096;
constexpr float kFar = 3.0e38F;

Rgb absorbed(Rgb sigma_a, float distance_m) {
  return {std::exp(-sigma_a.r * distance_m), std::exp(-sigma_a.g * distance_m),
          std::exp(-sigma_a.b * distance_m)};
}

Bsdf make_bsdf(const Shading& shading, Vec3 wo_world) {
  return Bsdf(shading.bsdf, shading.frame.to_local(wo_world),
              shading.frame.to_local(shading.normal_geometric),
              shading.has_layers ? &shading.layers : nullptr);
}

}  // namespace

/// The solids around a point, the innermost last. Leaving one takes out its newest entry, wherever
/// it stands, so overlapping and touching solids keep their order.
class PathIntegrator::MediumStack {
 public:
  const Material* top() const noexcept { return count_ > 0 ? media_[count_ - 1] : nullptr; }
  void enter(const Material* material) noexcept {
    if (count_ < kMax) {
      media_[count_++] = material;
    }
  }
  void leave(const Material* material) noexcept {
    for (int i = count_ - 1; i >= 0; --i) {
      if (media_[i] == material) {
        std::copy(media_ + i + 1, media_ + count_, media_ + i);
        --count_;
        return;
      }
    }
  }
  void cross(const Material& material, bool inwards) noexcept {
    inwards ? enter(&material) : leave(&material);
  }
  /// What is on the other side of a boundary of `material` for a path inside it.
  const Material* without(const Material* material) const noexcept {
    MediumStack rest = *this;
    rest.leave(material);
    return rest.top();
  }

 private:
  static constexpr int kMax = 8;
  const Material* media_[kMax] = {};
  int count_ = 0;
};

/// What a path carries from vertex to vertex.
struct PathIntegrator::State {
  const PathSampler& sampler;
  std::uint64_t& rays;
  PathSample out{};
  Ray ray{};
  Rgb beta = {1, 1, 1};
  int depth = 0;             ///< surfaces met so far, holes left out: names the random numbers
  int straight = 0;          ///< of these, clear ones that the path went straight through
  float pdf_bsdf = 0;        ///< density of the last direction; 0: camera or delta
  Vec3 last_point{};
  Vec3 last_normal{};          ///< as given to the light sampler at the last vertex
  float eta_scale = 1;       ///< product of eta^2: radiance against importance
  float cone_width_m = 0;
  float cone_spread_rad = 0;
  MediumStack media{};       ///< the solids that the path is in
  std::uint32_t pass_through = 0;
  float wavelength_nm = 0;  ///< 0: the path carries all of them
  float u_roulette = -1;  ///< of this bounce; below 0: not drawn yet
};

struct PathIntegrator::Vertex {
  SurfacePoint point;
  Vec3 wo_world;
  float distance_m = 0;
  Shading shading;
  Vec3 light_normal;  ///< for the light sampler: zero where light may come from behind
};

PathIntegrator::PathIntegrator(const IntegratorInput& input)
    : scene_(input.scene),
      environment_(input.environment),
      lights_(input.scene, input.environment, input.settings.light_sampler),
      mis_{input.settings.estimator.mis, input.settings.estimator.mis_exponent},
      strategy_(input.settings.estimator.strategy),
      roulette_(input.settings.estimator.roulette),
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
    weight = mis_.weight(path.pdf_bsdf, lights_.pdf_environment(path.ray.direction));
  }
  path.out.radiance += path.beta * environment_->radiance(path.ray.direction) * weight;
}

void PathIntegrator::add_emission(State& path, const Vertex& vertex) const noexcept {
  const Rgb radiance = emitted(scene_, vertex.point, vertex.wo_world);
  if (is_black(radiance)) {
    return;
  }
  float weight = 1;
  if (path.pdf_bsdf > 0 && vertex.point.light != kNoLight) {
    if (strategy_ == Strategy::kLight) {
      return;
    }
    if (strategy_ == Strategy::kMis) {
      const Vec3 d = vertex.point.position - path.last_point;
      const float cos_light = std::fabs(dot(vertex.point.normal_geometric, vertex.wo_world));
      weight = mis_.weight(path.pdf_bsdf, lights_.pdf_triangle(vertex.point.light, path.last_point,
                                                               path.last_normal, length(d), cos_light));
    }
  }
  path.out.radiance += path.beta * radiance * weight;
}

/// Share of light that gets along the ray, which starts inside `media`: 0 behind surfaces; through BLEND
/// 1 - alpha, its expected value rather than a throw of dice; through clear surfaces what they let
/// straight through. scatter() takes those for no vertex at all, so light sampling and BSDF sampling
/// share the paths through them by MIS.
Rgb PathIntegrator::transmittance(State& path, const Ray& shadow, MediumStack& media) const noexcept {
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
    return open;
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
      return open;
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
      shade(scene_, hole, wo, path.cone_width_m, shading);
      if (material.is_volume) {
        shading.bsdf.ior = relative_ior(path, media, material, shading.front);
        media.cross(material, shading.front);
      }
      share += make_bsdf(shading, wo).straight() * coverage;
    }
    open *= share;
    if (is_black(open)) {
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

void PathIntegrator::add_direct(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept {
  const bool all = strategy_ == Strategy::kMis || strategy_ == Strategy::kLight;
  if (!bsdf.has_spread() || lights_.empty() || (!all && !lights_.has_delta())) {
    return;
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kLight));
  path.u_roulette = u.w;
  const Vec3 p = vertex.point.position;
  const LightSample light = all ? lights_.sample(p, vertex.light_normal, u.x, {u.y, u.z})
                                : lights_.sample_delta(p, u.x);
  if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) {
    return;
  }
  const BsdfEval f = bsdf.evaluate(vertex.shading.frame.to_local(light.wi_world));
  if (is_black(f.value_cos)) {
    return;
  }
  float weight = 1;
  if (!light.is_delta && strategy_ == Strategy::kMis) {
    weight = mis_.weight(light.pdf_solid_angle, f.pdf_solid_angle);
  }
  const Vec3 n = vertex.shading.normal_geometric;
  const float side = dot(n, light.wi_world) >= 0 ? 1.0F : -1.0F;
  Ray shadow;
  shadow.origin = offset_ray(p, n * side);
  shadow.direction = light.is_far ? light.wi_world : light.target - shadow.origin;
  shadow.t_max = light.is_far ? kFar : 1.0F;
  MediumStack media = path.media;
  const Material& material = scene_.materials[vertex.point.material];
  if (side < 0 && material.is_volume) {
    media.cross(material, vertex.shading.front);
  }
  const Rgb open = transmittance(path, shadow, media);
  path.out.radiance += path.beta * f.value_cos * light.radiance * open * (weight / light.pdf_solid_angle);
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
  const Vec3 n = vertex.shading.normal_geometric;
  const Vec3 wi = vertex.shading.frame.to_world(s.wi_local);
  const bool through = dot(wi, n) < 0;
  path.beta *= s.weight;
  if (s.is_straight) {
    ++path.straight;  // seen from the last vertex, the light is where it was
  } else {
    path.pdf_bsdf = s.is_delta ? 0.0F : s.pdf_solid_angle;
    path.last_point = vertex.point.position;
    path.last_normal = vertex.light_normal;
  }
  path.eta_scale *= s.eta * s.eta;
  path.ray.origin = offset_ray(vertex.point.position, through ? -n : n);
  path.ray.direction = wi;
  if (through && scene_.has_volumes) {
    const Material& material = scene_.materials[vertex.point.material];
    if (material.is_volume) {
      path.media.cross(material, vertex.shading.front);
    }
  }
  if (!s.is_delta) {
    path.cone_spread_rad += 0.1F * std::max(vertex.shading.bsdf.alpha_x, vertex.shading.bsdf.alpha_y);
  }
  if (roulette_ == RouletteType::kThroughput) {
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

/// Index of refraction that this path sees; from the first dispersive solid on it follows one
/// wavelength.
float PathIntegrator::ior_of(State& path, const Material* material) noexcept {
  if (material == nullptr) {
    return 1;
  }
  const MaterialDescription& f = material->factors;
  if (!(f.dispersion > 0)) {
    return std::max(f.ior, 1.0F);
  }
  if (!(path.wavelength_nm > 0)) {
    const Vec4 u = path.sampler.get_4d(dimension_group(0, BounceGroup::kVolume));
    const WavelengthSample sample = sample_wavelength(u.w);
    path.wavelength_nm = sample.wavelength_nm;
    path.beta *= sample.weight;
  }
  return dispersive_ior(f.ior, f.dispersion, path.wavelength_nm);
}

/// A solid's boundary bends light by its index over that of what surrounds it here. front: seen from
/// outside, for a path inside `media`.
float PathIntegrator::relative_ior(State& path, const MediumStack& media, const Material& material,
                                   bool front) noexcept {
  const Material* around = front ? media.top() : media.without(&material);
  const float inner = ior_of(path, &material);
  return inner / ior_of(path, around);
}

void PathIntegrator::record_first(State& path, const Vertex& vertex, Rgb albedo) noexcept {
  path.out.hit = true;
  path.out.albedo = albedo;
  path.out.normal_world = vertex.shading.frame.n;
  path.out.depth_m = vertex.distance_m;
}

PathSample PathIntegrator::trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                 std::uint64_t& rays) const noexcept {
  State path{.sampler = sampler, .rays = rays};
  path.ray = camera_ray.ray;
  path.cone_width_m = camera_ray.width_m;
  path.cone_spread_rad = camera_ray.spread_rad;
  Vertex vertex;
  while (true) {
    if (!find_surface(path, vertex)) {
      add_background(path);
      return path.out;
    }
    path.cone_width_m += path.cone_spread_rad * vertex.distance_m;
    const Material& material = scene_.materials[vertex.point.material];
    const bool inner = dot(vertex.point.normal_geometric, vertex.wo_world) < 0;
    if (inner && material.is_volume && path.media.top() == nullptr) {
      path.media.enter(&material);  // the eye is inside, or the solid was entered through a hole
    }
    const Material* medium = path.media.top();
    if (medium != nullptr) {
      path.beta *= absorbed(medium->sigma_a, vertex.distance_m);
    }
    if (material.factors.unlit) {
      const Rgb color = unlit_color(scene_, vertex.point, path.cone_width_m);
      if (!path.out.hit) {
        vertex.shading.frame.n = vertex.point.normal_shading;
        record_first(path, vertex, color);
      }
      path.out.radiance += path.beta * color;
      return path.out;
    }
    shade(scene_, vertex.point, vertex.wo_world, path.cone_width_m, vertex.shading);
    if (material.is_volume) {
      vertex.shading.bsdf.ior = relative_ior(path, path.media, material, vertex.shading.front);
    }
    const Shading& shading = vertex.shading;
    const Bsdf bsdf = make_bsdf(shading, vertex.wo_world);
    if (!path.out.hit) {
      record_first(path, vertex, bsdf.albedo());
    }
    if (material.is_emissive) {
      add_emission(path, vertex);
    }
    // At the greatest depth the path may still go straight on.
    const bool at_end = path.depth - path.straight >= max_depth_;
    if (path.straight > kPassThroughMax || (at_end && is_black(bsdf.straight()))) {
      return path.out;
    }
    vertex.light_normal = bsdf.transmits() ? Vec3{} : shading.normal_geometric;
    if (!at_end) {
      add_direct(path, vertex, bsdf);
    }
    if (!scatter(path, vertex, bsdf) || path.depth - path.straight > max_depth_) {
      return path.out;
    }
  }
}

std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input) {
  return std::make_unique<PathIntegrator>(input);
}

}  // namespace core
