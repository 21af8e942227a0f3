#include "clients/cli/picture.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "core/base/base64.h"

namespace cli {
namespace {

constexpr std::size_t kKittyChunk = 4096;

std::string rgb_text(Pixel pixel) {
  return std::to_string(pixel.r) + ";" + std::to_string(pixel.g) + ";" + std::to_string(pixel.b);
}

// Colours of a sixel image: a grid of 6 x 7 x 6, finest in green, to which the eye is most
// sensitive.
constexpr std::array<int, 3> kLevels = {6, 7, 6};
constexpr std::size_t kColours = std::size_t{6} * 7 * 6;

/// Bayer's matrix of 4 x 4: thresholds (2 n + 1) / 32.
constexpr std::array<int, 16> kBayer = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};

/// Returns the level of a value: one that is n/16 above a level is rounded up in n of the 16 cells.
int level_of(int value, int levels, int threshold) {
  const int scaled = value * (levels - 1) * 32;  // in 1/32 of a step, times 255
  return std::min(levels - 1, (scaled + (31 - (2 * threshold)) * 255) / (32 * 255));
}

int colour_at(const Picture& picture, int x, int y) {
  const Pixel& pixel = picture.at(x, y);
  const int threshold = kBayer[static_cast<std::size_t>((y % 4) * 4 + (x % 4))];
  const int r = level_of(pixel.r, kLevels[0], threshold);
  const int g = level_of(pixel.g, kLevels[1], threshold);
  const int b = level_of(pixel.b, kLevels[2], threshold);
  return (r * kLevels[1] + g) * kLevels[2] + b;
}

/// Returns "#n;2;r;g;b" in per cent.
std::string sixel_colour(int colour) {
  const auto percent = [](int level, int levels) {
    return std::to_string((level * 100 + (levels - 1) / 2) / (levels - 1));
  };
  return "#" + std::to_string(colour) + ";2;" +
         percent(colour / (kLevels[1] * kLevels[2]), kLevels[0]) + ";" +
         percent(colour / kLevels[2] % kLevels[1], kLevels[1]) + ";" +
         percent(colour % kLevels[2], kLevels[2]);
}

void add_run(std::string& out, char sixel, int count) {
  if (count > 3) {
    out += "!" + std::to_string(count) + sixel;
  } else {
    out.append(static_cast<std::size_t>(count), sixel);
  }
}

/// Draws up to six rows of pixels, one pass per colour.
std::string sixel_band(const std::vector<int>& colours, int width, int rows) {
  std::array<bool, kColours> used{};
  for (const int colour : colours) {
    used[static_cast<std::size_t>(colour)] = true;
  }
  std::string out;
  for (std::size_t colour = 0; colour < kColours; ++colour) {
    if (!used[colour]) {
      continue;
    }
    out += (out.empty() ? "#" : "$#") + std::to_string(colour);
    char pending = 0;
    int count = 0;
    for (int x = 0; x < width; ++x) {
      unsigned bits = 0;
      for (int y = 0; y < rows; ++y) {
        const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                        static_cast<std::size_t>(x);
        const bool on = colours[at] == static_cast<int>(colour);
        bits |= (on ? 1U : 0U) << static_cast<unsigned>(y);
      }
      const char sixel = static_cast<char>('?' + bits);
      if (sixel != pending) {
        add_run(out, pending, count);
        pending = sixel;
        count = 0;
      }
      ++count;
    }
    if (pending != '?') {
      add_run(out, pending, count);
    }
  }
  return out;
}

}  // namespace

Picture enlarged(const Picture& picture, int width, int height) {
  Picture out{width, height, {}};
  out.pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      out.pixels.push_back(picture.at((2 * x + 1) * picture.width / (2 * width),
                                      (2 * y + 1) * picture.height / (2 * height)));
    }
  }
  return out;
}

std::string draw_blocks(const Picture& picture) {
  std::string out;
  for (int y = 0; y < picture.height; y += 2) {
    std::optional<Pixel> front;
    std::optional<Pixel> back;
    for (int x = 0; x < picture.width; ++x) {
      if (const Pixel& upper = picture.at(x, y); upper != front) {
        out += "\x1b[38;2;" + rgb_text(upper) + "m";
        front = upper;
      }
      if (y + 1 < picture.height && picture.at(x, y + 1) != back) {
        back = picture.at(x, y + 1);
        out += "\x1b[48;2;" + rgb_text(*back) + "m";
      }
      out += "\u2580";
    }
    out += "\x1b[0m\n";
  }
  return out;
}

std::string draw_sixel(const Picture& picture) {
  std::array<bool, kColours> told{};
  std::string palette;
  std::string bands;
  std::vector<int> colours;
  for (int top = 0; top < picture.height; top += 6) {
    const int rows = std::min(6, picture.height - top);
    colours.clear();
    for (int y = top; y < top + rows; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const int colour = colour_at(picture, x, y);
        colours.push_back(colour);
        if (!told[static_cast<std::size_t>(colour)]) {
          told[static_cast<std::size_t>(colour)] = true;
          palette += sixel_colour(colour);
        }
      }
    }
    bands += (bands.empty() ? "" : "-") + sixel_band(colours, picture.width, rows);
  }
  return "\x1bP0;1q\"1;1;" + std::to_string(picture.width) + ";" + std::to_string(picture.height) +
         palette + bands + "\x1b\\";
}

std::string draw_kitty(std::string_view png, const KittyPlace& place) {
  const std::string text = core::encode_base64(std::as_bytes(std::span(png)));
  std::string out;
  for (std::size_t at = 0; at == 0 || at < text.size(); at += kKittyChunk) {
    out += "\x1b_G";
    if (at == 0) {
      out += "a=T,f=100,q=2,i=" + std::to_string(place.id) + ",c=" + std::to_string(place.columns) +
             ",r=" + std::to_string(place.rows) + (place.keep_cursor ? ",C=1," : ",");
    }
    out += at + kKittyChunk < text.size() ? "m=1;" : "m=0;";
    out += text.substr(at, kKittyChunk) + "\x1b\\";
  }
  return out;
}

std::string drop_kitty(std::uint32_t id) {
  return "\x1b_Ga=d,d=I,q=2,i=" + std::to_string(id) + "\x1b\\";
}

}  // namespace cli
