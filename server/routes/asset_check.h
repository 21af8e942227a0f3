/// Checks of uploaded files that would otherwise fail only when a job uses them.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"

namespace server {

struct AssetCheck {
  std::string path;
  std::string_view media_type;
  bool was_decoded = false;  ///< The same content has passed before, with any type.
};

/// Refuses images that cannot be decoded, as core::check_image_file(), and with an image/ type all
/// that is no image. Errors: kInvalidArgument, kTooLarge; those of opening the file.
core::Status check_asset_file(const AssetCheck& asset);

}  // namespace server
