/// Groups of lights: names that lights share, by number.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace core {

/// Of lights without a name.
inline constexpr const char* kUnnamedGroup = "unnamed";

/// The number of a name, which is added if it is new.
inline std::uint32_t light_group(std::vector<std::string>& groups, const std::string& given) {
  const std::string name = given.empty() ? kUnnamedGroup : given;
  const auto found = std::find(groups.begin(), groups.end(), name);
  const auto index = static_cast<std::uint32_t>(found - groups.begin());
  if (found == groups.end()) {
    groups.push_back(name);
  }
  return index;
}

}  // namespace core
