/// Detects the format of an image file from its first bytes, and its size where a decoder would
/// allocate pixels before reporting it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace core {

/// Returns "png", "jpg", "webp", "exr", "hdr", "tif" or "ktx2" by magic bytes; empty for other
/// files.
std::string_view image_kind(std::span<const std::byte> file) noexcept;

struct PixelSize {
  std::uint64_t width = 0;
  std::uint64_t height = 0;
};

/// Returns width and height of a PNG, JPEG, WebP or EXR without its decoder. Empty for other
/// formats, truncated or malformed headers, and EXR files whose offset table would not fit in the
/// file.
std::optional<PixelSize> peek_image_size(std::span<const std::byte> file) noexcept;

/// Returns whether the chunks of a PNG are complete up to IEND. Pre: image_kind() is "png".
bool png_is_whole(std::span<const std::byte> file) noexcept;

/// Returns whether a JPEG's first scan is followed by an end of image. Decoders fill what is
/// missing with grey. Pre: image_kind() is "jpg". Source: ITU-T T.81, annex B.
bool jpeg_is_whole(std::span<const std::byte> file) noexcept;

/// Returns whether the strips or tiles of a TIFF's first image lie in the file: of uncompressed
/// ones libtiff misses the end. Pre: image_kind() is "tif". Source: TIFF 6.0, section 2.
bool tiff_is_whole(std::span<const std::byte> file) noexcept;

}  // namespace core
