#include "core/light_samplers/emission_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/light_samplers/emitted_light.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/offset_ray.h"
#include "core/sampling/warp.h"
#include "core/scene/solids.h"

namespace core {
namespace {

/// Of the cone around a ball. x: squared sine of its half angle, below 1.
float one_minus_cosine(float x) noexcept { return x / (1 + std::sqrt(1 - x)); }

/// Uniform in the cone from `from` around the ball, or in all directions within it.
Vec3 direction_into(const EmissionTarget& ball, Vec3 from, Vec2 u) noexcept {
  const Vec3 to = ball.center - from;
  const float sine2 = square(ball.radius_m) / dot(to, to);
  if (!(sine2 < 1)) {
    return uniform_sphere(u);
  }
  return frame_from_normal(normalize(to)).to_world(in_cone(u.x * one_minus_cosine(sine2), u.y));
}

}  // namespace

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
  const EmissionTarget* target =
      aims_local_ && !is_distant(light) ? choose_target(u_direction.x) : nullptr;
  EmissionSample s = light < triangles_ ? from_triangle(light, u_position, u_direction, target)
                                        : from_other(light, u_direction, target);
  s.light = light;
  s.pdf = {powers_.prob_cell(light), 1, own_pdf_solid_angle(light, s.ray.direction)};
  if (is_distant(light)) {
    s.pdf.pdf_area = sample_disk(u_position, s.ray);
  } else {
    if (light < triangles_) {
      const float area_m2 = scene_.triangle_lights[light].area_m2;
      s.pdf.pdf_area = area_m2 > 0 ? 1 / area_m2 : 0.0F;
    }
    if (aims_local_) {
      s.pdf.pdf_solid_angle = own_share_ * s.pdf.pdf_solid_angle +
                              pdf_targets(s.ray.origin, s.ray.direction, false, target);
    }
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
                                              Vec2 u_direction,
                                              const EmissionTarget* target) const noexcept {
  EmissionSample s;
  const TriangleLight& t = scene_.triangle_lights[light];
  const Vec2 b = uniform_triangle(u_position);
  const Vec3 place = t.p0 + t.edge1 * b.x + t.edge2 * b.y;
  if (target != nullptr) {
    s.ray.direction = direction_into(*target, place, u_direction);
    s.normal = t.two_sided && dot(t.normal, s.ray.direction) < 0 ? -t.normal : t.normal;
  } else {
    bool front = true;
    if (t.two_sided) {
      front = u_direction.x < 0.5F;
      u_direction.x = 2 * u_direction.x - (front ? 0.0F : 1.0F);
    }
    s.normal = front ? t.normal : -t.normal;
    s.ray.direction = frame_from_normal(s.normal).to_world(cosine_hemisphere(u_direction));
  }
  s.ray.origin = offset_ray(place, s.normal, t.error_m);
  if (dot(s.normal, s.ray.direction) > 0) {
    s.radiance = triangle_radiance(scene_, t, place, s.ray.direction);
  }
  return s;
}

/// Distant lights: without an origin.
EmissionSample EmissionSampler::from_other(std::uint32_t light, Vec2 u_direction,
                                           const EmissionTarget* target) const noexcept {
  EmissionSample s;
  const PunctualLight* p = punctual(light);
  if (!is_distant(light)) {
    s.is_delta_position = true;
    s.ray.origin = p->position;
    s.ray.direction = target != nullptr ? direction_into(*target, p->position, u_direction)
                                        : p->sample_direction(u_direction);
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

void EmissionSampler::aim(std::vector<EmissionTarget> targets,
                          const std::vector<float>& light_shares) {
  own_share_ = 1;
  for (const EmissionTarget& target : targets) {
    own_share_ -= target.share;
  }
  targets_ = std::move(targets);
  aims_local_ = true;
  std::vector<float> powers = light_powers(scene_, environment_);
  const double total = std::accumulate(powers.begin(), powers.end(), 0.0);
  const double aimed = std::accumulate(light_shares.begin(), light_shares.end(), 0.0);
  if (total > 0 && aimed > 0) {
    for (std::size_t i = 0; i < powers.size(); ++i) {
      powers[i] =
          static_cast<float>(static_cast<double>(own_share_ * powers[i]) / total +
                             static_cast<double>((1 - own_share_) * light_shares[i]) / aimed);
    }
  }
  powers_ = Distribution1D(powers);
}

void EmissionSampler::aim(Vec3 eye, float near_m) {
  targets_.clear();
  for (float radius = radius_m_; radius > 2 * near_m && near_m > 0; radius /= 2) {
    targets_.push_back({eye, radius / 2, 0});
  }
  own_share_ = 1 / static_cast<float>(targets_.size() + 1);
  for (EmissionTarget& target : targets_) {
    target.share = own_share_;
  }
}

const EmissionTarget* EmissionSampler::choose_target(float& u) const noexcept {
  const EmissionTarget* chosen = nullptr;
  float below = 0;
  float share = own_share_;
  for (const EmissionTarget& target : targets_) {
    if (u - below < share) {
      break;
    }
    below += share;
    share = target.share;
    chosen = &target;
  }
  u = std::min((u - below) / share, kOneMinusEpsilon);
  return chosen;
}

float EmissionSampler::pdf_targets(Vec3 origin, Vec3 direction, bool is_distant,
                                   const EmissionTarget* chosen) const noexcept {
  float sum = 0;
  for (const EmissionTarget& target : targets_) {
    const Vec3 to = target.center - origin;
    const Vec3 off = cross(to, direction);
    const float radius2 = square(target.radius_m);
    const bool is_hit = dot(off, off) <= radius2 || &target == chosen;
    if (is_distant) {
      sum += is_hit ? target.share / (kPi * radius2) : 0.0F;
    } else if (dot(to, to) <= radius2) {
      sum += target.share / (4 * kPi);
    } else if (is_hit && dot(to, direction) > 0) {
      sum += target.share / (kTwoPi * one_minus_cosine(radius2 / dot(to, to)));
    }
  }
  return sum;
}

/// Rays beside the scene's own disk, from a ball that sticks out of it, meet nothing.
float EmissionSampler::pdf_disk(Vec3 origin, Vec3 direction,
                                const EmissionTarget* chosen) const noexcept {
  return own_share_ / (kPi * square(radius_m_)) + pdf_targets(origin, direction, true, chosen);
}

float EmissionSampler::sample_disk(Vec2 u, Ray& ray) const noexcept {
  const EmissionTarget* target = choose_target(u.x);
  const Frame frame = frame_from_normal(ray.direction);
  const Vec2 d = concentric_disk(u);
  const float radius = target != nullptr ? target->radius_m : radius_m_;
  const Vec3 off = (target != nullptr ? target->center : scene_.center) - scene_.center;
  const Vec3 at = off + frame.to_world({d.x, d.y, 0}) * radius;
  ray.origin = scene_.center + at - ray.direction * (dot(at, ray.direction) + radius_m_);
  return pdf_disk(ray.origin, ray.direction, target);
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

float EmissionSampler::own_pdf_solid_angle(std::uint32_t light,
                                           Vec3 direction_world) const noexcept {
  if (light < triangles_) {
    const TriangleLight& t = scene_.triangle_lights[light];
    const float cosine = dot(t.normal, direction_world);
    return t.two_sided ? 0.5F * kInvPi * std::fabs(cosine)
                       : cosine_hemisphere_pdf_solid_angle(cosine);
  }
  const PunctualLight* p = punctual(light);
  if (p == nullptr) {
    return environment_->pdf_solid_angle(-direction_world);
  }
  return p->type == PunctualType::kDirectional ? 1.0F : p->pdf_solid_angle(direction_world);
}

EmissionPdf EmissionSampler::pdf(std::uint32_t light, Vec3 origin,
                                 Vec3 direction_world) const noexcept {
  EmissionPdf out = {powers_.prob_cell(light), 1, own_pdf_solid_angle(light, direction_world)};
  if (is_distant(light)) {
    out.pdf_area = pdf_disk(origin, direction_world);
    return out;
  }
  if (light < triangles_) {
    const float area_m2 = scene_.triangle_lights[light].area_m2;
    out.pdf_area = area_m2 > 0 ? 1 / area_m2 : 0.0F;
  }
  if (aims_local_) {
    out.pdf_solid_angle =
        own_share_ * out.pdf_solid_angle + pdf_targets(origin, direction_world, false);
  }
  return out;
}

float EmissionSampler::range_factor(std::uint32_t light, float distance_m) const noexcept {
  const PunctualLight* p = punctual(light);
  return p == nullptr ? 1.0F : p->range_factor(distance_m * distance_m);
}

}  // namespace core
