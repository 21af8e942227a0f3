/// Sizes of sample sets, which determine each sampler's counts, and of sets of paths.
#pragma once

#include <cstdint>

#include "core/settings/settings.h"

namespace core {

inline constexpr std::uint32_t kStratifiedSide = 4;  ///< cells of a pair: 4 x 4
inline constexpr std::uint32_t kLatinSize = 16;      ///< intervals of a dimension
inline constexpr std::uint32_t kArrayPrime = 5;      ///< levels of a dimension; 5^2 points
inline constexpr std::uint32_t kBlueNoiseSize = 8;   ///< points of a pixel; a power of two
/// Maximum number of paths that share light samples with `restir`.
inline constexpr int kSharedPathsMost = 64;

/// Returns the samples of one set in one replicate. Further samples belong to further, independent
/// sets; the size is fixed so that a longer job begins with the samples of a shorter one. An image
/// is complete after a multiple of this times the number of replicates. 1: any count is complete
/// (independent), or any prefix (sobol, halton).
constexpr int samples_in_set(SamplerType type) noexcept {
  switch (type) {
    case SamplerType::kAntithetic:
      return 2;
    case SamplerType::kStratified:
      return static_cast<int>(kStratifiedSide * kStratifiedSide);
    case SamplerType::kLatinHypercube:
      return static_cast<int>(kLatinSize);
    case SamplerType::kOrthogonalArray:
      return static_cast<int>(kArrayPrime * kArrayPrime);
    case SamplerType::kZsobol:
      return static_cast<int>(kBlueNoiseSize);
    case SamplerType::kIndependent:
    case SamplerType::kHalton:
    case SamplerType::kSobol:
      break;
  }
  return 1;
}

/// Returns the samples per pixel of one complete set in every replicate, for samplers whose sets
/// have no useful prefixes; 1 for the others.
int sample_unit(SamplerType sampler, int replicates);

/// Rounds a sample count up to what the sampler supports. sobol, halton: even counts, except 1.
/// Samplers without prefixes: multiples of sample_unit().
int rounded_samples(SamplerType sampler, int replicates, int samples_per_pixel);

/// Returns the samples per pixel, summed over replicates, that share light samples across passes
/// and are rendered together; 1 if none do.
int shared_window(const RenderSettings& settings);
/// As above, also counting windows: a unit consists of complete sets and complete windows.
int sample_unit(const RenderSettings& settings);
int rounded_samples(const RenderSettings& settings, int samples_per_pixel);

}  // namespace core
