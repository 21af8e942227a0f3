#include "server/observe/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string_view>

namespace server {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// Returns the number in a file; kUnlimited for "max", and if there is no such file.
std::uint64_t number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// Returns the minimum over the group and its parents, whose limits apply to it too.
std::uint64_t least_on_the_way(const std::string& mount, std::string group, std::string_view name) {
  std::uint64_t least = kUnlimited;
  while (true) {
    least = std::min(least, number_in(mount + group + "/" + std::string(name)));
    const auto slash = group.rfind('/');
    if (slash == std::string::npos) {
      return least;
    }
    group.resize(slash);
  }
}

std::uint64_t machine_bytes(const std::string& root) {
  std::ifstream file(root + "/proc/meminfo");
  std::string word;
  std::uint64_t kilobytes = 0;
  while (file >> word) {
    if (word == "MemTotal:" && file >> kilobytes) {
      return kilobytes * 1024;
    }
  }
  return kUnlimited;
}

}  // namespace

std::uint64_t usable_memory_bytes(const std::string& root) {
  std::uint64_t least = machine_bytes(root);
  // Inside a container the paths may be those of the host, while the group's files are at the mount
  // itself.
  const std::string mount = root + "/sys/fs/cgroup";
  least = std::min({least, number_in(mount + "/memory.max"),
                    number_in(mount + "/memory/memory.limit_in_bytes")});
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (second == std::string::npos) {
      continue;
    }
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) {
      least = std::min(least, least_on_the_way(mount, group, "memory.max"));
    } else if (("," + controllers + ",").find(",memory,") != std::string::npos) {
      least = std::min(least, least_on_the_way(mount + "/memory", group, "memory.limit_in_bytes"));
    }
  }
  return least == kUnlimited ? 0 : least;
}

}  // namespace server
