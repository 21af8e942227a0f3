/// Blue-noise ordering of Sobol points among neighbouring pixels.
///
/// The pixels of a tile of 32 x 32 share one Owen-scrambled sequence along a Z curve, and each
/// takes the next kBlueNoiseSize points; at every level of the curve the four quadrants are in
/// random order. Every aligned block of 2^k x 2^k pixels then holds one net, so errors of
/// neighbours are negatively correlated and cancel over blocks. Tiles are independent. Errors
/// within a tile are correlated: variances do not add up over a block. Sources: Ahmed and Wonka,
/// Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering of
/// pixels, 2020; PBR 4th ed. 8.7.
#pragma once

#include <array>
#include <cstdint>

#include "core/samplers/hash.h"
#include "core/samplers/permutation.h"

namespace core {

inline constexpr int kZcurveLevels = 5;  ///< tiles of 32 x 32 pixels

/// Interleaves the lower kZcurveLevels bits of x and y.
constexpr std::uint32_t zcurve_index(std::uint32_t x, std::uint32_t y) noexcept {
  std::uint32_t z = 0;
  for (int bit = 0; bit < kZcurveLevels; ++bit) {
    z |= ((x >> bit) & 1U) << (2 * bit);
    z |= ((y >> bit) & 1U) << (2 * bit + 1);
  }
  return z;
}

/// Returns the 24 permutations of four elements, two bits each.
constexpr std::array<std::uint8_t, 24> orders_of_four() {
  std::array<std::uint8_t, 24> orders{};
  std::size_t n = 0;
  for (unsigned a = 0; a < 4; ++a) {
    for (unsigned b = 0; b < 4; ++b) {
      for (unsigned c = 0; c < 4; ++c) {
        if (a != b && a != c && b != c) {
          const unsigned d = 6 - a - b - c;
          orders[n++] = static_cast<std::uint8_t>(a | (b << 2) | (c << 4) | (d << 6));
        }
      }
    }
  }
  return orders;
}
inline constexpr std::array<std::uint8_t, 24> kOrdersOfFour = orders_of_four();

/// Returns the index along a Z curve whose quadrants are permuted at every level; h selects the
/// permutations.
constexpr std::uint32_t shuffled_zcurve(std::uint32_t z, std::uint64_t h) noexcept {
  std::uint32_t out = 0;
  for (int level = kZcurveLevels - 1; level >= 0; --level) {
    const std::uint32_t digit = (z >> (2 * level)) & 3U;
    // The square being divided, with a leading bit that encodes its number of digits.
    const std::uint32_t square = (z | (1U << (2 * kZcurveLevels))) >> (2 * level + 2);
    const std::uint32_t bits = high_word(mix_bits(h + square * 0x9e3779b97f4a7c15ULL));
    out = (out << 2) | ((std::uint32_t{kOrdersOfFour[to_range(bits, 24)]} >> (2 * digit)) & 3U);
  }
  return out;
}

}  // namespace core
