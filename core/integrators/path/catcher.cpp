#include "core/integrators/path/catcher.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/bsdf/clearcoat_lobe.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/transport/direct_light.h"
#include "core/transport/intersect.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {

namespace {

ClearcoatLobe smooth_coat(float weight, float mu) {
  BsdfLayers layers;
  layers.clearcoat = weight;
  constexpr float kIsSmooth = 1;  // any: only albedos are asked for
  return {layers, {0, 0, mu}, kIsSmooth};
}

/// The integral of 2 mu E(mu) from 0 to mu, E the albedo of a smooth coat. Exact: between the nodes
/// of its table E is linear in t = sqrt(mu), and the integrand 4 t^3 E dt.
double coat_reflects(double mu) {
  constexpr int kLast = kAlbedoNodes - 1;
  const double end = std::sqrt(mu);
  double sum = 0;
  for (int i = 0; i < kLast && i < end * kLast; ++i) {
    const auto albedo = [](int node) {
      return static_cast<double>(
          smooth_coat(1, static_cast<float>(node * node) / (kLast * kLast)).e_wo);
    };
    const double from = static_cast<double>(i) / kLast;
    const double slope = (albedo(i + 1) - albedo(i)) * kLast;
    const auto primitive = [&](double t) {
      return std::pow(t, 4) * (albedo(i) - slope * from + 0.8 * slope * t);
    };
    sum += primitive(std::min(static_cast<double>(i + 1) / kLast, end)) - primitive(from);
  }
  return sum;
}

}  // namespace

Rgb level_irradiance(const Environment& environment, float up, float coat) {
  const auto open = [coat](double mu) {
    return mu > 0 ? mu * mu - (coat > 0 ? static_cast<double>(coat) * coat_reflects(mu) : 0.0)
                  : 0.0;
  };
  const Environment::Map map = environment.map();
  if (map.width == 0) {
    return map.constant * (kPi * static_cast<float>(open(1)));
  }
  // The integral of the cosine over a texel is exact; the rotation is about the vertical axis.
  double r = 0;
  double g = 0;
  double b = 0;
  for (int y = 0; y < map.height; ++y) {
    const auto edge = [&](int row) {
      return open(static_cast<double>(up) * std::cos(std::numbers::pi * row / map.height));
    };
    const double weight = std::numbers::pi / map.width * std::fabs(edge(y) - edge(y + 1));
    for (int x = 0; x < map.width && weight > 0; ++x) {
      const Rgb texel =
          map.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                     static_cast<std::size_t>(x)];
      r += weight * static_cast<double>(texel.r);
      g += weight * static_cast<double>(texel.g);
      b += weight * static_cast<double>(texel.b);
    }
  }
  const float sun = std::max(up * environment.sun_world().y, 0.0F);
  return Rgb{static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)} +
         environment.sun_irradiance() * (sun * (1 - smooth_coat(coat, sun).e_wo));
}

BareGround::BareGround(const SceneData& scene, const Environment* environment,
                       const GroundSettings& ground)
    : scene_(scene), environment_(environment), albedo_(ground.color), coat_(ground.reflection) {
  if (environment != nullptr) {
    distant_ = {level_irradiance(*environment, 1, coat_),
                level_irradiance(*environment, -1, coat_)};
  }
}

Rgb BareGround::radiance(Vec3 point, Vec3 wo_world) const noexcept {
  const float up = wo_world.y > 0 ? 1.0F : -1.0F;
  Rgb irradiance = distant_[up > 0 ? 0 : 1];
  for (const PunctualLight& light : scene_.punctual_lights) {
    Vec3 wi_world;
    float distance_m = 0;
    const Rgb arriving = light.arriving(point, wi_world, distance_m);
    const float mu = std::max(up * wi_world.y, 0.0F);
    irradiance += arriving * (mu * (1 - smooth_coat(coat_, mu).e_wo));
  }
  const Rgb diffuse = albedo_ * irradiance * kInvPi;
  if (!(coat_ > 0)) {
    return diffuse;
  }
  const float mu = std::fabs(wo_world.y);
  const ClearcoatLobe coat = smooth_coat(coat_, mu);
  Rgb mirrored;
  if (environment_ != nullptr) {
    mirrored = environment_->background({-wo_world.x, wo_world.y, -wo_world.z}) * coat.fresnel(mu);
  }
  return diffuse * ((1 - coat.e_wo) / (1 - coat.e_average)) + mirrored;
}

template <typename Options>
Vec3 CatcherTracer<Options>::soft(const PathVertex& vertex, Vec3 wi_world, Vec2 u) const noexcept {
  const float sine2 = shadow_.softness * shadow_.softness;
  // Uniform over the cap: 1 - cos is linear in u.
  const float fall = u.x * sine2 / (1 + std::sqrt(1 - sine2));
  const float sine = std::sqrt(fall * (2 - fall));
  const float phi = kTwoPi * u.y;
  const Vec3 wi =
      frame_from_normal(wi_world).to_world({sine * std::cos(phi), sine * std::sin(phi), 1 - fall});
  const Vec3 n = vertex.shading.horizon;
  return wi - n * std::min(2 * dot(wi, n), 0.0F);  // mirrored at the ground
}

template <typename Options>
float CatcherTracer<Options>::inside_border(Vec2 film_px) const noexcept {
  if (!has_border_) {
    return 1;
  }
  constexpr float kWidth = 1.0F / 8;  // of the shorter side
  const auto width = static_cast<float>(film_.width);
  const auto height = static_cast<float>(film_.height);
  const float inside = std::min({film_px.x, film_px.y, width - film_px.x, height - film_px.y});
  const float t = std::clamp(inside / (kWidth * std::min(width, height)), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// Adds a light sample, which the model may occlude.
template <typename Options>
void CatcherTracer<Options>::add_light_sample(TracedPath& path, const PathVertex& vertex,
                                              const Bsdf& bsdf, Changes& changes) const noexcept {
  const DirectLight direct = sample_direct_light(path, vertex, bsdf, paths_.lights());
  if (is_black(direct.value)) {
    return;
  }
  const LightSample& light = direct.light;
  const Rgb value = direct.value * (direct.weight(paths_.options().mis) / light.pdf_solid_angle);
  Vec3 wi = light.wi_world;
  Vec3 target = light.target;
  if (is_soft() && !is_of_model(light)) {
    const Vec4 v = path.sampler.get_4d(choice_group(path.depth));
    wi = soft(vertex, wi, {v.x, v.y});
    target = vertex.shading.origin + wi * length(light.target - vertex.shading.origin);
  }
  const Rgb open = visibility_from(scene_, path, vertex, wi, target, light.is_far).transmittance;
  if (is_of_model(light)) {
    changes.diffuse.bounced += value * open;
  } else {
    changes.diffuse.blocked += value * (Rgb(1) - open);
  }
}

/// Samples a BSDF direction: it hits the model, or sees the environment with and without the model.
template <typename Options>
void CatcherTracer<Options>::add_direction(TracedPath& path, const PathVertex& vertex,
                                           const Bsdf& bsdf, Changes& changes) const noexcept {
  const int depth = path.depth;
  const Vec4 u = path.sampler.get_4d(dimension_group(depth, BounceGroup::kBsdf));
  const BsdfSample sample = bsdf.sample(u.x, {u.y, u.z});
  if (is_black(sample.weight)) {
    return;
  }
  Change& change = sample.is_delta ? changes.mirrored : changes.diffuse;
  const bool softens = is_soft() && !sample.is_delta;
  const Vec3 wi = vertex.shading.frame.to_world(sample.wi_local);
  Rgb hidden;  // fraction of the environment that a softened shadow takes
  if (softens) {
    const Vec4 v = path.sampler.get_4d(choice_group(depth));
    hidden =
        Rgb(1) -
        visibility_from(scene_, path, vertex, soft(vertex, wi, {v.z, v.w}), {}, true).transmittance;
  }
  scatter(scene_, path, vertex, sample, 1);
  RawHit hit;
  ++path.rays;
  const bool is_met = scene_.accel->intersect(path.ray, hit);
  if (!is_met && is_black(hidden)) {
    return;
  }
  Rgb kept_away;
  if (environment_ != nullptr) {
    const FoundLight found = found_background(*environment_, paths_.lights(), path);
    kept_away = path.beta * found.radiance * found.weight(paths_.options().mis, path.last);
  }
  if (is_met) {
    path.met = &hit;
    paths_.follow(path);
    // The ray may leave the scene through holes.
    change.bounced += path.out.radiance - (path.out.hit ? Rgb{} : kept_away);
    hidden = softens ? hidden : Rgb(path.out.hit ? 1.0F : 0.0F);
  }
  change.blocked += kept_away * hidden;
}

template <typename Options>
void CatcherTracer<Options>::catch_light(TracedPath& path, PathVertex& vertex,
                                         Vec2 film_px) const noexcept {
  vertex.light_normal = vertex.shading.horizon;
  const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
  if (!path.out.hit) {
    record_first_surface(path.out, vertex, bsdf.albedo());
  }
  Changes changes;
  if (!paths_.is_at_max_depth(path)) {
    TracedPath from{path};
    from.beta = Rgb(1);
    from.out = {};
    add_light_sample(from, vertex, bsdf, changes);
    add_direction(from, vertex, bsdf, changes);
  }
  const Caught out = caught(changes, bare_.radiance(vertex.point.position, vertex.wo_world),
                            path.ray.direction, film_px);
  path.out.radiance += path.beta * out.color;
  path.out.alpha -= luminance(path.beta) * (1 - out.alpha);
}

template <typename Options>
auto CatcherTracer<Options>::caught(Changes changes, Rgb bare, Vec3 direction,
                                    Vec2 film_px) const noexcept -> Caught {
  changes.diffuse.blocked *= shadow_.strength;
  const auto share = [](float part, float whole) { return whole > 0 ? part / whole : 0.0F; };
  const std::optional<Rgb> seen = backdrop_.seen(direction);
  const Rgb blocked = changes.diffuse.blocked + changes.mirrored.blocked;
  const Rgb bounced = changes.diffuse.bounced + changes.mirrored.bounced;
  float alpha = 0;
  Rgb color;
  if (shadow_.color == ShadowColor::kNeutral) {
    // Bounced light takes part of the shadow away, which is as strong as its strength.
    const Rgb diffuse = changes.diffuse.blocked - changes.diffuse.bounced * shadow_.strength;
    alpha = share(luminance(diffuse), luminance(bare)) * inside_border(film_px) +
            share(luminance(changes.mirrored.blocked), luminance(bare));
    color = changes.mirrored.bounced + (seen ? *seen * (1 - alpha) : Rgb{});
  } else if (seen) {
    const Rgb part = {share(blocked.r, bare.r), share(blocked.g, bare.g), share(blocked.b, bare.b)};
    color = *seen * (Rgb(1) - part) + bounced;
  } else {
    alpha = share(luminance(blocked), luminance(bare));
    color = bounced - blocked + bare * alpha;
  }
  return {color, seen ? 1.0F : alpha};
}

template <typename Options>
PathSample CatcherTracer<Options>::trace(const Camera::CameraRay& camera_ray,
                                         const PathSampler& sampler,
                                         std::uint64_t& rays) const noexcept {
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  PathVertex vertex;
  while (paths_.next_vertex(path, vertex)) {
    if (catches(path, vertex)) {
      catch_light(path, vertex, camera_ray.film_px);
      return path.out;
    }
    if (!paths_.go_on(path, vertex, may_split(vertex))) {
      return path.out;
    }
  }
  return path.out;
}

template class CatcherTracer<StudyOptions>;
template class CatcherTracer<DefaultOptions>;
template class CatcherTracer<WholeOptions>;

std::unique_ptr<const Integrator> make_catcher(const IntegratorInput& input) {
  if (needs_whole_options(input)) {
    return std::make_unique<CatcherTracer<WholeOptions>>(input);
  }
  if (DefaultOptions::serves(input)) {
    return std::make_unique<CatcherTracer<DefaultOptions>>(input);
  }
  return std::make_unique<CatcherTracer<StudyOptions>>(input);
}

}  // namespace core
