#include "core/image_io/image_size.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/base/byte_order.h"
#include "core/image_io/exr_header.h"

namespace core {
namespace {

using Span = std::span<const std::byte>;

bool starts_with(Span file, std::string_view magic, std::size_t at = 0) noexcept {
  return file.size() >= at + magic.size() &&
         std::memcmp(file.data() + at, magic.data(), magic.size()) == 0;
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

/// Returns where the first marker is that `is_wanted`, among those before the first scan and its
/// start (DA). Empty: none. Markers are FF xx, most with a 16-bit length.
template <typename IsWanted>
std::optional<std::size_t> find_jpeg_marker(Span file, IsWanted is_wanted) noexcept {
  std::size_t at = 2;
  while (at + 4 <= file.size() && u8(file, at) == 0xFF) {
    const std::uint32_t marker = u8(file, at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      at += 2;
      continue;
    }
    if (is_wanted(marker)) {
      return at;
    }
    const std::uint32_t length = u16_big(file, at + 2);
    if (length < 2 || marker == 0xD9 || marker == 0xDA) {
      return std::nullopt;
    }
    at += 2 + length;
  }
  return std::nullopt;
}

std::optional<PixelSize> jpeg_size(Span file) noexcept {
  // Starts of a frame: C0 to CF except C4, C8, CC.
  const auto frame = find_jpeg_marker(file, [](std::uint32_t marker) {
    return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
  });
  if (!frame || *frame + 9 > file.size()) {
    return std::nullopt;
  }
  return PixelSize{u16_big(file, *frame + 7), u16_big(file, *frame + 5)};
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
  if (starts_with(file, "#?")) {  // and the name of any program
    return "hdr";
  }
  if (starts_with(file, std::string_view("II*\0", 4)) ||
      starts_with(file, std::string_view("MM\0*", 4))) {
    return "tif";
  }
  if (starts_with(file, "\xABKTX 20\xBB\r\n\x1a\n")) {
    return "ktx2";
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

bool jpeg_is_whole(Span file) noexcept {
  const auto scan = find_jpeg_marker(file, [](std::uint32_t marker) { return marker == 0xDA; });
  if (!scan) {
    return false;
  }
  constexpr std::array kEnd = {std::byte{0xFF}, std::byte{0xD9}};
  return std::search(file.begin() + static_cast<std::ptrdiff_t>(*scan), file.end(), kEnd.begin(),
                     kEnd.end()) != file.end();
}

bool tiff_is_whole(Span file) noexcept {
  const bool is_little = u8(file, 0) == 'I';
  const auto has = [&](std::uint64_t at, std::uint64_t bytes) {
    return at <= file.size() && bytes <= file.size() - at;
  };
  const auto u16 = [&](std::uint64_t at) {
    const auto i = static_cast<std::size_t>(at);
    return is_little ? u16_little(file, i) : u16_big(file, i);
  };
  const auto u32 = [&](std::uint64_t at) {
    return is_little ? u16(at) | u16(at + 2) << 16U : u16(at) << 16U | u16(at + 2);
  };
  /// Numbers of 16 or 32 bits; empty if the file has none.
  struct Field {
    std::uint64_t at = 0;
    std::uint64_t count = 0;
    std::uint64_t size = 4;
  };
  Field offsets;
  Field counts;
  constexpr std::uint64_t kEntryBytes = 12;
  if (!has(0, 8) || !has(u32(4), 2) || !has(u32(4) + 2ULL, u16(u32(4)) * kEntryBytes)) {
    return false;
  }
  for (std::uint64_t entry = 0; entry < u16(u32(4)); ++entry) {
    const std::uint64_t at = u32(4) + 2 + kEntryBytes * entry;
    const std::uint32_t tag = u16(at);
    if (tag != 273 && tag != 324 && tag != 279 &&
        tag != 325) {  // StripOffsets, TileOffsets; counts
      continue;
    }
    const std::uint64_t size = u16(at + 2) == 3 ? 2 : 4;
    const std::uint64_t bytes = u32(at + 4) * size;
    Field& field = tag == 273 || tag == 324 ? offsets : counts;
    field = {bytes <= 4 ? at + 8 : u32(at + 8), u32(at + 4), size};
    if (!has(field.at, bytes)) {
      return false;
    }
  }
  const auto value = [&](const Field& field, std::uint64_t i) -> std::uint64_t {
    return field.size == 2 ? u16(field.at + 2 * i) : u32(field.at + 4 * i);
  };
  for (std::uint64_t i = 0; i < std::min(offsets.count, counts.count); ++i) {
    if (!has(value(offsets, i), value(counts, i))) {
      return false;
    }
  }
  return true;
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
  const auto header = kind == "exr" ? exr_header(file) : std::nullopt;
  return header ? std::optional(header->size) : std::nullopt;
}

}  // namespace core
