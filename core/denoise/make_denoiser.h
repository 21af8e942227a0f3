/// Denoises by the denoiser that a job asks for.
#pragma once

#include "core/denoise/denoised_picture.h"
#include "core/denoise/denoiser_type.h"

namespace core {

/// type: not kNone. kAuto takes oidn where its library is, and statistical where that fails.
/// Errors: kUnavailable.
Result<MadeDenoised> denoise_with(DenoiserType type, const FilmSnapshot& film,
                                  const FeaturePicture* features, const ParallelFor& parallel);

}  // namespace core
