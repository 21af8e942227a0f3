/// WorkOptions: settings by which a coordinator controls its workers.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace server {

/// Largest size of a unit's result. Fits the splats of a 3840 x 2160 picture with two replicates
/// (core/render/units/result_size.h); jobs with larger results are rendered by the coordinator.
inline constexpr std::uint64_t kResultBytesMax = std::uint64_t{1} << 30U;

/// Workers that may report, and suspended ones that are stored. Reports of this many keep six
/// tenths of a core busy: a report takes 0.12 ms of the coordinator (tests/bench/farm replay
/// --record) and comes every two seconds.
inline constexpr int kWorkersMax = 10'000;

/// Longest CPU time of a unit, so that a worker half as fast as the mean takes 5 s for it.
inline constexpr double kUnitSecondsMost = 2.5;

struct WorkOptions {
  double lease_seconds = 15;  ///< Lease of a unit whose worker reports no progress.
  std::chrono::steady_clock::duration lease_time() const {
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(lease_seconds));
  }
  std::string build;  ///< Build that workers must have.
  std::string arithmetic;
  bool has_local_threads = false;  ///< Threads that also render jobs that workers can render.
  float verify_share = 0;          ///< Share of the units that two workers render.
  /// Clock of the leases.
  std::function<std::chrono::steady_clock::time_point()> now = &std::chrono::steady_clock::now;
};

}  // namespace server
