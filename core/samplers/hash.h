/// Integer hashes: stateless random numbers from (seed, pixel, sample, dimension). H: 64 bits, of
/// one path or of lanes, std::uint64_t or Hashes<N>.
#pragma once

#include <cstdint>

#include "core/math/generic.h"

namespace core {

/// Source: the finaliser of MurmurHash3 with the constants of Stafford's mix 13.
template <typename H>
constexpr H mix_bits(H x) noexcept {
  static_assert(sizeof(H) >= sizeof(std::uint64_t));
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

template <typename H>
constexpr H hash_combine(H a, std::uint64_t b) noexcept {
  return mix_bits(a + 0x9e3779b97f4a7c15ULL * (b + 1));
}

/// Returns 64 more bits where those of a hash do not suffice.
template <typename H>
constexpr H second_hash(H h) noexcept {
  return mix_bits(h + 0x632be59bd9b4e019ULL);
}

constexpr std::uint32_t low_word(std::uint64_t h) noexcept { return static_cast<std::uint32_t>(h); }
constexpr std::uint32_t high_word(std::uint64_t h) noexcept {
  return static_cast<std::uint32_t>(h >> 32);
}

/// Maps the upper 24 bits of a std::uint32_t or Words<N> to [0,1).
template <typename W>
constexpr auto to_unit_float(W bits) noexcept {
  return to_floats(bits >> 8) * 0x1p-24F;
}

}  // namespace core
