/// KTX2 files of KHR_texture_basisu: one 2D picture in ETC1S or UASTC, of which the largest level
/// is read.
/// Source: KTX File Format Specification 2.0; Khronos Data Format Specification 1.3, 5.6.
#pragma once

#include <cstddef>
#include <span>

#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace core {

/// Size and channels alone. Errors: kInvalidArgument for what is no such file, also for layers,
/// faces, depth and other formats; kTooLarge.
Result<Image> read_ktx2_header(std::span<const std::byte> file, const ImageLimits& limits);

/// 8-bit RGB, or RGBA where the file has alpha. A file of two channels gives red and green.
/// Beside the pixels it takes no more than a byte a pixel, and the codebooks: some MB at most.
Result<Image> decode_ktx2(std::span<const std::byte> file, const ImageLimits& limits);

}  // namespace core
