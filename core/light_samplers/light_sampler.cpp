#include "core/light_samplers/light_sampler.h"

#include <algorithm>

#include "core/light_samplers/emitted_light.h"
#include "core/light_samplers/triangle_sample.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/sampling/warp.h"

namespace core {

LightSampler::LightSampler(const SceneData& scene, const Environment* environment, LightPick pick,
                           SkyDensity sky)
    : scene_(scene),
      environment_(environment != nullptr && !environment->is_black() ? environment : nullptr),
      pick_(pick),
      sky_(sky),
      triangles_(scene.triangle_lights.size()) {
  const auto& punctual = scene.punctual_lights;
  local_punctual_ = static_cast<std::size_t>(
      std::count_if(punctual.begin(), punctual.end(),
                    [](const PunctualLight& l) { return l.type != PunctualType::kDirectional; }));
  light_count_ = triangles_ + punctual.size() + (environment_ != nullptr ? 1 : 0);
  far_count_ = light_count_ - triangles_ - local_punctual_;
  float fluence = environment_ != nullptr ? environment_->power_luminance() : 0.0F;
  for (std::size_t i = local_punctual_; i < punctual.size(); ++i) {
    fluence += luminance(punctual[i].intensity);
  }
  irradiance_far_ = fluence / 4;
  if (pick_ == LightPick::kPower && light_count_ > 0) {
    power_ = Distribution1D(light_powers(scene, environment_));
  }
}

LightSample LightSampler::from_triangle(std::uint32_t light, Vec3 point, float prob,
                                        Vec2 u) const noexcept {
  LightSample s;
  const TriangleLight& t = scene_.triangle_lights[light];
  const TrianglePoint<float> at = sample_triangle(t, point, u);
  if (!(at.pdf_solid_angle > 0)) {
    return s;
  }
  s.wi_world = at.wi_world;
  s.target = at.target;
  s.triangle = light;
  s.light = light;
  s.place = at.place;
  s.prob_light = prob;
  s.pdf_solid_angle = prob * at.pdf_solid_angle;
  s.radiance = triangle_radiance(scene_, t, at.place, -s.wi_world);
  return s;
}

LightSample LightSampler::from_punctual(std::size_t light, Vec3 point, float prob) const noexcept {
  LightSample s;
  const PunctualLight& p = scene_.punctual_lights[light];
  float distance_m = 0;
  s.radiance = p.arriving(point, s.wi_world, distance_m);
  if (is_black(s.radiance)) {
    return s;
  }
  s.is_delta = true;
  s.light = static_cast<std::uint32_t>(triangles_ + light);
  s.prob_light = prob;
  s.is_far = p.type == PunctualType::kDirectional;
  s.target = s.is_far ? Vec3{} : p.position;
  s.pdf_solid_angle = prob;
  return s;
}

LightSample LightSampler::from_environment(Vec3 normal_world, float prob, Vec2 u) const noexcept {
  LightSample s;
  const EnvironmentSample e =
      environment_->has_sun() ? environment_->sample(u, sky_) : sample_sky(normal_world, u);
  s.wi_world = e.wi_world;
  s.radiance = e.radiance;
  s.is_far = true;
  s.light = static_cast<std::uint32_t>(light_count_ - 1);
  s.prob_light = prob;
  s.pdf_solid_angle = prob * e.pdf_solid_angle;
  return s;
}

LightSample LightSampler::sample(Vec3 point, Vec3 normal_world, float u_pick,
                                 Vec2 u) const noexcept {
  if (light_count_ == 0) {
    return {};
  }
  const auto pick =
      choose(Mask<1>::of(1), Vec3s<1>(point), Vec3s<1>(normal_world), Floats<1>(u_pick));
  return sample_of(static_cast<std::size_t>(pick.light.v[0]), pick.prob_light.v[0], point,
                   normal_world, u);
}

LightSample LightSampler::sample_of(std::size_t light, float prob, Vec3 point, Vec3 normal_world,
                                    Vec2 u) const noexcept {
  if (!(prob > 0)) {
    return {};
  }
  if (light < triangles_) {
    return from_triangle(static_cast<std::uint32_t>(light), point, prob, u);
  }
  if (light < triangles_ + scene_.punctual_lights.size()) {
    return from_punctual(light - triangles_, point, prob);
  }
  return from_environment(normal_world, prob, u);
}

LightSample LightSampler::sample_delta(Vec3 point, float u_pick) const noexcept {
  const std::size_t n = scene_.punctual_lights.size();
  if (n == 0) {
    return {};
  }
  const std::size_t light =
      std::min(static_cast<std::size_t>(u_pick * static_cast<float>(n)), n - 1);
  return from_punctual(light, point, 1 / static_cast<float>(n));
}

float LightSampler::pdf_triangle(std::uint32_t light, Vec3 point, Vec3 normal_world,
                                 float distance_m, float cos_light) const noexcept {
  const float prob = prob_light(light, point, normal_world);
  const float area = scene_.triangle_lights[light].area_m2;
  return area > 0 ? prob * area_to_solid_angle(1 / area, distance_m * distance_m, cos_light) : 0.0F;
}

float LightSampler::pdf_environment(Vec3 direction_world, Vec3 point,
                                    Vec3 normal_world) const noexcept {
  const bool has_map = environment_ != nullptr && !environment_->is_constant();
  const MapPoint<float> at =
      has_map ? environment_->map().point(direction_world) : MapPoint<float>{};
  return pdf_environment(direction_world, at, point, normal_world);
}

float LightSampler::prob_light(std::uint32_t light, Vec3 point, Vec3 normal_world) const noexcept {
  if (pick_ == LightPick::kUniform) {
    return 1 / static_cast<float>(light_count_);
  }
  if (pick_ == LightPick::kPower) {
    return power_.prob_cell(light);
  }
  const float by_tree =
      far_count_ == 0 ? 1.0F : prob_tree(scene_.light_tree.importance(point, normal_world));
  return light < triangles_ + local_punctual_
             ? by_tree * scene_.light_tree.prob_light(point, normal_world, light)
             : prob_each_far(by_tree);
}

}  // namespace core
