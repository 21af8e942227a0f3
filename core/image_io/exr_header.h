/// Checks the headers of an OpenEXR file before OpenEXR reads them, because OpenEXR trusts their
/// sizes and allocates memory for them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/image_io/image_size.h"

namespace core {

/// x and y of red, green, blue and white.
using Chromaticities = std::array<float, 8>;

struct ExrHeader {
  PixelSize size;  ///< of the first part's data window
  /// The first channel of any part with fewer values than pixels, as the chroma of an image of
  /// luminance and chroma; empty: none.
  std::string_view subsampled;
  bool is_cube = false;  ///< six faces of an environment, one below the other
  std::optional<Chromaticities> primaries = {};
  std::uint8_t compression = 0;  ///< of the first part
  bool is_whole = true;          ///< All chunks that the table names lie in the file.
};

/// Empty if a header is truncated, an attribute's size does not fit its type or the file, or a
/// table of chunk offsets would be larger than the file. The result borrows the file. Pre:
/// image_kind() is "exr". Source: "OpenEXR File Layout", openexr.com.
std::optional<ExrHeader> exr_header(std::span<const std::byte> file) noexcept;

}  // namespace core
