#include "core/image_io/image_size.h"

#include <array>
#include <cstring>

namespace core {
namespace {

using Span = std::span<const std::byte>;

bool starts_with(Span file, std::string_view magic, std::size_t at = 0) noexcept {
  return file.size() >= at + magic.size() &&
         std::memcmp(file.data() + at, magic.data(), magic.size()) == 0;
}

std::uint32_t u8(Span file, std::size_t at) noexcept {
  return std::to_integer<std::uint32_t>(file[at]);
}
std::uint32_t u16_big(Span file, std::size_t at) noexcept {
  return u8(file, at) << 8U | u8(file, at + 1);
}
std::uint32_t u16_little(Span file, std::size_t at) noexcept {
  return u8(file, at + 1) << 8U | u8(file, at);
}
std::uint32_t u32_big(Span file, std::size_t at) noexcept {
  return u16_big(file, at) << 16U | u16_big(file, at + 2);
}
std::uint32_t u24_little(Span file, std::size_t at) noexcept {
  return u8(file, at + 2) << 16U | u16_little(file, at);
}

std::optional<PixelSize> png_size(Span file) noexcept {
  if (file.size() < 24 || !starts_with(file, "IHDR", 12)) {
    return std::nullopt;
  }
  return PixelSize{u32_big(file, 16), u32_big(file, 20)};
}

// Markers FF xx with a 16-bit length, until a start-of-frame (C0 to CF except C4, C8, CC).
std::optional<PixelSize> jpeg_size(Span file) noexcept {
  std::size_t at = 2;
  while (at + 9 <= file.size()) {
    if (u8(file, at) != 0xFF) {
      return std::nullopt;
    }
    const std::uint32_t marker = u8(file, at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      at += 2;
      continue;
    }
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      return PixelSize{u16_big(file, at + 7), u16_big(file, at + 5)};
    }
    const std::uint32_t length = u16_big(file, at + 2);
    if (length < 2 || marker == 0xD9 || marker == 0xDA) {
      return std::nullopt;
    }
    at += 2 + length;
  }
  return std::nullopt;
}

std::optional<PixelSize> webp_size(Span file) noexcept {
  if (file.size() < 30) {
    return std::nullopt;
  }
  if (starts_with(file, "VP8X", 12)) {
    return PixelSize{u24_little(file, 24) + 1, u24_little(file, 27) + 1};
  }
  if (starts_with(file, "VP8L", 12)) {
    const std::uint32_t low = u16_little(file, 21);
    const std::uint32_t high = u16_little(file, 23);
    return PixelSize{(low & 0x3FFFU) + 1, ((high << 2U | low >> 14U) & 0x3FFFU) + 1};
  }
  if (starts_with(file, "VP8 ", 12)) {
    return PixelSize{u16_little(file, 26) & 0x3FFFU, u16_little(file, 28) & 0x3FFFU};
  }
  return std::nullopt;
}

std::uint32_t u32_little(Span file, std::size_t at) noexcept {
  return u16_little(file, at + 2) << 16U | u16_little(file, at);
}

// Text up to a zero byte; moves `at` behind it. Empty at the end of the header and in cut files.
std::string_view take_name(Span file, std::size_t& at) noexcept {
  constexpr std::size_t kNameMax = 255;
  const std::size_t first = at;
  while (at < file.size() && at - first <= kNameMax && file[at] != std::byte{0}) {
    ++at;
  }
  const std::size_t length = at - first;
  if (at >= file.size() || length > kNameMax) {
    return {};
  }
  ++at;
  return {reinterpret_cast<const char*>(file.data() + first), length};
}

// Attributes of the first header: name, type, size, value. OpenEXR takes memory for the table of
// chunk offsets before it reads it; a table that is larger than the file is not there.
std::optional<PixelSize> exr_size(Span file) noexcept {
  constexpr std::uint64_t kLinesPerChunkMax = 256;
  std::optional<PixelSize> size;
  std::uint64_t tile_width = 0;
  std::uint64_t tile_height = 0;
  std::size_t at = 8;
  for (std::string_view name = take_name(file, at); !name.empty(); name = take_name(file, at)) {
    const std::string_view type = take_name(file, at);
    if (type.empty() || at + 4 > file.size()) {
      return std::nullopt;
    }
    const std::size_t bytes = u32_little(file, at);
    at += 4;
    if (bytes > file.size() - at) {
      return std::nullopt;
    }
    if (name == "dataWindow" && bytes == 16) {
      const auto corner = [&](std::size_t i) {
        return static_cast<std::int64_t>(static_cast<std::int32_t>(u32_little(file, at + i * 4)));
      };
      if (corner(2) < corner(0) || corner(3) < corner(1)) {
        return std::nullopt;
      }
      size = PixelSize{static_cast<std::uint64_t>(corner(2) - corner(0) + 1),
                       static_cast<std::uint64_t>(corner(3) - corner(1) + 1)};
    } else if (name == "tiles" && bytes >= 8) {
      tile_width = u32_little(file, at);
      tile_height = u32_little(file, at + 4);
    }
    at += bytes;
  }
  if (!size) {
    return std::nullopt;
  }
  const bool tiled = tile_width > 0 && tile_height > 0;
  const std::uint64_t chunks = tiled ? (size->width / tile_width) * (size->height / tile_height)
                                     : size->height / kLinesPerChunkMax;
  return chunks <= file.size() / 8 ? size : std::nullopt;
}

}  // namespace

std::string_view image_kind(Span file) noexcept {
  if (starts_with(file, "\x89PNG\r\n\x1a\n")) {
    return "png";
  }
  if (starts_with(file, "\xff\xd8\xff")) {
    return "jpg";
  }
  if (starts_with(file, "RIFF") && starts_with(file, "WEBP", 8)) {
    return "webp";
  }
  if (starts_with(file, "\x76\x2f\x31\x01")) {
    return "exr";
  }
  if (starts_with(file, "#?RADIANCE") || starts_with(file, "#?RGBE")) {
    return "hdr";
  }
  if (starts_with(file, std::string_view("II*\0", 4)) ||
      starts_with(file, std::string_view("MM\0*", 4))) {
    return "tif";
  }
  return {};
}

bool png_is_whole(Span file) noexcept {
  constexpr std::size_t kAround = 12;  // length, type, checksum
  std::size_t at = 8;
  while (at + kAround <= file.size()) {
    const std::size_t length = u32_big(file, at);
    if (length > file.size() - at - kAround) {
      return false;
    }
    if (starts_with(file, "IEND", at + 4)) {
      return true;
    }
    at += kAround + length;
  }
  return false;
}

std::optional<PixelSize> peek_image_size(Span file) noexcept {
  const std::string_view kind = image_kind(file);
  if (kind == "png") {
    return png_size(file);
  }
  if (kind == "jpg") {
    return jpeg_size(file);
  }
  if (kind == "webp") {
    return webp_size(file);
  }
  return kind == "exr" ? exr_size(file) : std::nullopt;
}

}  // namespace core
