/// One life of a simulated server: from its start to its end, which may be a crash.
#pragma once

#include <cstdint>
#include <string>

#include "tests/simulation/copier.h"
#include "tests/simulation/executor.h"
#include "tests/simulation/faults.h"
#include "tests/simulation/ledger.h"

namespace simulation {

/// How a process ends.
enum class Ending : int {
  kShiftOver = 0,   ///< The shift is over; the server stopped as on a signal.
  kKilled = 10,     ///< At a change of the disk.
  kPowerLost = 11,  ///< The same, and what was not synced was lost in part.
  kStopped = 12,    ///< Stopped before its end.
  kUpgraded = 13,   ///< The same, and the next life is of another build.
  kViolation = 20,  ///< An invariant does not hold; the last line says which.
};

struct Life {
  const Copier* copier = nullptr;
  std::string root;  ///< Holds the data directory.
  std::uint64_t seed = 0;
  std::uint64_t number = 0;
  Nanoseconds start = 0;
  int build = 1;                ///< Number of the program's build.
  bool is_faulty = true;        ///< Otherwise nothing fails.
  bool expects_damage = false;  ///< A bit of the log was flipped, which must be noticed.
};

/// Lives until the end of the shift at latest, and ends the process. `ledger` is the clients'.
[[noreturn]] void live(const Life& life, Ledger& ledger);
/// Renders every kind of job that the clients submit, undisturbed, and notes the digests.
[[noreturn]] void render_undisturbed(const Life& life, Ledger& ledger);

}  // namespace simulation
