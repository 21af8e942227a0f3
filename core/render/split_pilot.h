/// How many continuations of a path pay, and whether light samples of their own distances in media
/// do: measured by a pilot before the picture begins.
///
/// The pilot takes four paths through each of some pixels, two camera rays with two continuations
/// each, with random numbers of a stream of its own. Nothing of it goes into the picture, so the
/// count does not depend on the samples that it weighs and the picture stays unbiased; costs are
/// counted in rays, so the count is the same wherever and whenever the job runs.
#pragma once

#include "core/camera/camera.h"
#include "core/film/filter.h"
#include "core/integrators/integrator.h"
#include "core/settings/settings.h"

namespace core {

inline constexpr int kMeasuredSplitMax = 8;

struct SplitCosts {
  double way_variance = 0;  ///< of a pixel's path, Var E[Y | X]: camera ray X, all that follows Y
  double branch_variance = 0;  ///< E Var[Y | X]
  double way_rays = 0;
  double branch_rays = 0;
};

/// The count in [1, kMeasuredSplitMax] for which (way_variance + branch_variance / n) (way_rays + n
/// branch_rays), variance times cost, is least. Without rays behind the first surface: 1. Source:
/// Veach 1997, 10.4; the real optimum is sqrt(branch_variance way_rays / (way_variance
/// branch_rays)).
int best_split_count(const SplitCosts& costs);

/// plain: does not split. pixels: even over the whole film, whatever the crop, so that parts agree
/// with the whole.
SplitCosts measure_split(const Camera& camera, const Integrator& plain,
                         const RenderSettings& settings, int pixels = 1024);

/// The best count for the film's sampler, but no more continuations than cost what leads to them:
/// what well-spread points leave of the rest is not known beforehand. A power of two, as sobol's
/// sets are.
int measured_split_count(const Camera& camera, const Integrator& plain,
                         const RenderSettings& settings);

/// Is variance times rays less if light samples of `path` choose distances in media too? Where a
/// small light shines into thin fog it is; in the dense, or where most of the light is on surfaces,
/// it is not.
bool pays_to_aim(const IntegratorInput& input);

}  // namespace core
