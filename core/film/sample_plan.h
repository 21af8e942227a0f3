/// Sample counts of pixels under adaptive sampling, and the pilot samples that may determine them.
///
/// The sample count of a film is the mean over its pixels, summed over replicates. An epoch is an
/// interval of that mean. Its plan gives the count of each half of a pixel at both ends, and
/// planned_count() interpolates. It is a pure function, so slices, pauses and restarts change
/// nothing.
#pragma once

#include <cstdint>

#include "core/color/rgb.h"

namespace core {

/// Statistics of single samples of a pixel, from a separate stream that never enters the image. 32
/// bytes.
struct PilotPixel {
  Rgb mean;
  Rgb m2;          ///< sum of squared deviations from the mean (Welford)
  float rays = 0;  ///< mean per sample
  std::uint32_t count = 0;
};

/// Mean samples per pixel at both ends of an epoch. If `to` is 0 there is no epoch.
struct PlanSpan {
  int from = 0;
  int to = 0;
  friend constexpr bool operator==(const PlanSpan&, const PlanSpan&) = default;
};

/// Samples of each half of one pixel at both ends of the span. 8 bytes.
struct PixelPlan {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
};

/// planned_count() returns the samples of a half when the film has `samples` on average, with
/// span.from <= samples <= span.to. It interpolates linearly in whole steps; both ends are
/// multiples of a step. The phase differs between neighbouring pixels (additive recurrence of
/// Roberts' R2 sequence), so that the mean stays close to `samples`. x, y: pixel of the full film.
struct PlanPosition {
  PlanSpan span;
  int step = 1;  ///< samples added to a half at once
  int x = 0;
  int y = 0;
};
constexpr std::uint32_t planned_count(const PixelPlan& plan, const PlanPosition& at,
                                      int samples) noexcept {
  const auto step = static_cast<std::uint64_t>(at.step);
  const std::uint64_t units = (plan.to - plan.from) / step;
  const auto done = static_cast<std::uint64_t>(samples - at.span.from);
  const auto length = static_cast<std::uint64_t>(at.span.to - at.span.from);
  // 2^16 / g and 2^16 / g^2, where g is the plastic number.
  const std::uint64_t phase =
      (static_cast<std::uint64_t>(at.x) * 49471U + static_cast<std::uint64_t>(at.y) * 37345U) &
      0xFFFFU;
  return plan.from + static_cast<std::uint32_t>(
                         step * (((units * done << 16U) + phase * length) / (length << 16U)));
}

/// Returns the samples of half A (0) or B (1) of a pixel without a plan. Sample s belongs to
/// replicate s % replicates.
constexpr int uniform_count(int samples, int replicates, int half) noexcept {
  const int rest = samples % replicates;
  return samples / replicates * (replicates / 2) + (rest + 1 - half) / 2;
}

/// Returns the index of sample k of a half; the inverse of uniform_count().
constexpr int sample_of_half(std::uint32_t k, int replicates, int half) noexcept {
  const auto per = static_cast<std::uint32_t>(replicates) / 2;
  return static_cast<int>(k / per) * replicates + 2 * static_cast<int>(k % per) + half;
}

}  // namespace core
