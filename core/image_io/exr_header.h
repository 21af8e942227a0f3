/// Checks the headers of an OpenEXR file before OpenEXR reads them, because OpenEXR trusts their
/// sizes and allocates memory for them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/image_io/image_size.h"

namespace core {

/// Returns the size of the first part's data window. Empty if a header is truncated, an attribute's
/// size does not fit its type or the file, or a table of chunk offsets would be larger than the
/// file. Pre: image_kind() is "exr". Source: "OpenEXR File Layout", openexr.com.
std::optional<PixelSize> exr_size(std::span<const std::byte> file) noexcept;

}  // namespace core
