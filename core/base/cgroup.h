/// Limits of the control groups in which this process runs (a container, a service, a pod).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace core {

/// Returns the folders in which a limit may stand: those of the process's groups, and of their
/// parents, whose limits apply too, in both versions of control groups. root: prefix of /proc and
/// /sys.
std::vector<std::string> cgroup_folders(std::string_view controller, const std::string& root = "");

/// Returns the threads that this process can run at the same time, at least 1: the processors that
/// it may use, or the quota of processor time of its groups, rounded up. Threads beyond a quota
/// only make the system stop all of them for a part of each period. Source: Linux, CFS Bandwidth
/// Control.
int usable_threads(const std::string& root = "");

}  // namespace core
