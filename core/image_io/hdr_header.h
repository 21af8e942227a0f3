/// The resolution line of a Radiance HDR file, which tells where its scanlines lie in the picture.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/image_io/image.h"

namespace core {

/// Source: Radiance, "File Formats", https://floyd.lbl.gov/radiance/refer/filefmts.pdf: `-Y 8 +X
/// 16` has 8 scanlines from the top, each of 16 pixels from the left; `+X 16 -Y 8` has 16 columns
/// from the left, each from the top.
struct HdrOrder {
  bool by_columns = false;
  bool from_right = false;
  bool from_bottom = false;
};

/// Empty for a header without a valid resolution line. Pre: image_kind() is "hdr".
std::optional<HdrOrder> hdr_order(std::span<const std::byte> file);

/// Returns whether the file holds every pixel of its size: walks the scanlines, plain, run-length
/// encoded per channel, or in the old way, without decoding them. Pre: image_kind() is "hdr".
/// Source: Ward, "Real Pixels", Graphics Gems II; the same "File Formats".
bool hdr_is_whole(std::span<const std::byte> file) noexcept;

/// Turns an image whose rows are the scanlines of the file upright. An image without pixels only
/// changes its size.
Image in_order(Image scanlines, const HdrOrder& order);

}  // namespace core
