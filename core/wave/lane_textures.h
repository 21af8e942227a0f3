/// Texture::find_taps() in lanes, for filtered lookups with coordinates in range.
#pragma once

#include <bit>
#include <cstddef>
#include <cstring>

#include "core/textures/texture.h"

namespace core {

template <std::size_t N>
using TextureLookups = TextureLookup<Floats<N>>;

/// Evaluates the lanes of `on`. Skips lanes that find_taps() leaves out; returns the lanes
/// evaluated.
template <std::size_t N>
Mask<N> find_taps(const TextureLookups<N>& at, Mask<N> on, Texture::Taps (&taps)[N]) {
  for (Texture::Taps& each : taps) {
    each.count = 0;
  }
  return find_taps(at, on, [&taps](Mask<N> taken, const TextureTap<Floats<N>>& tap) {
    constexpr std::size_t kParts = sizeof(Texture::Taps::Tap) / sizeof(float);
    static_assert(sizeof tap == kParts * N * sizeof(float));
    alignas(32) float parts[kParts][N];
    std::memcpy(parts, &tap, sizeof parts);
    for (unsigned rest = taken.bits(); rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      float of_lane[kParts];
      for (std::size_t part = 0; part < kParts; ++part) {
        of_lane[part] = parts[part][k];
      }
      std::memcpy(&taps[k].tap[static_cast<std::size_t>(taps[k].count++)], of_lane, sizeof of_lane);
    }
  });
}

}  // namespace core
