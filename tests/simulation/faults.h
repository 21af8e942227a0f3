/// Faults: how often each kind has happened, so that a kind that no longer happens is noticed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace simulation {

enum class Fault : std::uint8_t {
  kKilled,
  kPowerLost,
  kStopped,
  kStalled,
  kClockJumped,
  kDiskFull,
  kDiskUnreadable,
  kFilmDamaged,
  kLogDamaged,
  kLoadHangs,
  kDrained,
  kQueueDown,
  kNameLost,
  kNameDoubled,
  kRequestLost,
  kRequestDoubled,
  kResultLate,
  kNetworkCut,
  kWorkerRestarted,
  kWorkerSick,
  kWorkerLied,
};
inline constexpr std::array<std::string_view, 21> kFaultNames = {
    "killed",          "power-lost",      "stopped",      "stalled",          "clock-jumped",
    "disk-full",       "disk-unreadable", "film-damaged", "log-damaged",      "load-hangs",
    "drained",         "queue-down",      "name-lost",    "name-doubled",     "request-lost",
    "request-doubled", "result-late",     "network-cut",  "worker-restarted", "worker-sick",
    "worker-lied"};

/// Counts one of this process.
void count_fault(Fault kind);
/// Returns `NAME COUNT NAME COUNT...` of this process, for the trace.
std::string fault_counts();

}  // namespace simulation
