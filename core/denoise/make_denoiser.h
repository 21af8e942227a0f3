/// Denoises with the denoiser that a job requests.
#pragma once

#include "core/denoise/denoised_picture.h"
#include "core/denoise/denoiser_type.h"

namespace core {

/// type: not kNone. kAuto uses oidn if its library is installed, and statistical if oidn fails.
/// Errors: kUnavailable.
Result<MadeDenoised> denoise_with(DenoiserType type, const FilmSnapshot& film,
                                  const FeaturePicture* features, const ParallelFor& parallel);
/// The same for clean_film().
Result<CleanFilm> clean_with(DenoiserType type, const FilmSnapshot& film,
                             const FeaturePicture* features, const ParallelFor& parallel);

}  // namespace core
