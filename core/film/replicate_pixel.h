/// ReplicatePixel: the statistics of one pixel in one replicate; the means of a pixel's halves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/color/rgb.h"
#include "core/math/numbers.h"

namespace core {

/// 24 bytes. mean_alpha is the share of samples that did not see through to a hidden environment.
struct ReplicatePixel {
  float mean_r = 0;
  float mean_g = 0;
  float mean_b = 0;
  float mean_alpha = 0;
  float m2_luminance = 0;
  std::uint32_t count = 0;
};

/// Mean over the replicates of a half, weighted by count; count is 0 where it has no sample.
struct HalfValue {
  Rgb mean;
  float alpha = 0;
  std::uint32_t count = 0;
};

/// replicates: of one pixel. half: 0 is A (even replicates), 1 is B (odd ones).
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

/// The halves of a pixel before white; where both are wholly transparent they stay.
inline void put_over_white(HalfValue& a, HalfValue& b) {
  if (a.alpha + b.alpha > 0) {
    a.mean += Rgb(1 - a.alpha);
    b.mean += Rgb(1 - b.alpha);
  }
}

}  // namespace core
