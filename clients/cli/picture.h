/// Small images in the client: decoding, enlarging, drawing as text on terminals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace cli {

struct Pixel {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;

  bool operator==(const Pixel&) const = default;
};

/// Encoded sRGB, row by row from the top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Pixel> pixels;

  const Pixel& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

/// Decodes any PNG to 8-bit sRGB over black. Errors: kUnsupportedMedia if it is not a PNG,
/// kTooLarge above 64 Mi pixels (checked before memory is allocated), kInvalidArgument for a
/// damaged file.
core::Result<Picture> decode_png(std::string_view bytes);

/// Returns an enlarged image; each pixel is the one of `picture` under its centre. width, height:
/// at least 1.
Picture enlarged(const Picture& picture, int width, int height);

/// Draws upper half blocks in 24-bit colour: a character covers one pixel by two. Every row of
/// characters resets the colours and ends with a line feed.
std::string draw_blocks(const Picture& picture);

/// Draws DEC sixel graphics (VT330/VT340 programmer reference, chapter 14), 252 colours, with
/// ordered dithering.
std::string draw_sixel(const Picture& picture);

struct KittyPlace {
  int columns = 1;
  int rows = 1;
  std::uint32_t id = 1;
  bool keep_cursor = true;  ///< otherwise it moves behind the image
};

/// Shows a PNG at the cursor, scaled to the cells (kitty graphics protocol: base64 in chunks of at
/// most 4096 bytes). Tells the terminal not to reply.
std::string draw_kitty(std::string_view png, const KittyPlace& place);
/// Removes the image from the screen and from the terminal's memory.
std::string drop_kitty(std::uint32_t id);

}  // namespace cli
