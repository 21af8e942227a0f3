/// Reads KTX2 files of KHR_texture_basisu: the largest level of one 2D image in ETC1S or UASTC.
/// Source: KTX File Format Specification 2.0; Khronos Data Format Specification 1.3, 5.6.
#pragma once

#include <cstddef>
#include <span>

#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace core {

/// Reads size and channels only. Errors: kInvalidArgument for other files, and for layers, faces,
/// depth and other formats; kTooLarge.
Result<Image> read_ktx2_header(std::span<const std::byte> file, const ImageLimits& limits);

/// Decodes to 8-bit RGB, or RGBA if the file has alpha. A file with two channels gives red and
/// green. Besides the pixels it needs at most one byte per pixel, plus the codebooks: a few MB at
/// most.
Result<Image> decode_ktx2(std::span<const std::byte> file, const ImageLimits& limits);

}  // namespace core
