#include "core/transport/medium_sample.h"

#include <cmath>

#include "core/samplers/dimensions.h"

namespace core {
namespace {

/// Returns the probabilities of selecting each channel, from the path's throughput.
Rgb channel_probs(Rgb beta) noexcept {
  const Rgb size = {std::fabs(beta.r), std::fabs(beta.g), std::fabs(beta.b)};
  const float sum = size.r + size.g + size.b;
  return sum > 0 ? size / sum : Rgb(1.0F / 3);
}

int pick_channel(Rgb probs, float u) noexcept {
  if (u < probs.r) {
    return 0;
  }
  // The last channel that can be: rounding never picks one of probability 0.
  return u < probs.r + probs.g || !(probs.b > 0) ? (probs.g > 0 ? 1 : 0) : 2;
}

/// Widening of the ray cone where it scatters [rad]: that of a rough surface.
constexpr float kMediumConeSpread = 0.1F;

float sum_of(Rgb c) noexcept { return c.r + c.g + c.b; }

}  // namespace

MediumStretch::MediumStretch(const PathState& path, const Medium* solid, float distance_m) noexcept
    : medium_(solid),
      fog_(solid == nullptr ? path.fog : nullptr),
      origin_(path.ray.origin),
      direction_(path.ray.direction),
      length_m_(distance_m),
      depth_m_(solid != nullptr ? distance_m : 0.0F),
      probs_(channel_probs(path.beta)) {
  if (fog_ != nullptr) {
    medium_ = &fog_->medium();
    depth_m_ = fog_->depth(origin_, direction_, distance_m);
  }
}

MediumSample MediumStretch::sample(const PathState& path) const noexcept {
  MediumSample out;
  if (!(depth_m_ > 0)) {
    return out;
  }
  const Rgb sigma_t = medium_->sigma_t;
  if (!medium_->scatters()) {
    out.weight = transmittance(sigma_t, depth_m_);
    return out;
  }
  Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume));
  if (path.solid_holes > 0) {  // numbers of its own for each part of a segment
    constexpr std::uint32_t kVolumeDraws = 0x40000000U;
    u.x = path.sampler.extra_1d(path.depth, kVolumeDraws + 2 * path.solid_holes);
    u.y = path.sampler.extra_1d(path.depth, kVolumeDraws + 2 * path.solid_holes + 1);
  }
  const float sigma = sigma_t[pick_channel(probs_, u.x)];
  const float at_m = sigma > 0 ? -std::log1p(-u.y) / sigma : depth_m_;
  if (!(at_m < depth_m_)) {
    const Rgb passed = transmittance(sigma_t, depth_m_);
    out.weight = passed / sum_of(probs_ * passed);
    out.depth_m = depth_m_;
    return out;
  }
  const Rgb passed = transmittance(sigma_t, at_m);
  out.scatterer = medium_;
  out.depth_m = at_m;
  out.distance_m = is_fog() ? fog_->distance(origin_, direction_, at_m) : at_m;
  out.weight = medium_->sigma_s * passed / sum_of(probs_ * sigma_t * passed);
  return out;
}

MediumStretch::Point MediumStretch::at(float distance_m) const noexcept {
  Point out{.point = origin_ + direction_ * distance_m};
  float depth_m = distance_m;
  if (is_fog()) {
    depth_m = fog_->depth(origin_, direction_, distance_m);
    out.density = fog_->density(out.point);
  }
  out.passed = transmittance(medium_->sigma_t, depth_m);
  out.pdf_m = sum_of(probs_ * medium_->sigma_t * out.passed) * out.density;
  return out;
}

Fog::Range MediumStretch::range() const noexcept {
  return is_fog() ? fog_->range(origin_, direction_, length_m_) : Fog::Range{0, length_m_};
}

Vec3 MediumStretch::median() const noexcept {
  const float sigma = sum_of(medium_->sigma_t) / 3;
  const float at_m = -std::log1p(0.5F * std::expm1(-sigma * depth_m_)) / sigma;
  return origin_ + direction_ * (is_fog() ? fog_->distance(origin_, direction_, at_m) : at_m);
}

void scatter_within(PathState& path, const Medium& medium, Vec3 point, Vec2 u) noexcept {
  const Vec3 before = path.ray.direction;
  path.ray.origin = point;
  path.media.begin_segment();
  path.solid_holes = 0;
  path.passed_m = 0;
  path.ray.direction = sample_henyey_greenstein(before, medium.g, u);
  path.ray.t_max = Ray{}.t_max;
  path.last = {henyey_greenstein(dot(before, path.ray.direction), medium.g), point, {}, 1};
  path.cone_spread_rad += kMediumConeSpread;
  path.is_sharp = false;
  ++path.depth;
  ++path.medium_scatterings;
  path.is_clear = false;
}

void record_first_scattering(PathSample& out, const MediumSample& sample, Vec3 direction) noexcept {
  const Medium& medium = *sample.scatterer;
  out.hit = true;
  out.albedo = {medium.sigma_t.r > 0 ? medium.sigma_s.r / medium.sigma_t.r : 0.0F,
                medium.sigma_t.g > 0 ? medium.sigma_s.g / medium.sigma_t.g : 0.0F,
                medium.sigma_t.b > 0 ? medium.sigma_s.b / medium.sigma_t.b : 0.0F};
  out.normal_world = -direction;
  out.depth_m = sample.distance_m;
}

}  // namespace core
