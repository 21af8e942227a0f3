/// Faults: how often each kind happens, in one table, and how often each has happened, so that a
/// kind that no longer happens is noticed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/simulation/executor.h"

namespace simulation {

enum class Fault : std::uint8_t {
  kKilled,
  kPowerLost,
  kStopped,
  kUpgraded,
  kStalled,
  kClockJumped,
  kDiskFull,
  kDiskUnreadable,
  kReadFails,
  kWriteFails,
  kFilmDamaged,
  kLogDamaged,
  kLoadHangs,
  kLoadFails,
  kDrained,
  kReloaded,
  kRequestCut,
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
  kCallLost,
  kCallRefused,
  kCallUnanswered,
};

struct FaultRow {
  std::string_view name;
  double a_day = 0;  ///< While it can happen; 0: it follows from something else.
};
/// A kind that only lives with workers can have happens in a seventh of the time, so that its
/// number is larger: each must happen once a day.
inline constexpr std::array<FaultRow, 30> kFaults = {
    {{"killed", 24},          {"power-lost", 24},
     {"stopped", 16},         {"upgraded", 0},
     {"stalled", 1000},       {"clock-jumped", 12},
     {"disk-full", 12},       {"disk-unreadable", 6},
     {"read-fails", 6},       {"write-fails", 6},
     {"film-damaged", 12},    {"log-damaged", 36},
     {"load-hangs", 12},      {"load-fails", 12},
     {"drained", 6},          {"reloaded", 12},
     {"request-cut", 48},     {"queue-down", 48},
     {"name-lost", 48},       {"name-doubled", 48},
     {"request-lost", 1000},  {"request-doubled", 1000},
     {"result-late", 480},    {"network-cut", 960},
     {"worker-restarted", 0}, {"worker-sick", 0},
     {"worker-lied", 0},      {"call-lost", 12},
     {"call-refused", 12},    {"call-unanswered", 12}}};
constexpr const FaultRow& row_of(Fault kind) { return kFaults[static_cast<std::size_t>(kind)]; }

inline constexpr Nanoseconds kHour = 3600 * kSecond;
inline constexpr Nanoseconds kDay = 24 * kHour;
/// A shift: hours of requests and faults, an hour in which nothing fails, so that every job must
/// end, and a quiet night.
inline constexpr Nanoseconds kShift = 12 * kHour;
/// Mean time for which something that fails is gone: a disk, a queue, a place for comparisons.
inline constexpr Nanoseconds kOutage = 300 * kSecond;

/// Of strikes(); once per process.
void seed_faults(std::uint64_t seed);
/// Returns whether a fault of that kind happens now, and counts it: at one of the next times that
/// it could, after moments that come as often as the table says.
bool strikes(Fault kind);
/// The chance that it happens at a start of the server.
double chance_at_start(Fault kind);

/// Counts one of this process.
void count_fault(Fault kind);
/// Returns whether one has happened in this process.
bool has_happened(Fault kind);
/// Returns `NAME COUNT NAME COUNT...` of this process, for the trace.
std::string fault_counts();

}  // namespace simulation
