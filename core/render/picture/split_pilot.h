/// Measures with a pilot, before rendering, what camera rays and the continuations of a path
/// contribute to variance and cost, and whether light samples should choose their own distances in
/// media.
///
/// At each of some pixels the pilot traces four paths: two camera rays with two continuations each,
/// using a separate random stream. They do not contribute to the image, so their decision is
/// independent of the samples that it weights, and the image stays unbiased. Costs are counted in
/// rays, so the result is the same on any machine.
#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "core/camera/camera.h"
#include "core/film/filter.h"
#include "core/integrators/integrator.h"
#include "core/settings/settings.h"

namespace core {

inline constexpr int kMeasuredSplitMost = 8;
/// A job of a fixed number of samples takes at most that many times as long as without splitting: 2
/// would leave a bottle under a map at 2 continuations, where 4 are 1.2 to 1.5 times as efficient.
inline constexpr double kSplitCostMost = 3;
inline constexpr int kSplitPixels = 1024;

struct SplitCosts {
  double prefix_variance = 0;  ///< Var E[Y | X] with camera ray X, continuation Y
  double branch_variance = 0;  ///< E Var[Y | X]
  double prefix_rays = 0;
  double branch_rays = 0;
  std::vector<double> means = {};  ///< luminance by pixel
};

/// Returns the count of 1, 2, 4 and 8, as the sets of sobol have them, with the least variance
/// times cost, (prefix_variance + branch_variance / n) (prefix_rays + n branch_rays); 1 if there
/// are no rays behind the first surface. Counts of more than kSplitCostMost times the cost are left
/// out. Source: Veach 1997, 10.4.
int best_split_count(const SplitCosts& costs);

/// Measures the costs. plain: an integrator without splitting. The pixels are spread evenly over
/// the full film whatever the crop, so that parts agree with the whole. Empty if stop was requested
/// before the last pixel. means: those that the variances are relative to; empty: its own.
std::optional<SplitCosts> measure_split(const Camera& camera, const Integrator& plain,
                                        const RenderSettings& settings, int pixels = kSplitPixels,
                                        const std::stop_token& stop = {},
                                        std::span<const double> means = {});

/// Returns whether variance times rays is smaller if the light samples of `path` also choose
/// distances in media. This holds for a small light in thin fog; not in dense fog, or if most of
/// the light is on surfaces. Both variances are relative to the light that the former finds: what
/// finds light once in thousands of samples would set its own scale. Empty as above.
std::optional<bool> pays_to_aim(const IntegratorInput& input, const std::stop_token& stop = {});

}  // namespace core
