#include "core/transport/medium_sample.h"

#include <cmath>

#include "core/samplers/dimensions.h"

namespace core {

MediumStretch::MediumStretch(const PathState& path, const Medium* solid, float distance_m) noexcept
    : medium_(solid),
      fog_(solid == nullptr && path.media.empty() ? path.fog : nullptr),
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
  const auto at = sample_medium_depth(*medium_, probs_, depth_m_, Vec2{u.x, u.y});
  out.depth_m = at.depth_m;
  out.weight = at.weight;
  if (at.scatters) {
    out.scatterer = medium_;
    out.distance_m = is_fog() ? fog_->distance(origin_, direction_, at.depth_m) : at.depth_m;
  }
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
  path.alpha_tests = 0;
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
  out.albedo = medium.albedo();
  out.normal_world = -direction;
  out.depth_m = sample.distance_m;
}

}  // namespace core
