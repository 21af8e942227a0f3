/// ReplicatePixel: statistics of one replicate of a pixel; HalfValue: means of a pixel's halves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/color/rgb.h"
#include "core/math/numbers.h"

namespace core {

/// 24 bytes. mean_alpha is the fraction of samples that did not see a hidden environment.
struct ReplicatePixel {
  float mean_r = 0;
  float mean_g = 0;
  float mean_b = 0;
  float mean_alpha = 0;
  float m2_luminance = 0;
  std::uint32_t count = 0;
};

/// Mean over the replicates of a half, weighted by count. count is 0 if the half has no samples.
struct HalfValue {
  Rgb mean;
  float alpha = 0;
  std::uint32_t count = 0;
};

/// Returns the mean of half 0 (A, even replicates) or 1 (B, odd replicates) of one pixel.
inline HalfValue half_value(std::span<const ReplicatePixel> replicates, int half) {
  HalfValue out;
  for (auto k = static_cast<std::size_t>(half); k < replicates.size(); k += 2) {
    const ReplicatePixel& p = replicates[k];
    if (p.count == 0) {
      continue;
    }
    if (out.count == 0) {
      out = {{p.mean_r, p.mean_g, p.mean_b}, p.mean_alpha, p.count};
      continue;
    }
    out.count += p.count;
    const float w = static_cast<float>(p.count) / static_cast<float>(out.count);
    out.mean = lerp(out.mean, {p.mean_r, p.mean_g, p.mean_b}, w);
    out.alpha = lerp(out.alpha, p.mean_alpha, w);
  }
  return out;
}

/// Returns (A + B) / 2, or A if B is empty. The halves are not weighted by their counts, because
/// each count may depend on the samples of the other half. (A - B)^2 / 4 estimates the variance of
/// exactly this value. Alpha is in [0,1].
inline HalfValue pixel_value(const HalfValue& a, const HalfValue& b) {
  const float w = b.count == 0 ? 0.0F : a.count == 0 ? 1.0F : 0.5F;
  return {lerp(a.mean, b.mean, w), lerp(a.alpha, b.alpha, w), a.count + b.count};
}

/// Returns whether no sample of either half saw anything. By noise, the alpha of a shadow catcher's
/// half may also be negative.
inline bool is_empty(const HalfValue& a, const HalfValue& b) {
  return a.alpha == 0 && b.alpha == 0;
}

/// Composites both halves of a pixel over white. If it is empty they stay unchanged.
inline void put_over_white(HalfValue& a, HalfValue& b) {
  if (!is_empty(a, b)) {
    a.mean += Rgb(1 - a.alpha);
    b.mean += Rgb(1 - b.alpha);
  }
}

}  // namespace core
