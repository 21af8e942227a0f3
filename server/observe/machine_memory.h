/// What memory this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace server {

/// The least of the machine's memory and the limits of the control groups (version 1 or 2) that the
/// process is in. root: where /proc and /sys are, for tests. 0: not known.
std::uint64_t usable_memory_bytes(const std::string& root = "");

}  // namespace server
