/// Where the samples of the next epoch go.
///
/// Needs: the variance of one sample over its cost and over the signal around the pixel, pooled
/// over a window that makes it a matter of some hundred samples; the neediest neighbour within
/// `dilation` counts. Counts are proportional to the square root of that (the sum of variance / n
/// at a given sum of cost * n is least there), but a tenth is spread evenly, because few samples
/// may have missed something.
///
/// The pilot stream alone decides, so the picture's samples know nothing of it and every epoch may
/// decide anew.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/film/film.h"
#include "core/settings/settings.h"

namespace core {

/// The plans of all tiles for the epoch that begins at `from` and ends at epoch_end(from). Pre:
/// every tile has `from` samples, and pilot_samples_at(from) of the pilot.
std::vector<std::vector<PixelPlan>> make_plans(const Film& film, const RenderSettings& settings,
                                               int from);

/// The most that make_plans() has at a time beside the plans, for each pixel of the crop: while the
/// needs are computed. Mean, variance and cost of a sample; sums of three tables; the need itself.
/// Later it has less: a need, a count, a weight, a mark, the count at the end, and the plan.
inline constexpr std::size_t kPlanWorkBytes =
    2 * sizeof(Rgb) + sizeof(float) + 3 * sizeof(double) + sizeof(float);
static_assert(kPlanWorkBytes >= sizeof(float) + 2 * sizeof(std::uint32_t) + sizeof(double) +
                                    sizeof(char) + sizeof(PixelPlan));

/// The part of make_plans() after the needs are known; public for tests.
struct Budget {
  std::vector<float> need;         ///< [pixel]; >= 0
  std::vector<std::uint32_t> has;  ///< [pixel]; least that may be given
  double mean = 0;                 ///< of the counts to give
  std::uint32_t step = 1;          ///< counts are has plus multiples of this
};
/// Counts in proportion to 0.1 mean(need) + 0.9 need, none less than `has`, none above 16 means or
/// so, with the asked mean to within step / pixels. Equal for all when nothing is needed anywhere.
std::vector<std::uint32_t> distribute(const Budget& budget);

}  // namespace core
