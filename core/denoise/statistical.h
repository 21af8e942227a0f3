/// The denoiser that is always there: a joint filter without anything learnt.
///
/// A pixel is replaced by the mean of the pixels around it that have the same expected value as far
/// as can be estimated: around both, differences are no larger than the noise of this half explains
/// (Welch's test over a patch of both), and their surfaces agree. Where features are given, light
/// is filtered without the colour of the surfaces, which is multiplied back afterwards. The same
/// bits for any number of threads.
/// Sources: Buades 2005 (patches); Rousselle 2012 (differences over their variance); Sakai 2024
/// (membership by Welch's test).
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
