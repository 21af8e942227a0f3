#include "core/transport/medium_sample.h"

#include <cmath>

#include "core/samplers/dimensions.h"

namespace core {
namespace {

/// Probabilities of picking the channels by what the path carries.
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

float sum_of(Rgb c) noexcept { return c.r + c.g + c.b; }

}  // namespace

MediumSample sample_medium(const PathState& path, const Medium* solid, float distance_m) noexcept {
  MediumSample out;
  const Medium* medium = solid;
  float depth_m = distance_m;
  if (solid == nullptr && path.fog != nullptr) {
    medium = &path.fog->medium();
    depth_m = path.fog->depth(path.ray.origin, path.ray.direction, distance_m);
  }
  if (medium == nullptr || !(depth_m > 0)) {
    return out;
  }
  const Rgb sigma_t = medium->sigma_t;
  if (!medium->scatters()) {
    out.weight = transmittance(sigma_t, depth_m);
    return out;
  }
  const Vec4 u = path.sampler.get_4d(dimension_group(path.depth, BounceGroup::kVolume));
  const Rgb probs = channel_probs(path.beta);
  const float sigma = sigma_t[pick_channel(probs, u.x)];
  const float at_m = sigma > 0 ? -std::log1p(-u.y) / sigma : depth_m;
  if (!(at_m < depth_m)) {
    const Rgb passed = transmittance(sigma_t, depth_m);
    out.weight = passed / sum_of(probs * passed);
    return out;
  }
  const Rgb passed = transmittance(sigma_t, at_m);
  out.scatterer = medium;
  out.distance_m =
      solid != nullptr ? at_m : path.fog->distance(path.ray.origin, path.ray.direction, at_m);
  out.weight = medium->sigma_s * passed / sum_of(probs * sigma_t * passed);
  return out;
}

}  // namespace core
