/// Colours of paths in lanes: RgbColors and SpectralColors::values().
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/color/wavelengths.h"
#include "core/math/lane_math.h"
#include "core/wave/wave_access.h"

namespace core {

template <std::size_t N>
struct RgbLanes {
  static RgbLanes of(const Wave&, const std::int32_t*, unsigned) { return {}; }
  static Vec3s<N> values(Vec3s<N> color) { return color; }
};

template <std::size_t N>
struct SpectrumLanes {
  Vec3s<N> shares[3];

  /// Of the lanes of `on` with these slots.
  static SpectrumLanes of(const Wave& wave, const std::int32_t* slots, unsigned on) {
    const float* rows[3][N];
    for (std::size_t k = 0; k < N; ++k) {
      const std::size_t sample = (on >> k & 1U) != 0 ? sample_of(slots[k]) : 0;
      for (std::size_t part = 0; part < 3; ++part) {
        rows[part][k] = wave.wavelengths[sample].shares() + 4 * part;
      }
    }
    Floats<N> c[3][4];
    for (std::size_t part = 0; part < 3; ++part) {
      transpose(rows[part], c[part]);
    }
    return {
        {{c[0][0], c[0][1], c[0][2]}, {c[0][3], c[1][0], c[1][1]}, {c[1][2], c[1][3], c[2][0]}}};
  }
  Vec3s<N> values(Vec3s<N> color) const {
    return {dot(shares[0], color), dot(shares[1], color), dot(shares[2], color)};
  }
};

}  // namespace core
