/// Checks of uploaded files that would otherwise fail only when a job uses them.
#pragma once

#include <string>

#include "core/base/result.h"

namespace server {

/// Refuses Radiance images that cannot be read, and OpenEXR images with a cut or damaged header.
/// Errors: kInvalidArgument, kTooLarge; those of opening the file.
core::Status check_asset_file(const std::string& path);

}  // namespace server
