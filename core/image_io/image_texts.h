/// Text metadata of PNG and EXR files.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>

#include "core/base/result.h"

namespace core {

/// tEXt chunks before the pixels of a PNG, string attributes of an EXR's first header, by name;
/// pixels are not needed. start: the file from its first byte, as far as that is read. Errors:
/// kInvalidArgument when it is neither, or is cut before the pixels begin.
Result<std::map<std::string, std::string>> read_image_texts(std::span<const std::byte> start);

}  // namespace core
