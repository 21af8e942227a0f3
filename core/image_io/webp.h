/// WebP files, by libwebp: its pixels are as stored, also where alpha is 0. (OpenImageIO multiplies
/// them by alpha before version 3.1.)
#pragma once

#include <cstddef>
#include <span>

#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace core {

/// As read_image_header() and decode_image(): 3 or 4 channels of 8 bits. Of an animation the first
/// frame is read, on a transparent canvas.
Result<Image> read_webp_header(std::span<const std::byte> file, const ImageLimits& limits);
Result<Image> decode_webp(std::span<const std::byte> file, const ImageLimits& limits);

}  // namespace core
