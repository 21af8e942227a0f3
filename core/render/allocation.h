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

#include <span>
#include <vector>

#include "core/film/film.h"
#include "core/settings/settings.h"

namespace core {

/// The plans of all tiles for the epoch that begins at `from` and ends at epoch_end(from). Pre:
/// every tile has `from` samples, and pilot_samples_at(from) of the pilot.
std::vector<std::vector<PixelPlan>> make_plans(const Film& film, const RenderSettings& settings,
                                               int from);

/// What make_plans() does with needs that are known; public for tests.
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
