/// What the records of integrator `irradiance-cache` take in memory.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/settings/settings.h"

namespace core {

/// Of one record and its places in the index.
inline constexpr std::uint64_t kRecordBytes = 288;
/// Camera paths of one round, for each replicate.
inline constexpr int kRoundPointsMost = 1 << 18;
/// Of the places along one such path that lack a record.
inline constexpr std::uint64_t kRoundPointBytes = 64;

/// Most that the caches of all replicates take, the records of a round that are not in them yet
/// included.
inline std::uint64_t cache_bytes(const RenderSettings& settings) noexcept {
  const auto replicates = static_cast<std::uint64_t>(settings.replicates);
  const auto points = static_cast<std::uint64_t>(
      std::min(static_cast<std::int64_t>(settings.film.width) * settings.film.height,
               std::int64_t{kRoundPointsMost}));
  return replicates * (2 * static_cast<std::uint64_t>(settings.cache.records) * kRecordBytes +
                       points * kRoundPointBytes);
}

}  // namespace core
