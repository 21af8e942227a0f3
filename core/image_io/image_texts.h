/// Text metadata of PNG and EXR files.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>

#include "core/base/result.h"

namespace core {

/// Returns the tEXt chunks before the pixels of a PNG, or the string attributes of an EXR's first
/// header, by name. start: the first bytes of the file. Errors: kInvalidArgument if it is neither
/// format, or is truncated before the pixels.
Result<std::map<std::string, std::string>> read_image_texts(std::span<const std::byte> start);

}  // namespace core
