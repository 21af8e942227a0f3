/// Environments made from settings alone: a constant colour, a preset, or sun and sky.
#pragma once

#include <cstdint>
#include <memory>

#include "core/lights/environment.h"

namespace core {

/// Errors: kInvalidArgument at "/environment/sun/time" if the sun is below the horizon.
Result<std::shared_ptr<const Environment>> make_environment(const EnvironmentSettings& settings);

/// Returns the memory that the environment needs.
std::uint64_t made_environment_bytes(const EnvironmentSettings& settings);

}  // namespace core
