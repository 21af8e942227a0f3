/// MeterChunk: the sums of a group of meter points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace core {

/// Even, so that jobs with different replicates (sampler.first_replicate) share none here. With 15
/// degrees of freedom an interval is 9% wider than with infinitely many.
inline constexpr int kMeterReplicates = 16;
/// Points per chunk; a chunk is sampled by one thread.
inline constexpr int kMeterChunk = 16;

using MeterSum = std::array<double, 3>;  ///< r, g, b

/// State of the points of a chunk.
struct MeterChunk {
  int samples = 0;
  std::vector<MeterSum> sums;  ///< [point * kMeterReplicates + replicate]; empty: 0
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
};

constexpr std::size_t meter_chunks(std::size_t points) {
  return (points + kMeterChunk - 1) / kMeterChunk;
}

}  // namespace core
