#include "core/light_samplers/emission_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/light_samplers/emitted_light.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/sampling/warp.h"
#include "core/scene/solids.h"

namespace core {

Rgb EmissionSample::weight() const noexcept {
  const float cosine = normal == Vec3{} ? 1.0F : dot(normal, ray.direction);
  const float density = pdf.prob_light * pdf.pdf_area * pdf.pdf_solid_angle;
  return density > 0 ? radiance * (cosine / density) : Rgb{};
}

EmissionSampler::EmissionSampler(const SceneData& scene, const Environment* environment)
    : scene_(scene),
      environment_(environment != nullptr && !environment->is_black() ? environment : nullptr),
      triangles_(static_cast<std::uint32_t>(scene.triangle_lights.size())),
      radius_m_(light_disk_radius_m(scene)),
      powers_(light_powers(scene, environment_)) {
  if (!scene_.solids.empty()) {
    find_starts();
  }
}

/// Where a light begins in other solids than its neighbourhood, each path finds its own.
void EmissionSampler::find_starts() {
  starts_.resize(1);
  for (const TriangleLight& t : scene_.triangle_lights) {
    for (const float side : {1.0F, -1.0F}) {
      // The centre, and close to the corners.
      constexpr float kNear = 0x1p-7F;
      const auto at = [&](float b1, float b2) {
        return offset_ray(t.p0 + t.edge1 * b1 + t.edge2 * b2, t.normal * side, t.error_m);
      };
      const std::array points = {at(1.0F / 3, 1.0F / 3), at(kNear, kNear), at(1 - 2 * kNear, kNear),
                                 at(kNear, 1 - 2 * kNear)};
      start_of_.push_back(side < 0 && !t.two_sided ? 0 : start_at(points));
    }
  }
  for (const PunctualLight& p : scene_.punctual_lights) {
    const bool is_local = p.type != PunctualType::kDirectional;
    start_of_.push_back(is_local ? start_at(std::span(&p.position, 1)) : 0);
  }
  if (starts_.size() == 1) {
    start_of_.clear();
  }
}

std::uint32_t EmissionSampler::start_at(std::span<const Vec3> points) {
  StartMedia start{solids_around(scene_, points.front()), false};
  for (const Vec3 point : points.subspan(1)) {
    start.varies = start.varies || !(solids_around(scene_, point) == start.media);
  }
  if (start.media.empty() && !start.varies) {
    return 0;
  }
  const auto same = std::find_if(starts_.begin(), starts_.end(), [&](const StartMedia& other) {
    return other.varies == start.varies && other.media == start.media;
  });
  if (same == starts_.end()) {
    starts_.push_back(start);
    return static_cast<std::uint32_t>(starts_.size() - 1);
  }
  return static_cast<std::uint32_t>(same - starts_.begin());
}

EmissionSample EmissionSampler::sample(float u_light, Vec2 u_position,
                                       Vec2 u_direction) const noexcept {
  if (empty()) {
    return {};
  }
  const auto light = static_cast<std::uint32_t>(powers_.sample(u_light).cell);
  EmissionSample s = light < triangles_ ? from_triangle(light, u_position, u_direction)
                                        : from_other(light, u_direction);
  s.light = light;
  s.pdf = pdf(light, s.ray.direction);
  if (is_distant(light)) {
    s.pdf.pdf_area = sample_disk(u_position, s.ray);
  }
  const std::size_t place =
      light < triangles_ ? 2 * std::size_t{light} +
                               (dot(s.normal, scene_.triangle_lights[light].normal) < 0 ? 1 : 0)
                         : std::size_t{light} + triangles_;
  if (place < start_of_.size() && start_of_[place] > 0) {
    s.start = &starts_[start_of_[place]];
  }
  return s;
}

EmissionSample EmissionSampler::from_triangle(std::uint32_t light, Vec2 u_position,
                                              Vec2 u_direction) const noexcept {
  EmissionSample s;
  const TriangleLight& t = scene_.triangle_lights[light];
  const Vec2 b = uniform_triangle(u_position);
  s.normal = t.normal;
  if (t.two_sided) {
    const bool front = u_direction.x < 0.5F;
    s.normal = front ? t.normal : -t.normal;
    u_direction.x = 2 * u_direction.x - (front ? 0.0F : 1.0F);
  }
  const Vec3 place = t.p0 + t.edge1 * b.x + t.edge2 * b.y;
  s.ray.origin = offset_ray(place, s.normal, t.error_m);
  s.ray.direction = frame_from_normal(s.normal).to_world(cosine_hemisphere(u_direction));
  s.radiance = triangle_radiance(scene_, t, place, s.ray.direction);
  return s;
}

/// Distant lights: without an origin.
EmissionSample EmissionSampler::from_other(std::uint32_t light, Vec2 u_direction) const noexcept {
  EmissionSample s;
  const PunctualLight* p = punctual(light);
  if (!is_distant(light)) {
    s.is_delta_position = true;
    s.ray.origin = p->position;
    s.ray.direction = p->sample_direction(u_direction);
    s.radiance = p->intensity * p->shape(s.ray.direction);
    return s;
  }
  if (p != nullptr) {
    s.is_delta_direction = true;
    s.ray.direction = p->direction;
    s.radiance = p->intensity;
  } else {
    const EnvironmentSample sky = environment_->sample(u_direction);
    s.ray.direction = -sky.wi_world;
    s.radiance = sky.radiance;
  }
  return s;
}

void EmissionSampler::aim(Vec3 eye, float near_m) noexcept {
  eye_ = eye;
  disks_ = 1;
  for (float radius = radius_m_; radius > 2 * near_m && near_m > 0; radius /= 2) {
    ++disks_;
  }
}

/// Moves the origin of the ray to a point of one of the disks, on the plane that touches the
/// scene's bounding sphere from behind. Returns its density [1/m^2].
float EmissionSampler::sample_disk(Vec2 u, Ray& ray) const noexcept {
  const auto count = static_cast<float>(disks_);
  const float scaled = u.x * count;
  const int chosen = std::min(static_cast<int>(scaled), disks_ - 1);
  u.x = std::min(scaled - static_cast<float>(chosen), kOneMinusEpsilon);
  const Frame frame = frame_from_normal(ray.direction);
  const Vec3 eye = frame.to_local(eye_ - scene_.center) * (1 / radius_m_);
  const Vec2 d = concentric_disk(u);
  const float width = std::ldexp(1.0F, -chosen);
  Vec2 at = {d.x * width, d.y * width};
  if (chosen > 0) {
    at = {eye.x + at.x, eye.y + at.y};
  }
  ray.origin = scene_.center + frame.to_world({at.x, at.y, -1}) * radius_m_;
  float density = square(at.x) + square(at.y) <= 1 || chosen == 0 ? 1.0F : 0.0F;
  const float from_eye = square(at.x - eye.x) + square(at.y - eye.y);
  for (int i = 1; i < disks_; ++i) {
    const float radius2 = std::ldexp(1.0F, -2 * i);
    density += from_eye <= radius2 || i == chosen ? 1 / radius2 : 0.0F;
  }
  return density / (count * kPi * square(radius_m_));
}

/// Returns null for triangles and the environment.
const PunctualLight* EmissionSampler::punctual(std::uint32_t light) const noexcept {
  const std::size_t i = std::size_t{light} - triangles_;
  return light >= triangles_ && i < scene_.punctual_lights.size() ? &scene_.punctual_lights[i]
                                                                  : nullptr;
}

bool EmissionSampler::is_distant(std::uint32_t light) const noexcept {
  const PunctualLight* p = punctual(light);
  return light >= triangles_ && (p == nullptr || p->type == PunctualType::kDirectional);
}

EmissionPdf EmissionSampler::pdf(std::uint32_t light, Vec3 direction_world) const noexcept {
  EmissionPdf out{.prob_light = powers_.prob_cell(light)};
  const float disk_area_m2 = kPi * square(radius_m_);
  if (light < triangles_) {
    const TriangleLight& t = scene_.triangle_lights[light];
    const float cosine = dot(t.normal, direction_world);
    out.pdf_area = t.area_m2 > 0 ? 1 / t.area_m2 : 0.0F;
    out.pdf_solid_angle =
        t.two_sided ? 0.5F * kInvPi * std::fabs(cosine) : cosine_hemisphere_pdf_solid_angle(cosine);
  } else if (const PunctualLight* p = punctual(light); p == nullptr) {
    out.pdf_area = 1 / disk_area_m2;
    out.pdf_solid_angle = environment_->pdf_solid_angle(-direction_world);
  } else if (p->type == PunctualType::kDirectional) {
    out.pdf_area = 1 / disk_area_m2;
    out.pdf_solid_angle = 1;
  } else {
    out.pdf_area = 1;
    out.pdf_solid_angle = p->pdf_solid_angle(direction_world);
  }
  return out;
}

float EmissionSampler::range_factor(std::uint32_t light, float distance_m) const noexcept {
  const PunctualLight* p = punctual(light);
  return p == nullptr ? 1.0F : p->range_factor(distance_m * distance_m);
}

}  // namespace core
