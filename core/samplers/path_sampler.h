/// PathSampler: the random numbers of one camera path, by named dimension.
///
/// A number is a pure function of (seed, pixel, sample, dimension). Sample s belongs to replicate
/// first + s % R and is point s / R of that replicate's randomisation, which is independent of all
/// others.
///
/// independent       uniform numbers.
/// antithetic        pairs: the second takes 1 - u for film, lens and lights, fresh numbers for the
/// rest. stratified, latin-hypercube, orthogonal-array    independent sets of samples_in_set()
/// points, one after
///                   another, in each group of four dimensions by itself
///                   (core/samplers/point_sets.h).
/// halton            one sequence over all dimensions (core/samplers/halton.h).
/// sobol             groups of four dimensions are one Owen-scrambled 4-D Sobol sequence, groups
/// are decorrelated by
///                   shuffling the index. The first two dimensions, whose prefixes of 2^m points
///                   have one in each of 2^m rectangles, are y and z in the groups "bsdf",
///                   and x and y in all others.
/// zsobol            sets of kBlueNoiseSize points of such a sequence, which the pixels of a tile
/// share
///                   (core/samplers/zsobol.h); sets and tiles are independent, pixels of a tile are
///                   not.
#pragma once

#include <cstdint>

#include "core/math/vec.h"
#include "core/samplers/hash.h"
#include "core/samplers/primary_numbers.h"
#include "core/samplers/sobol.h"
#include "core/settings/settings.h"

namespace core {

class PathSampler {
 public:
  /// Takes `replicates` replicates in turn, starting at index first_replicate.
  PathSampler(SamplerType type, int replicates, std::uint64_t seed,
              int first_replicate = 0) noexcept
      : type_(type),
        replicates_(static_cast<std::uint32_t>(replicates)),
        first_replicate_(static_cast<std::uint32_t>(first_replicate)),
        seed_(mix_bits(seed)) {}

  /// Draws the numbers of a Markov chain, which must outlive it. stream: selects their use. Must
  /// not be started.
  PathSampler(PrimaryNumbers& chain, std::uint64_t stream) noexcept
      : type_(SamplerType::kZsobol),  // any type not drawn inline
        replicates_(1),
        first_replicate_(0),
        seed_(0),
        base_(mix_bits(stream)),
        chain_(&chain) {}

  /// x, y: pixel of the full film. sample >= 0.
  void start(int x, int y, int sample) noexcept {
    const auto pixel = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32) |
                       static_cast<std::uint32_t>(x);
    const auto s = static_cast<std::uint32_t>(sample);
    const std::uint32_t replicate = first_replicate_ + s % replicates_;
    replicate_ = replicate;
    if (type_ == SamplerType::kSobol) [[likely]] {
      index_ = s / replicates_;
      base_ = hash_combine(hash_combine(seed_, pixel), replicate);
    } else if (type_ == SamplerType::kIndependent) {
      const std::uint32_t in_pair = 2 * (s / replicates_) + (replicate & 1U);
      base_ =
          hash_combine(hash_combine(seed_, pixel), (std::uint64_t{replicate >> 1} << 32) | in_pair);
    } else {
      start_other(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), s);
    }
  }

  /// Returns four numbers in [0,1).
  Vec4 get_4d(int group) const noexcept {
    const std::uint64_t h = hash_combine(base_, static_cast<std::uint64_t>(group));
    const std::uint64_t h2 = second_hash(h);
    if (type_ == SamplerType::kSobol) [[likely]] {
      return arranged(sobol_4d(index_, h, h2), group);
    }
    return type_ == SamplerType::kIndependent ? independent_4d(h, h2) : other_4d(group);
  }

  /// Returns a number for decisions whose count is not known in advance (holes along a ray),
  /// independent of the named dimensions.
  float extra_1d(int bounce, std::uint32_t index) const noexcept {
    const auto key =
        (std::uint64_t{0xa1b2} << 48) | (static_cast<std::uint64_t>(bounce) << 32) | index;
    if (chain_ != nullptr) [[unlikely]] {
      return chain_->at(hash_combine(base_, key)).x;
    }
    return to_unit_float(high_word(hash_combine(base_ ^ (std::uint64_t{index_} << 1), key)));
  }

  /// Returns the sampler of continuation k of `count` of this path. With sobol and halton the
  /// continuations of all samples together again form point sets, `count` times as large; with
  /// other types continuation k of all samples is a set of its own.
  PathSampler branch(int k, int count) const noexcept {
    PathSampler out = *this;
    const auto n = static_cast<std::uint32_t>(count);
    out.base_ = hash_combine(base_, branch_key(n));
    if (type_ == SamplerType::kSobol || type_ == SamplerType::kHalton) {
      out.index_ = index_ * n + static_cast<std::uint32_t>(k);
    } else {
      out.base_ = hash_combine(out.base_, static_cast<std::uint64_t>(k));
    }
    return out;
  }

  static constexpr std::uint64_t branch_key(std::uint32_t count) noexcept {
    return (std::uint64_t{0xb4a2} << 32) | count;
  }

  /// Returns the replicate, within the seed, of the current sample.
  int replicate() const noexcept { return static_cast<int>(replicate_); }
  /// Inputs of sobol numbers, for drawing them for many paths at once.
  SamplerType type() const noexcept { return type_; }
  std::uint64_t base() const noexcept { return base_; }
  std::uint32_t index() const noexcept { return index_; }

  static Vec4 independent_4d(std::uint64_t h, std::uint64_t h2) noexcept {
    return {to_unit_float(low_word(h)), to_unit_float(high_word(h)), to_unit_float(low_word(h2)),
            to_unit_float(high_word(h2))};
  }

 private:
  [[gnu::noinline]] void start_other(std::uint32_t x, std::uint32_t y,
                                     std::uint32_t sample) noexcept;
  [[gnu::noinline]] Vec4 other_4d(int group) const noexcept;

  SamplerType type_;
  std::uint32_t replicates_;
  std::uint32_t first_replicate_;
  std::uint64_t seed_;
  std::uint64_t base_ = 0;   ///< selects the sample's point set
  std::uint32_t index_ = 0;  ///< of the point in its set (below samples_in_set() if that is above
                             ///< 1); zsobol: along the curve
  std::uint32_t replicate_ = 0;
  PrimaryNumbers* chain_ = nullptr;  ///< null: numbers come from a point set
};

}  // namespace core
