/// Pauses of `tessera worker`.
#pragma once

#include <chrono>

namespace cli {

/// Wait before an unreachable server gets the next report, and before a unit that is meant for
/// another worker is asked for again: short compared to units of seconds.
inline constexpr std::chrono::milliseconds kAskAgain{200};

}  // namespace cli
