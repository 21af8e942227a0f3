/// Reads PNG and JPEG files by libpng and libjpeg, which need no module (image_codec.h).
#pragma once

#include <span>

#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace core {

/// As read_image_header() and decode_image(): 1 to 4 channels of 8 or 16 bits. Palettes become
/// colours, and a transparent colour becomes alpha.
Result<Image> read_png_header(std::span<const std::byte> file, const ImageLimits& limits);
Result<Image> decode_png(std::span<const std::byte> file, const ImageLimits& limits);

/// Returns whether a JPEG has four inks, which OpenImageIO converts to colours.
bool has_inks(std::span<const std::byte> file);
/// As above: 1 or 3 channels of 8 bits. Pre: no inks.
Result<Image> read_jpeg_header(std::span<const std::byte> file, const ImageLimits& limits);
Result<Image> decode_jpeg(std::span<const std::byte> file, const ImageLimits& limits);

}  // namespace core
