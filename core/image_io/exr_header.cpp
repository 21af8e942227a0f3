#include "core/image_io/exr_header.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/base/byte_order.h"

namespace core {
namespace {

using Span = std::span<const std::byte>;

// Attribute types of fixed size. OpenEXR reads this many bytes whatever size the file states.
struct FixedType {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array kFixedTypes = {
    FixedType{"box2i", 16},
    FixedType{"box2f", 16},
    FixedType{"chromaticities", 32},
    FixedType{"compression", 1},
    FixedType{"deepImageState", 1},
    FixedType{"double", 8},
    FixedType{"envmap", 1},
    FixedType{"float", 4},
    FixedType{"int", 4},
    FixedType{"keycode", 28},
    FixedType{"lineOrder", 1},
    FixedType{"m33f", 36},
    FixedType{"m33d", 72},
    FixedType{"m44f", 64},
    FixedType{"m44d", 128},
    FixedType{"rational", 8},
    FixedType{"tiledesc", 9},
    FixedType{"timecode", 8},
    FixedType{"v2i", 8},
    FixedType{"v2f", 8},
    FixedType{"v2d", 16},
    FixedType{"v3i", 12},
    FixedType{"v3f", 12},
    FixedType{"v3d", 24},
};

std::int64_t i32(Span file, std::size_t at) noexcept {
  return static_cast<std::int32_t>(u32_little(file, at));
}

// Reads text up to a zero byte and moves `at` behind it. Empty if there is no text or no zero byte.
std::string_view take_name(Span file, std::size_t& at) noexcept {
  constexpr std::size_t kNameMax = 255;
  const std::size_t first = at;
  while (at < file.size() && at - first <= kNameMax && file[at] != std::byte{0}) {
    ++at;
  }
  const std::size_t length = at - first;
  if (at >= file.size() || length > kNameMax) {
    at = file.size();
    return {};
  }
  ++at;
  return {reinterpret_cast<const char*>(file.data() + first), length};
}

// Checks for a list of channels: a name and 16 bytes each, up to an empty name, which must be the
// value's last byte. Sets `subsampled`, if it is empty, to the first with fewer values than pixels.
bool is_channel_list(Span value, std::string_view& subsampled) noexcept {
  constexpr std::size_t kChannelBytes = 16;
  constexpr std::size_t kSamplings = 8;  // the last two numbers: pixels per value in x and y
  std::size_t at = 0;
  for (auto name = take_name(value, at); !name.empty(); name = take_name(value, at)) {
    if (at + kChannelBytes > value.size()) {
      return false;
    }
    const bool is_full =
        u32_little(value, at + kSamplings) == 1 && u32_little(value, at + kSamplings + 4) == 1;
    subsampled = subsampled.empty() && !is_full ? name : subsampled;
    at += kChannelBytes;
  }
  return at == value.size() && !value.empty() && value.back() == std::byte{0};
}

bool fits_its_type(std::string_view type, Span value) noexcept {
  if (type == "preview") {
    return value.size() >= 8 &&
           std::uint64_t{u32_little(value, 0)} * u32_little(value, 4) == (value.size() - 8) / 4 &&
           value.size() % 4 == 0;
  }
  const auto* const fixed = std::find_if(kFixedTypes.begin(), kFixedTypes.end(),
                                         [type](const FixedType& t) { return t.name == type; });
  return fixed == kFixedTypes.end() || fixed->bytes == value.size();
}

struct Part {
  std::optional<PixelSize> size;
  std::uint64_t tile_width = 0;
  std::uint64_t tile_height = 0;
  std::uint64_t chunks = 0;  // from the header; 0 if missing
  std::string_view subsampled;
  bool is_deep = false;  // in a file of several parts
  bool is_cube = false;
  std::optional<Chromaticities> primaries;
  std::uint8_t compression = 0;
};

// Reads one attribute with a known name into `part`.
bool take_attribute(Span file, std::size_t& at, std::string_view name, Part& part) noexcept {
  const std::string_view type = take_name(file, at);
  if (type.empty() || at + 4 > file.size() || u32_little(file, at) > file.size() - at - 4) {
    return false;
  }
  const Span value = file.subspan(at + 4, u32_little(file, at));
  at += 4 + value.size();
  if (type == "chlist" ? !is_channel_list(value, part.subsampled) : !fits_its_type(type, value)) {
    return false;
  }
  if (name == "dataWindow") {
    if (type != "box2i" || i32(value, 8) < i32(value, 0) || i32(value, 12) < i32(value, 4)) {
      return false;
    }
    part.size = PixelSize{static_cast<std::uint64_t>(i32(value, 8) - i32(value, 0) + 1),
                          static_cast<std::uint64_t>(i32(value, 12) - i32(value, 4) + 1)};
  } else if (name == "tiles" && type == "tiledesc") {
    part.tile_width = u32_little(value, 0);
    part.tile_height = u32_little(value, 4);
    return part.tile_width > 0 && part.tile_height > 0;
  } else if (name == "type" && type == "string") {
    part.is_deep = std::string_view(reinterpret_cast<const char*>(value.data()), value.size())
                       .starts_with("deep");
  } else if (name == "chunkCount" && type == "int") {
    part.chunks = u32_little(value, 0);
  } else if (name == "envmap" && type == "envmap") {
    part.is_cube = value[0] == std::byte{1};  // 0: latitude and longitude
  } else if (name == "compression" && type == "compression") {
    part.compression = std::to_integer<std::uint8_t>(value[0]);
  } else if (name == "chromaticities" && type == "chromaticities") {
    std::memcpy(part.primaries.emplace().data(), value.data(), value.size());
  }
  return true;
}

bool has_room_for_its_table(const Part& part, std::size_t file_bytes) noexcept {
  constexpr std::uint64_t kLinesPerChunkMax = 256;
  const std::uint64_t needed = part.tile_width > 0 ? (part.size->width / part.tile_width) *
                                                         (part.size->height / part.tile_height)
                                                   : part.size->height / kLinesPerChunkMax;
  return std::max(needed, part.chunks) <= file_bytes / 8;
}

/// Reads a header and moves `at` behind it.
std::optional<Part> take_header(Span file, std::size_t& at) noexcept {
  Part part;
  for (auto name = take_name(file, at); !name.empty(); name = take_name(file, at)) {
    if (!take_attribute(file, at, name, part)) {
      return std::nullopt;
    }
  }
  return at < file.size() && part.size && has_room_for_its_table(part, file.size())
             ? std::optional(part)
             : std::nullopt;
}

constexpr std::size_t kVersionBytes = 8;

/// Returns the header with that number of a file of several parts.
std::optional<Part> part_of(Span file, std::uint32_t number) noexcept {
  std::size_t at = kVersionBytes;
  for (std::uint32_t i = 0; i < number; ++i) {
    if (!take_header(file, at) || file[at] == std::byte{0}) {
      return std::nullopt;
    }
  }
  return take_header(file, at);
}

/// Looks at the tables of chunk offsets, which end where the first chunk begins, and at the size of
/// the last chunk, which begins with its line, or with tile and level; in a file of several parts,
/// with the number of its part before. An offset of 0 is that of a chunk that was never written.
/// part: of the chunk; empty: it says so itself.
bool has_its_chunks(Span file, std::size_t table, std::optional<Part> part) noexcept {
  std::uint64_t first = file.size();
  std::uint64_t last = 0;
  for (std::size_t at = table; at < first; at += 8) {
    if (at + 8 > file.size()) {
      return false;
    }
    const std::uint64_t offset = u64_little(file, at);
    first = std::min(first, offset);
    last = std::max(last, offset);
  }
  if (first <= table || last > file.size() || file.size() - last < 4) {
    return false;
  }
  std::size_t at = static_cast<std::size_t>(last);
  if (!part) {
    part = part_of(file, u32_little(file, at));
    at += 4;
  }
  if (!part) {
    return false;
  }
  at += part->tile_width > 0 ? 16U : 4U;
  // Deep chunks begin with the sizes of their table of counts and of their values, and the size of
  // these before compression.
  const std::size_t head = part->is_deep ? 24 : 4;
  if (at > file.size() || head > file.size() - at) {
    return false;
  }
  const std::uint64_t left = file.size() - at - head;
  const std::uint64_t bytes = u32_little(file, at);
  return bytes <= left && (!part->is_deep || u32_little(file, at + 8) <= left - bytes);
}

}  // namespace

std::optional<ExrHeader> exr_header(Span file) noexcept {
  constexpr std::uint32_t kDeep = 0x800;
  constexpr std::uint32_t kMultiPart = 0x1000;
  if (file.size() < kVersionBytes) {
    return std::nullopt;
  }
  const bool multi_part = (u32_little(file, 4) & kMultiPart) != 0;
  std::optional<ExrHeader> header;
  std::size_t at = kVersionBytes;
  // A multi-part file ends its headers with an empty one.
  std::optional<Part> part;
  do {
    part = take_header(file, at);
    if (!part) {
      return std::nullopt;
    }
    header =
        header ? header
               : ExrHeader{.size = *part->size, .subsampled = {}, .compression = part->compression};
    header->subsampled = header->subsampled.empty() ? part->subsampled : header->subsampled;
    header->is_cube = header->is_cube || part->is_cube;
    header->primaries = header->primaries ? header->primaries : part->primaries;
  } while (multi_part && file[at] != std::byte{0});
  header->is_whole = multi_part
                         ? has_its_chunks(file, at + 1, std::nullopt)
                         : (u32_little(file, 4) & kDeep) != 0 || has_its_chunks(file, at, part);
  return header;
}

}  // namespace core
