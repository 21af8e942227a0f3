// PNG (ISO/IEC 15948): chunks, one zlib stream, a filter per row.
#include <zlib.h>

#include <algorithm>
#include <cstdlib>

#include "clients/cli/picture.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::uint32_t kSideMax = 1U << 14U;

Error broken(const char* why) {
  return Error{ErrorCode::kInvalidArgument, std::string("the PNG is broken: ") + why, ""};
}

std::uint8_t byte_at(std::string_view bytes, std::size_t at) { return static_cast<std::uint8_t>(bytes[at]); }

std::uint32_t big_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = value << 8U | byte_at(bytes, at + i);
  }
  return value;
}

struct Chunks {
  std::string_view header;
  std::string packed;
};

core::Result<Chunks> read_chunks(std::string_view bytes) {
  if (!bytes.starts_with(kSignature)) {
    return Error{ErrorCode::kUnsupportedMedia, "the picture is no PNG", ""};
  }
  Chunks chunks;
  for (std::size_t at = kSignature.size(); at + 12 <= bytes.size();) {
    const std::size_t size = big_endian(bytes, at);
    if (size > bytes.size() - at - 12) {
      return broken("a chunk is cut");
    }
    const std::string_view kind = bytes.substr(at + 4, 4);
    const std::string_view data = bytes.substr(at + 8, size);
    if (kind == "IHDR") {
      chunks.header = data;
    } else if (kind == "IDAT") {
      chunks.packed += data;
    }
    at += 12 + size;
  }
  if (chunks.header.size() != 13) {
    return broken("no header");
  }
  return chunks;
}

int paeth(int left, int above, int corner) {
  const int guess = left + above - corner;
  const int to_left = std::abs(guess - left);
  const int to_above = std::abs(guess - above);
  const int to_corner = std::abs(guess - corner);
  if (to_left <= to_above && to_left <= to_corner) {
    return left;
  }
  return to_above <= to_corner ? above : corner;
}

/// One row in place; above: the row before it, zeros for the first.
bool unfilter(int kind, const std::uint8_t* above, std::uint8_t* row, std::size_t size, std::size_t step) {
  for (std::size_t i = 0; i < size; ++i) {
    const int left = i >= step ? row[i - step] : 0;
    const int corner = i >= step ? above[i - step] : 0;
    int add = 0;
    switch (kind) {
      case 0:
        break;
      case 1:
        add = left;
        break;
      case 2:
        add = above[i];
        break;
      case 3:
        add = (left + above[i]) / 2;
        break;
      case 4:
        add = paeth(left, above[i], corner);
        break;
      default:
        return false;
    }
    row[i] = static_cast<std::uint8_t>(row[i] + add);
  }
  return true;
}

std::uint8_t over_black(std::uint8_t value, std::uint8_t alpha) {
  return static_cast<std::uint8_t>((value * alpha + 127) / 255);
}

}  // namespace

core::Result<Picture> decode_png(std::string_view bytes) {
  const auto chunks = read_chunks(bytes);
  if (!chunks) {
    return chunks.error();
  }
  const std::uint32_t width = big_endian(chunks->header, 0);
  const std::uint32_t height = big_endian(chunks->header, 4);
  const std::string_view kind = chunks->header.substr(8);  // depth, colour, compression, filter, interlace
  const std::size_t step = kind[1] == 6 ? 4 : 3;
  if (kind[0] != 8 || (kind[1] != 2 && kind[1] != 6) || kind[4] != 0) {
    return Error{ErrorCode::kUnsupportedMedia, "only PNGs of 8-bit RGB or RGBA can be drawn", ""};
  }
  if (width == 0 || height == 0 || width > kSideMax || height > kSideMax) {
    return broken("its size");
  }
  const std::size_t row_bytes = width * step;
  std::vector<std::uint8_t> raw((row_bytes + 1) * height);
  uLongf unpacked = raw.size();
  if (uncompress(raw.data(), &unpacked, reinterpret_cast<const Bytef*>(chunks->packed.data()),
                 chunks->packed.size()) != Z_OK ||
      unpacked != raw.size()) {
    return broken("its data");
  }
  Picture picture{static_cast<int>(width), static_cast<int>(height), {}};
  picture.pixels.reserve(std::size_t{width} * height);
  const std::vector<std::uint8_t> zeros(row_bytes);
  const std::uint8_t* above = zeros.data();
  for (std::uint32_t y = 0; y < height; ++y) {
    std::uint8_t* row = raw.data() + y * (row_bytes + 1);
    if (!unfilter(row[0], above, row + 1, row_bytes, step)) {
      return broken("a filter that there is not");
    }
    above = ++row;
    for (std::size_t x = 0; x < row_bytes; x += step) {
      const std::uint8_t alpha = step == 4 ? row[x + 3] : std::uint8_t{255};
      picture.pixels.push_back(
          {over_black(row[x], alpha), over_black(row[x + 1], alpha), over_black(row[x + 2], alpha)});
    }
  }
  return picture;
}

}  // namespace cli
