/// Adaptive sampling: distributes the samples of the next epoch.
///
/// The need of a pixel is the variance of one sample divided by its cost and by the signal around
/// the pixel, pooled over a window so that it rests on some hundred samples; then the maximum over
/// neighbours within `dilation` is taken. Counts are proportional to the square root of the need,
/// which minimises the sum of variance / n for a given sum of cost * n. A tenth is spread evenly,
/// because few samples may have missed something.
///
/// Only the pilot stream determines the plan, so it is independent of the samples of the image, and
/// every epoch may choose anew.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/film/film.h"
#include "core/settings/settings.h"

namespace core {

/// Returns the plans of all tiles for the epoch from `from` to epoch_end(from). Pre: every tile has
/// `from` samples and pilot_samples_at(from) pilot samples.
std::vector<std::vector<PixelPlan>> make_plans(const Film& film, const RenderSettings& settings,
                                               int from);

/// Peak memory of make_plans() per pixel of the crop, besides the plans, reached while it computes
/// the needs: mean, variance and cost of a sample; sums of three tables; the need itself. Later it
/// holds less: a need, a count, a weight, a mark, the final count and the plan.
inline constexpr std::size_t kPlanWorkBytes =
    2 * sizeof(Rgb) + sizeof(float) + 3 * sizeof(double) + sizeof(float);
static_assert(kPlanWorkBytes >= sizeof(float) + 2 * sizeof(std::uint32_t) + sizeof(double) +
                                    sizeof(char) + sizeof(PixelPlan));

/// The part of make_plans() after the needs are known; public for tests.
struct Budget {
  std::vector<float> need;         ///< [pixel]; >= 0
  std::vector<std::uint32_t> has;  ///< [pixel]; minimum count
  double mean = 0;                 ///< mean of the counts to assign
  std::uint32_t step = 1;          ///< counts are `has` plus multiples of this
};
/// Returns counts proportional to 0.1 mean(need) + 0.9 need, at least `has` and at most about 16
/// times the mean, whose mean equals the requested one to within step / pixels. All counts are
/// equal if every need is 0.
std::vector<std::uint32_t> distribute(const Budget& budget);

}  // namespace core
