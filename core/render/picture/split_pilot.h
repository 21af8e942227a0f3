/// Measures with a pilot, before rendering, how many continuations of a path are worthwhile and
/// whether light samples should choose their own distances in media.
///
/// At each of some pixels the pilot traces four paths: two camera rays with two continuations each,
/// using a separate random stream. They do not contribute to the image, so the count is independent
/// of the samples that it weights, and the image stays unbiased. Costs are counted in rays, so the
/// result is the same on any machine.
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

inline constexpr int kMeasuredSplitMax = 8;
inline constexpr int kSplitPixels = 1024;

struct SplitCosts {
  double prefix_variance = 0;  ///< Var E[Y | X] with camera ray X, continuation Y
  double branch_variance = 0;  ///< E Var[Y | X]
  double prefix_rays = 0;
  double branch_rays = 0;
  std::vector<double> means = {};  ///< luminance by pixel
};

/// Returns the count in [1, kMeasuredSplitMax] that minimises variance times cost, (prefix_variance
/// + branch_variance / n) (prefix_rays + n branch_rays); 1 if there are no rays behind the first
/// surface. Source: Veach 1997, 10.4; the real-valued optimum is sqrt(branch_variance prefix_rays /
/// (prefix_variance branch_rays)).
int best_split_count(const SplitCosts& costs);

/// Measures the costs. plain: an integrator without splitting. The pixels are spread evenly over
/// the full film whatever the crop, so that parts agree with the whole. Empty if stop was requested
/// before the last pixel. means: those that the variances are relative to; empty: its own.
std::optional<SplitCosts> measure_split(const Camera& camera, const Integrator& plain,
                                        const RenderSettings& settings, int pixels = kSplitPixels,
                                        const std::stop_token& stop = {},
                                        std::span<const double> means = {});

/// Returns the best count for the film's sampler, with continuations costing at most as much as the
/// path that leads to them, because it is not known in advance how much variance well-distributed
/// points leave. A power of two, as the sets of sobol are. Empty as above.
std::optional<int> measured_split_count(const Camera& camera, const Integrator& plain,
                                        const RenderSettings& settings,
                                        const std::stop_token& stop = {});

/// Returns whether variance times rays is smaller if the light samples of `path` also choose
/// distances in media. This holds for a small light in thin fog; not in dense fog, or if most of
/// the light is on surfaces. Both variances are relative to the light that the former finds: what
/// finds light once in thousands of samples would set its own scale. Empty as above.
std::optional<bool> pays_to_aim(const IntegratorInput& input, const std::stop_token& stop = {});

}  // namespace core
