/// Memory that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace server {

/// Returns the minimum of the machine's memory and the limits of the process's control groups
/// (version 1 or 2). root: directory that holds /proc and /sys, for tests. 0: unknown.
std::uint64_t usable_memory_bytes(const std::string& root = "");

}  // namespace server
