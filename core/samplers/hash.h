/// Integer hashes: stateless random numbers from (seed, pixel, sample, dimension).
#pragma once

#include <cstdint>

namespace core {

/// Source: the finaliser of MurmurHash3 with the constants of Stafford's mix 13.
constexpr std::uint64_t mix_bits(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

constexpr std::uint64_t hash_combine(std::uint64_t a, std::uint64_t b) noexcept {
  return mix_bits(a + 0x9e3779b97f4a7c15ULL * (b + 1));
}

/// Maps 24 bits to [0,1).
constexpr float to_unit_float(std::uint32_t bits) noexcept {
  return static_cast<float>(bits >> 8) * 0x1p-24F;
}

}  // namespace core
