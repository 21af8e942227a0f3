#include "core/base/cgroup.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

namespace core {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Returns the processors of a quota; infinity if there is none.
double quota_in(const std::string& folder) {
  double quota = 0;
  double period = 0;
  // "max 100000" has no quota, and -1 in the older files.
  if (std::ifstream file(folder + "/cpu.max"); !(file >> quota >> period)) {
    std::ifstream quota_file(folder + "/cpu.cfs_quota_us");
    std::ifstream period_file(folder + "/cpu.cfs_period_us");
    if (!(quota_file >> quota) || !(period_file >> period)) {
      return kUnlimited;
    }
  }
  return quota > 0 && period > 0 ? quota / period : kUnlimited;
}

}  // namespace

std::vector<std::string> cgroup_folders(std::string_view controller, const std::string& root) {
  const std::string mount = root + "/sys/fs/cgroup";
  const std::string older = mount + "/" + std::string(controller);
  // Inside a container the paths may be those of the host, while the group's files are at the mount
  // itself.
  std::vector<std::string> folders = {mount, older};
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (second == std::string::npos) {
      continue;
    }
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool is_unified = controllers == ",,";
    if (!is_unified && controllers.find("," + std::string(controller) + ",") == std::string::npos) {
      continue;
    }
    for (std::string group = line.substr(second + 1); group.size() > 1;
         group.resize(group.rfind('/'))) {
      folders.push_back((is_unified ? mount : older) + group);
      if (group.find('/') == std::string::npos) {
        break;
      }
    }
  }
  return folders;
}

int usable_threads(const std::string& root) {
  double least = std::max(1U, std::thread::hardware_concurrency());
  for (const std::string& folder : cgroup_folders("cpu", root)) {
    least = std::min(least, std::ceil(quota_in(folder)));
  }
  return std::max(1, static_cast<int>(least));
}

}  // namespace core
