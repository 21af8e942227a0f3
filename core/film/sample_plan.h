/// How many samples each pixel has by when, and the pilot samples that may decide it.
///
/// Sample counts of a film are named by their mean over its pixels, all replicates together. An
/// epoch is a span of that mean; its plan says what each half of a pixel has at both ends of the
/// span, and planned_count() what it has in between: a pure function, so that slices, pauses and
/// restarts change nothing.
#pragma once

#include <cstdint>

#include "core/color/rgb.h"

namespace core {

/// What single samples of a pixel look like, of a stream of their own that is never in the picture.
/// 32 bytes.
struct PilotPixel {
  Rgb mean;
  Rgb m2;          ///< sum of squared deviations from the mean (Welford)
  float rays = 0;  ///< mean for one sample
  std::uint32_t count = 0;
};

/// Mean samples of the film's pixels at both ends of an epoch; to is 0: none.
struct PlanSpan {
  int from = 0;
  int to = 0;
  friend constexpr bool operator==(const PlanSpan&, const PlanSpan&) = default;
};

/// Samples that each half of one pixel has at both ends of the span. 8 bytes.
struct PixelPlan {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
};

/// Samples that a half has when the film has `samples` on average, span.from <= samples <= span.to.
/// Whole steps, of which both ends are multiples, straight between the ends; where pixels step
/// differs from neighbour to neighbour (additive recurrence of Roberts' R2 sequence), so that the
/// mean stays close to `samples`. x, y: pixel of the full film.
struct PlanPosition {
  PlanSpan span;
  int step = 1;  ///< samples that a half gets at once
  int x = 0;
  int y = 0;
};
constexpr std::uint32_t planned_count(const PixelPlan& plan, const PlanPosition& at,
                                      int samples) noexcept {
  const auto step = static_cast<std::uint64_t>(at.step);
  const std::uint64_t units = (plan.to - plan.from) / step;
  const auto done = static_cast<std::uint64_t>(samples - at.span.from);
  const auto length = static_cast<std::uint64_t>(at.span.to - at.span.from);
  // 2^16 / g and 2^16 / g^2, g being the plastic number.
  const std::uint64_t phase =
      (static_cast<std::uint64_t>(at.x) * 49471U + static_cast<std::uint64_t>(at.y) * 37345U) &
      0xFFFFU;
  return plan.from + static_cast<std::uint32_t>(
                         step * (((units * done << 16U) + phase * length) / (length << 16U)));
}

/// Samples that half A (0) or B (1) of a pixel has without a plan: sample s belongs to replicate s
/// % replicates.
constexpr int uniform_count(int samples, int replicates, int half) noexcept {
  const int rest = samples % replicates;
  return samples / replicates * (replicates / 2) + (rest + 1 - half) / 2;
}

/// The index of sample k of a half: the inverse of uniform_count().
constexpr int sample_of_half(std::uint32_t k, int replicates, int half) noexcept {
  const auto per = static_cast<std::uint32_t>(replicates) / 2;
  return static_cast<int>(k / per) * replicates + 2 * static_cast<int>(k % per) + half;
}

}  // namespace core
