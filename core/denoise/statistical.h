/// The denoiser that is always available: a joint filter without learnt weights.
///
/// A pixel is replaced by the mean of the nearby pixels that appear to have the same expected
/// value: the differences between the patches around both are no larger than the noise of this half
/// explains (Welch's test), and their surfaces agree. If features are given, light is divided by
/// the colour of the surfaces, filtered, and multiplied by it again. The result is the same, bit
/// for bit, for any number of threads. Sources: Buades 2005 (patches); Rousselle 2012 (differences
/// over their variance); Sakai 2024 (membership by Welch's test).
#pragma once

#include "core/denoise/denoiser.h"

namespace core {

class StatisticalDenoiser final : public Denoiser {
 public:
  Result<FilteredHalves> denoise(std::span<const HalfPicture> halves,
                                 const FeaturePicture* features,
                                 const ParallelFor& parallel) const override;
};

}  // namespace core
