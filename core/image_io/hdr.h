/// Radiance HDR files. Read here, because OpenImageIO knows neither old run lengths nor the
/// variables of the header.
///
/// Source: Radiance, "File Formats", https://floyd.lbl.gov/radiance/refer/filefmts.pdf; Ward, "Real
/// Pixels", Graphics Gems II. Scanlines are plain, run-length encoded per channel, or in the old
/// way, per pixel. `-Y 8 +X 16` has 8 scanlines from the top, each of 16 pixels from the left; `+X
/// 16 -Y 8` has 16 columns from the left, each from the top.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/image_io/exr_header.h"
#include "core/image_io/image_io.h"

namespace core {

/// As read_image_header() and decode_image(): 3 floats, divided by all EXPOSURE and COLORCORR. XYZE
/// is refused. Pre: image_kind() is "hdr".
Result<Image> read_hdr_header(std::span<const std::byte> file, const ImageLimits& limits);
Result<Image> decode_hdr(std::span<const std::byte> file, const ImageLimits& limits);

/// Returns the error of decode_hdr(), without memory for the pixels.
Status check_hdr(std::span<const std::byte> file);

/// Returns the last PRIMARIES of the header.
std::optional<Chromaticities> hdr_primaries(std::span<const std::byte> file);

}  // namespace core
