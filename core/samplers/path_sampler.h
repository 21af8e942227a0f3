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
///
/// Sources: Burley, Practical Hash-based Owen Scrambling, JCGT 2020; the hash is Laine and Karras'
/// with Vegdahl's constants; direction numbers of Joe and Kuo, 2008.
#pragma once

#include <cstdint>

#include "core/math/intrinsics.h"
#include "core/math/vec.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/hash.h"
#include "core/samplers/primary_numbers.h"
#include "core/settings/settings.h"

namespace core {

struct alignas(16) FourWords {
  std::uint32_t x, y, z, w;
};

/// The first four dimensions of the Sobol sequence, tabulated per byte of the index with bits
/// reversed on both sides: reversed(sobol(index)) = xor over bytes b of entry[b][byte b of
/// reversed(index)].
struct SobolTables {
  FourWords entry[4][256];
};
extern const SobolTables kSobolTables;

constexpr std::uint32_t reverse_bits(std::uint32_t x) noexcept {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
  x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
  return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}

/// Applies a nested uniform (Owen) scramble to a bit-reversed value; the result is reversed too.
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) noexcept {
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return x;
}

/// Computes to_unit_float(reverse_bits(scramble_reversed(value, seed))) in four lanes.
inline Vec4 scrambled_4d(__m128i reversed, FourWords seeds) noexcept {
  const auto splat = [](std::uint32_t v) { return _mm_set1_epi32(static_cast<int>(v)); };
  const __m128i seed = _mm_set_epi32(static_cast<int>(seeds.w), static_cast<int>(seeds.z),
                                     static_cast<int>(seeds.y), static_cast<int>(seeds.x));
  __m128i x = reversed;
  x = _mm_xor_si128(x, _mm_mullo_epi32(x, splat(0x3d20adeaU)));
  x = _mm_add_epi32(x, seed);
  x = _mm_mullo_epi32(x, _mm_or_si128(_mm_srli_epi32(seed, 16), splat(1)));
  x = _mm_xor_si128(x, _mm_mullo_epi32(x, splat(0x05526c56U)));
  x = _mm_xor_si128(x, _mm_mullo_epi32(x, splat(0x53a22864U)));
  // Reverses bits: bytes by a shuffle, then each byte by its two nibbles.
  x = _mm_shuffle_epi8(x, _mm_set_epi8(12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3));
  const __m128i nibble = _mm_set1_epi8(15);
  const __m128i table = _mm_set_epi8(15, 7, 11, 3, 13, 5, 9, 1, 14, 6, 10, 2, 12, 4, 8, 0);
  const __m128i low = _mm_shuffle_epi8(table, _mm_and_si128(x, nibble));
  const __m128i high = _mm_shuffle_epi8(table, _mm_and_si128(_mm_srli_epi32(x, 4), nibble));
  x = _mm_or_si128(_mm_slli_epi32(low, 4), high);
  const __m128 unit = _mm_mul_ps(_mm_cvtepi32_ps(_mm_srli_epi32(x, 8)), _mm_set1_ps(0x1p-24F));
  alignas(16) float out[4];
  _mm_store_ps(out, unit);
  return {out[0], out[1], out[2], out[3]};
}

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
    const std::uint64_t h2 = mix_bits(h + 0x632be59bd9b4e019ULL);
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
    return to_unit_float(
        static_cast<std::uint32_t>(hash_combine(base_ ^ (std::uint64_t{index_} << 1), key) >> 32));
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
    return {to_unit_float(static_cast<std::uint32_t>(h)),
            to_unit_float(static_cast<std::uint32_t>(h >> 32)),
            to_unit_float(static_cast<std::uint32_t>(h2)),
            to_unit_float(static_cast<std::uint32_t>(h2 >> 32))};
  }

  /// Dimensions of a Sobol sequence as the numbers of a group.
  static Vec4 arranged(Vec4 u, int group) noexcept {
    return is_of_bsdf(group) ? Vec4{u.z, u.x, u.y, u.w} : u;
  }

  /// Point `index` of the scrambled 4-D sequence that (h, h2) name. Public for tests and the
  /// laboratory.
  static Vec4 sobol_4d(std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept {
    // Owen scrambling of the index keeps every block [m 2^k, (m + 1) 2^k) together, so each prefix
    // of 2^k points remains a net.
    const std::uint32_t shuffled =
        scramble_reversed(reverse_bits(index), static_cast<std::uint32_t>(h));
    const auto entry = [shuffled](int byte) {
      const auto at = (shuffled >> (8 * byte)) & 255U;
      return _mm_load_si128(reinterpret_cast<const __m128i*>(&kSobolTables.entry[byte][at]));
    };
    const __m128i point =
        _mm_xor_si128(_mm_xor_si128(entry(0), entry(1)), _mm_xor_si128(entry(2), entry(3)));
    // Derives four 32-bit seeds from 128 bits of hash; the first is reused with another multiplier.
    const auto seed0 = static_cast<std::uint32_t>((h * 0xd1342543de82ef95ULL) >> 32);
    return scrambled_4d(point,
                        {seed0, static_cast<std::uint32_t>(h >> 32), static_cast<std::uint32_t>(h2),
                         static_cast<std::uint32_t>(h2 >> 32)});
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
