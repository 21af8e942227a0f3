#include "server/observe/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "core/base/cgroup.h"

namespace server {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// Returns the number in a file; kUnlimited for "max", and if there is no such file.
std::uint64_t number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
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
  for (const std::string& folder : core::cgroup_folders("memory", root)) {
    least = std::min(
        {least, number_in(folder + "/memory.max"), number_in(folder + "/memory.limit_in_bytes")});
  }
  return least == kUnlimited ? 0 : least;
}

}  // namespace server
