// Samplers other than independent and sobol: out of line, to keep the loops of those small.
#include "core/samplers/path_sampler.h"

#include "core/samplers/dimensions.h"
#include "core/samplers/halton.h"
#include "core/samplers/point_sets.h"
#include "core/samplers/zsobol.h"
#include "core/settings/sample_sets.h"

namespace core {
namespace {

constexpr std::uint64_t key_of(std::uint32_t x, std::uint32_t y) {
  return (static_cast<std::uint64_t>(y) << 32) | x;
}

/// Across a pixel, a lens or an emitter radiance is mostly monotonic: a point and its mirror image
/// have opposite errors. Directions after the first surface have no such order.
constexpr bool is_mirrored(int group) {
  return group == kCameraGroup || (group - 1) % static_cast<int>(BounceGroup::kCount) ==
                                      static_cast<int>(BounceGroup::kLight);
}

}  // namespace

void PathSampler::start_other(std::uint32_t x, std::uint32_t y, std::uint32_t sample) noexcept {
  const std::uint32_t replicate = first_replicate_ + sample % replicates_;
  const std::uint32_t index = sample / replicates_;
  const auto size = static_cast<std::uint32_t>(samples_in_set(type_));
  if (type_ == SamplerType::kHalton) {
    index_ = index;
    base_ = hash_combine(hash_combine(seed_, key_of(x, y)), replicate);
    return;
  }
  const std::uint32_t set = index / size;
  index_ = index % size;
  if (type_ == SamplerType::kZsobol) {
    index_ += zcurve_index(x, y) * size;
    x >>= kZcurveLevels;
    y >>= kZcurveLevels;
  }
  base_ = hash_combine(hash_combine(hash_combine(seed_, key_of(x, y)), replicate), set);
}

Vec4 PathSampler::other_4d(int group) const noexcept {
  const std::uint64_t h = hash_combine(base_, static_cast<std::uint64_t>(group));
  if (chain_ != nullptr) {
    return chain_->at(h);
  }
  const std::uint64_t h2 = second_hash(h);
  switch (type_) {
    case SamplerType::kAntithetic: {
      if (index_ == 0) {
        return independent_4d(h, h2);
      }
      return is_mirrored(group) ? independent_4d(~h, ~h2)
                                : independent_4d(mix_bits(h ^ 0x8ebc6af09c88c6e3ULL),
                                                 mix_bits(h2 ^ 0x589965cc75374cc3ULL));
    }
    case SamplerType::kStratified:
      return stratified_4d(index_, kStratifiedSide,
                           group == kCameraGroup ? Pairing::kXyZw : Pairing::kYz, h, h2);
    case SamplerType::kLatinHypercube:
      return latin_hypercube_4d(index_, kLatinSize, h, h2);
    case SamplerType::kOrthogonalArray:
      return orthogonal_array_4d(index_, kArrayPrime, h, h2);
    case SamplerType::kHalton:
      return halton_4d(group, index_, h, h2);
    case SamplerType::kZsobol:
      return arranged(sobol_4d(shuffled_zcurve(index_ / kBlueNoiseSize, h2) * kBlueNoiseSize +
                                   index_ % kBlueNoiseSize,
                               h, h2),
                      group);
    case SamplerType::kIndependent:
    case SamplerType::kSobol:
      break;
  }
  return independent_4d(h, h2);
}

}  // namespace core
