/// Randomised sets of 4-D points with random access: the samplers whose sets have no useful
/// prefixes.
///
/// index: of the point, less than the size of the set. (h, h2): 128 random bits that select the
/// set; sets with different bits are independent. The points of a set are in random order, so each
/// point alone is uniform over the unit cube and any part of a set gives an unbiased mean.
#pragma once

#include <cstdint>

#include "core/math/vec.h"
#include "core/samplers/hash.h"
#include "core/samplers/permutation.h"

namespace core {

/// Selects the dimensions of a group that are stratified as a plane.
enum class Pairing {
  kXyZw,  ///< camera: film and lens
  kYz,    ///< bounce: y and z; x and w separately
};

struct Jitter {
  std::uint32_t x, y, z, w;
};
constexpr Jitter jitter_of(std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept {
  const std::uint64_t a = mix_bits(h + 0xd1342543de82ef95ULL * (std::uint64_t{index} + 1));
  const std::uint64_t b = mix_bits(a ^ h2);
  return {low_word(a), high_word(a), low_word(b), high_word(b)};
}

/// Returns a jittered point: one per cell of side x side for every pair of dimensions, one per
/// interval of side^2 for single dimensions; pairs are combined at random. Size side^2. Variance of
/// a smooth function of a pair: O(n^-2).
inline Vec4 stratified_4d(std::uint32_t index, std::uint32_t side, Pairing pairing, std::uint64_t h,
                          std::uint64_t h2) noexcept {
  const std::uint32_t n = side * side;
  const Jitter j = jitter_of(index, h, h2);
  if (pairing == Pairing::kXyZw) {
    const std::uint32_t a = permuted(index, n, h);
    const std::uint32_t b = permuted(index, n, h2);
    return {in_stratum(a % side, side, j.x), in_stratum(a / side, side, j.y),
            in_stratum(b % side, side, j.z), in_stratum(b / side, side, j.w)};
  }
  const std::uint32_t a = permuted(index, n, h);
  return {in_stratum(permuted(index, n, h2), n, j.x), in_stratum(a % side, side, j.y),
          in_stratum(a / side, side, j.z), in_stratum(permuted(index, n, h ^ (h2 << 1)), n, j.w)};
}

/// Returns a point of a Latin hypercube of any size: each dimension has one point in each of `size`
/// intervals, in independent random order. Error of a sum of functions of one dimension each:
/// O(n^-3/2). Source: McKay, Beckman and Conover 1979.
inline Vec4 latin_hypercube_4d(std::uint32_t index, std::uint32_t size, std::uint64_t h,
                               std::uint64_t h2) noexcept {
  const Jitter j = jitter_of(index, h, h2);
  return {in_stratum(permuted(index, size, h), size, j.x),
          in_stratum(permuted(index, size, h2), size, j.y),
          in_stratum(permuted(index, size, h ^ (h2 << 1)), size, j.z),
          in_stratum(permuted(index, size, h2 ^ (h << 1)), size, j.w)};
}

/// Returns a point of an orthogonal array of strength 2 with Latin sub-strata (a U design): every
/// pair of dimensions has one point in each of p x p cells, every dimension has one in each of p^2
/// intervals. Pre: p prime, at least 3. Size p^2. Sources: Bose's construction over the integers
/// modulo p; Owen 1992; Tang 1993.
inline Vec4 orthogonal_array_4d(std::uint32_t index, std::uint32_t p, std::uint64_t h,
                                std::uint64_t h2) noexcept {
  const Jitter j = jitter_of(index, h, h2);
  const std::uint32_t row = permuted(index, p * p, h);
  const std::uint32_t a = row / p;
  const std::uint32_t b = row % p;
  // `other` takes a different value for each of the p points of a level.
  const auto coordinate = [p](std::uint32_t level, std::uint32_t other, std::uint64_t key,
                              std::uint32_t bits) {
    const std::uint32_t cell = permuted_prime(level, p, key);
    const std::uint32_t part = permuted_prime(other, p, hash_combine(key, level));
    return in_stratum(cell * p + part, p * p, bits);
  };
  return {coordinate(a, b, hash_combine(h2, 0), j.x), coordinate(b, a, hash_combine(h2, 1), j.y),
          coordinate((a + b) % p, b, hash_combine(h2, 2), j.z),
          coordinate((a + 2 * b) % p, b, hash_combine(h2, 3), j.w)};
}

}  // namespace core
