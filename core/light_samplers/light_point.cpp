// Light samples independent of the point that they were drawn for.
#include <cmath>

#include "core/light_samplers/emitted_light.h"
#include "core/light_samplers/light_sampler.h"
#include "core/light_samplers/triangle_sample.h"
#include "core/math/offset_ray.h"

namespace core {

LightPoint LightSampler::point_of(const LightSample& sample) const noexcept {
  LightPoint out;
  if (!(sample.pdf_solid_angle > 0) || is_black(sample.radiance)) {
    return out;
  }
  const bool is_triangle = sample.light < triangles_;
  out.light = sample.light;
  out.place = is_triangle ? sample.place : (sample.is_far ? sample.wi_world : sample.target);
  out.radiance = sample.radiance;
  out.pdf_measure = is_triangle ? sample.prob_light / scene_.triangle_lights[sample.light].area_m2
                                : sample.pdf_solid_angle;
  return out;
}

LightView LightSampler::view(const LightPoint& light, Vec3 point) const noexcept {
  LightView out;
  if (light.light == kNoLight) {
    return out;
  }
  const std::size_t punctual = scene_.punctual_lights.size();
  if (light.light < triangles_) {
    const TriangleLight& t = scene_.triangle_lights[light.light];
    const Vec3 d = light.place - point;
    const float distance2 = dot(d, d);
    if (!(distance2 > 0)) {
      return out;
    }
    out.wi_world = d * (1 / std::sqrt(distance2));
    const float cos_front = -dot(t.normal, out.wi_world);
    const float cos_light = t.two_sided ? std::fabs(cos_front) : cos_front;
    if (cos_light > kCosLightLeast) {
      out.radiance =
          t.is_coated ? triangle_radiance(scene_, t, light.place, -out.wi_world) : light.radiance;
      out.solid_angle = out.geometric = cos_light / distance2;
    }
  } else if (light.light < triangles_ + punctual) {
    const PunctualLight& p = scene_.punctual_lights[light.light - triangles_];
    float distance_m = 0;
    out.is_delta = true;
    out.is_far = p.type == PunctualType::kDirectional;
    out.radiance = p.arriving(point, out.wi_world, distance_m);
    if (!is_black(out.radiance)) {
      out.solid_angle = 1;
      out.geometric = out.is_far ? 1 : 1 / (distance_m * distance_m);
    }
  } else {
    out.is_far = true;
    out.wi_world = light.place;
    out.radiance = light.radiance;
    out.solid_angle = out.geometric = 1;
  }
  return out;
}

Vec3 LightSampler::target(const LightPoint& light, const LightView& view,
                          Vec3 point) const noexcept {
  if (light.light < triangles_) {
    const TriangleLight& t = scene_.triangle_lights[light.light];
    return offset_ray(light.place, dot(t.normal, view.wi_world) > 0 ? -t.normal : t.normal,
                      plane_error_m(t.error_m, length(light.place - point)));
  }
  return view.is_far ? Vec3{} : scene_.punctual_lights[light.light - triangles_].position;
}

float LightSampler::pdf_measure(const LightPoint& light, Vec3 point,
                                Vec3 normal_world) const noexcept {
  if (!(view(light, point).solid_angle > 0)) {
    return 0;
  }
  const float prob = prob_light(light.light, point, normal_world);
  return light.light < triangles_ ? prob / scene_.triangle_lights[light.light].area_m2 : prob;
}

float LightSampler::pdf_solid_angle(const LightPoint& light, const LightView& view, Vec3 point,
                                    Vec3 normal_world) const noexcept {
  if (light.light >= triangles_) {
    return pdf_environment(view.wi_world, point, normal_world);
  }
  const float cos_light = std::fabs(dot(scene_.triangle_lights[light.light].normal, view.wi_world));
  return pdf_triangle(light.light, point, normal_world, length(light.place - point), cos_light);
}

}  // namespace core
