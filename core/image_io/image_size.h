/// Format of an image file from its first bytes, and its size where a decoder would allocate the
/// pixels before reporting it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace core {

/// "png" "jpg" "webp" "exr" "hdr" "tif" "ktx2" by magic bytes; empty for anything else.
std::string_view image_kind(std::span<const std::byte> file) noexcept;

struct PixelSize {
  std::uint64_t width = 0;
  std::uint64_t height = 0;
};

/// Width and height of a PNG, JPEG, WebP or EXR, read without its decoder. Empty for other formats
/// and for headers that are cut, malformed, or (EXR) whose offset table would not fit in the file.
std::optional<PixelSize> peek_image_size(std::span<const std::byte> file) noexcept;

/// Whether the chunks of a PNG are whole up to its IEND. Pre: image_kind() is "png".
bool png_is_whole(std::span<const std::byte> file) noexcept;

}  // namespace core
