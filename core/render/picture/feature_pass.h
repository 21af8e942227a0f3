/// feature_pass: renders surface features of an image for denoisers.
///
/// It traces camera paths of a separate stream that contribute to neither half: given the features,
/// the halves stay independent. A path follows smooth mirrors and glass to the first rough surface.
#pragma once

#include <optional>
#include <stop_token>

#include "core/denoise/denoiser.h"
#include "core/render/picture/view.h"

namespace core {

/// Camera paths of a pixel.
inline constexpr int kFeatureSamples = 16;
/// Camera paths of a pixel whose features hardly scatter, and of every pixel for previews: a
/// quarter of the time for twice the standard error.
inline constexpr int kQuickFeatureSamples = 4;

/// Renders the features of the view's crop; same bits for any number of threads. Empty if stop was
/// requested. samples: camera paths of a pixel at most, at least 2. Errors: those of the view's
/// camera.
Result<std::optional<FeaturePicture>> feature_pass(const View& view, const ParallelFor& parallel,
                                                   int samples = kFeatureSamples,
                                                   const std::stop_token& stop = {});

}  // namespace core
