/// Checks of uploaded files that would otherwise fail only when a job uses them.
#pragma once

#include <string>

#include "core/base/result.h"

namespace server {

/// Refuses environment maps (Radiance, OpenEXR) that are cut short or damaged; other files pass.
/// Errors: kInvalidArgument; those of opening the file.
core::Status check_asset_file(const std::string& path);

}  // namespace server
