/// Light groups: names that lights share, stored by index.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace core {

/// The group of lights without a name.
inline constexpr const char* kUnnamedGroup = "unnamed";
/// The group of the environment, and that of lights with its name.
inline constexpr const char* kEnvironmentGroupName = "environment";
inline constexpr const char* kEnvironmentLights = "environment lights";

/// Returns the index of a name that is not the environment's; adds the name if it is new.
inline std::uint32_t light_group(std::vector<std::string>& groups, const std::string& given) {
  const std::string name = given.empty()                    ? kUnnamedGroup
                           : given == kEnvironmentGroupName ? kEnvironmentLights
                                                            : given;
  const auto found = std::find(groups.begin(), groups.end(), name);
  const auto index = static_cast<std::uint32_t>(found - groups.begin());
  if (found == groups.end()) {
    groups.push_back(name);
  }
  return index;
}

}  // namespace core
