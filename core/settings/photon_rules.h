/// How many photons a sample has, how far it looks for them, and what they take in memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/settings/settings.h"

namespace core {

inline constexpr int kPhotonPathsLeast = 1 << 10;
/// Unless the job asks for more.
inline constexpr int kPhotonPathsUsual = 1 << 18;
/// Of one Photon.
inline constexpr std::uint64_t kPhotonBytes = 36;

/// Particles that leave the lights for each sample of the pixels: one for each pixel of the full
/// film, within limits, unless the job says how many.
inline int photon_paths(const RenderSettings& settings) noexcept {
  const std::int64_t pixels = static_cast<std::int64_t>(settings.film.width) * settings.film.height;
  return settings.photons.paths > 0 ? settings.photons.paths
                                    : static_cast<int>(std::clamp<std::int64_t>(
                                          pixels, kPhotonPathsLeast, kPhotonPathsUsual));
}

/// Radius of the disks of a replicate's sample number `pass`, over that of its first: r^2 grows by
/// (i + alpha) / (i + 1). Source: Knaus and Zwicker 2011, eq. 15.
inline double sppm_radius(float alpha, int pass) noexcept {
  double square = 1;
  for (int i = 1; i <= pass; ++i) {
    square *= (i + static_cast<double>(alpha)) / (i + 1);
  }
  return std::sqrt(square);
}

/// Most that the photons of one sample take: each particle at every surface that it may meet, twice
/// while the map is made.
inline std::uint64_t photon_bytes(const RenderSettings& settings) noexcept {
  const auto places = static_cast<std::uint64_t>(photon_paths(settings)) *
                      static_cast<std::uint64_t>(std::max(settings.max_depth, 1));
  return places * (2 * kPhotonBytes + 2 * sizeof(std::uint32_t));
}

}  // namespace core
