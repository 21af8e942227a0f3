/// feature_pass: what the surfaces of a picture are like, for denoisers.
///
/// Camera paths of a stream of its own, of which nothing is in any half: given the features, halves
/// stay independent. A path follows smooth mirrors and glass to the first rough surface.
#pragma once

#include <optional>
#include <stop_token>

#include "core/denoise/denoiser.h"
#include "core/render/view.h"

namespace core {

/// Camera paths of a pixel.
inline constexpr int kFeatureSamples = 16;

/// Of the view's crop; the same bits for any number of threads. Empty: stop was requested. Errors:
/// those of its camera.
Result<std::optional<FeaturePicture>> feature_pass(const View& view, const ParallelFor& parallel,
                                                   const std::stop_token& stop = {});

}  // namespace core
