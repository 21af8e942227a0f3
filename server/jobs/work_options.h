/// WorkOptions: how a coordinator treats its workers.
#pragma once

#include <cstdint>
#include <string>

namespace server {

/// Of a unit's result. Room for the splats of a picture of 3840 x 2160 with two replicates
/// (core/render/result_size.h); jobs whose results may be larger stay with the coordinator.
inline constexpr std::uint64_t kResultBytesMax = std::uint64_t{1} << 30U;

struct WorkOptions {
  double lease_seconds = 15;  ///< Of a unit whose worker makes no progress.
  std::string build;          ///< That workers need to have.
  std::string arithmetic;
  bool has_local_threads = false;  ///< That render what workers can.
  float verify_share = 0;          ///< Of the units, that two workers render.
};

}  // namespace server
