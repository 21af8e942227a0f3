/// Environments that come from settings alone: one colour, a preset, sun and sky.
#pragma once

#include <cstdint>
#include <memory>

#include "core/lights/environment.h"

namespace core {

/// Errors: kInvalidArgument at "/environment/sun/time" where the sun is below the horizon.
Result<std::shared_ptr<const Environment>> make_environment(const EnvironmentSettings& settings);

/// What such an environment takes.
std::uint64_t made_environment_bytes(const EnvironmentSettings& settings);

}  // namespace core
