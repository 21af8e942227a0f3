/// Small pictures in the client: decoded, enlarged, drawn as text for terminals.
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

/// Encoded sRGB as it is shown; row by row from the top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Pixel> pixels;

  const Pixel& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

/// Any PNG, as 8-bit sRGB over black.
/// Errors: kUnsupportedMedia for what is no PNG, kTooLarge above 64 Mi pixels (told before memory
/// is taken), kInvalidArgument for a broken file.
core::Result<Picture> decode_png(std::string_view bytes);

/// Each pixel of the answer is the one of `picture` under its middle. width, height: at least 1.
Picture enlarged(const Picture& picture, int width, int height);

/// Upper half blocks in 24-bit colour: one character is one pixel wide and two high. Every row of
/// characters resets the colours and ends with a line feed.
std::string draw_blocks(const Picture& picture);

/// DEC sixel graphics (VT330/VT340 programmer reference, chapter 14), 252 colours, ordered
/// dithering.
std::string draw_sixel(const Picture& picture);

struct KittyPlace {
  int columns = 1;
  int rows = 1;
  std::uint32_t id = 1;
  bool keep_cursor = true;  ///< else it goes behind the picture
};

/// Shows a PNG at the cursor, stretched over the cells (kitty graphics protocol: base64 in chunks
/// of at most 4096 bytes). The terminal is asked to answer nothing.
std::string draw_kitty(std::string_view png, const KittyPlace& place);
/// Takes the picture off the screen and out of the terminal's memory.
std::string drop_kitty(std::uint32_t id);

}  // namespace cli
