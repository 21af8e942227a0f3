/// Memory of the records of integrator `irradiance-cache`.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/settings/settings.h"

namespace core {

/// Bytes of one record, including its index entries.
inline constexpr std::uint64_t kRecordBytes = 288;
/// Camera paths per round and replicate.
inline constexpr int kRoundPointsMost = 1 << 18;
/// Bytes of the points along one such path that lack a record.
inline constexpr std::uint64_t kRoundPointBytes = 64;

/// Returns the maximum memory of the caches of all replicates, including the new records of a
/// round.
inline std::uint64_t cache_bytes(const RenderSettings& settings) noexcept {
  const auto replicates = static_cast<std::uint64_t>(settings.replicates);
  const auto points = static_cast<std::uint64_t>(
      std::min(static_cast<std::int64_t>(settings.film.width) * settings.film.height,
               std::int64_t{kRoundPointsMost}));
  return replicates * (2 * static_cast<std::uint64_t>(settings.cache.records) * kRecordBytes +
                       points * kRoundPointBytes);
}

}  // namespace core
