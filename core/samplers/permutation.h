/// Permutations and strata with random access to single elements, without tables.
#pragma once

#include <bit>
#include <cstdint>

#include "core/samplers/hash.h"

namespace core {

/// Maps 32 random bits to [0, count); count > 0.
constexpr std::uint32_t to_range(std::uint32_t bits, std::uint32_t count) noexcept {
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(bits) * count) >> 32);
}

/// Returns the image of `index` under a permutation of [0, count) selected by `key`. Pre: index <
/// count < 2^31.
///
/// Rounds of multiply-add and xor-shift are bijections of the numbers with as many bits as count -
/// 1; values outside the range are permuted again (cycle walking, Black and Rogaway 2002). A random
/// rotation at the end makes every image equally likely for any rounds; pairs of images are equally
/// likely to within a few percent.
constexpr std::uint32_t permuted(std::uint32_t index, std::uint32_t count,
                                 std::uint64_t key) noexcept {
  const std::uint64_t k0 = mix_bits(key + 0x9e3779b97f4a7c15ULL);
  const std::uint64_t k1 = second_hash(k0);
  const int bits = 32 - std::countl_zero(count - 1);
  const std::uint32_t mask = static_cast<std::uint32_t>((std::uint64_t{1} << bits) - 1);
  const int half = (bits + 1) / 2;
  const int one = bits > 2 ? 1 : 31;
  std::uint32_t x = index;
  do {
    for (int round = 0; round < 8; ++round) {
      x = (x * (static_cast<std::uint32_t>(std::rotr(k0, 13 * round)) | 1U) +
           static_cast<std::uint32_t>(std::rotr(k1, 11 * round))) &
          mask;
      x ^= x >> half;
      x ^= round % 2 == 1 ? x >> one : 0;
    }
  } while (x >= count);
  x += to_range(high_word(k0 ^ k1), count);
  return x < count ? x : x - count;
}

/// As permuted(), for a prime count: x -> a x + c with random a != 0 and c. Images of any two
/// elements are uniform, and variances depend on nothing else. bits: 64 random bits. Pre: x < p <
/// 2^15.
constexpr std::uint32_t permuted_prime(std::uint32_t x, std::uint32_t p,
                                       std::uint64_t bits) noexcept {
  return (x * (1 + to_range(low_word(bits), p - 1)) + to_range(high_word(bits), p)) % p;
}

/// Returns a float in stratum `cell` of `count` equal strata of [0,1): floor(result * count) ==
/// cell exactly. The density within the stratum is uniform to count * 2^-24. Pre: cell < count <=
/// 2^20.
constexpr float in_stratum(std::uint32_t cell, std::uint32_t count, std::uint32_t jitter) noexcept {
  const auto edge = [count](std::uint64_t c) {
    return static_cast<std::uint32_t>(((c << 24) + count - 1) / count);
  };
  const std::uint32_t low = edge(cell);
  return static_cast<float>(low + to_range(jitter, edge(std::uint64_t{cell} + 1) - low)) * 0x1p-24F;
}

}  // namespace core
