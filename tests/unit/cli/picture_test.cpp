#include "clients/cli/picture.h"

#include <array>
#include <cstdlib>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <zlib.h>

#include "clients/cli/picture_screen.h"

namespace {

using cli::Picture;
using cli::Pixel;

constexpr Pixel kRed{255, 0, 0};
constexpr Pixel kGreen{0, 255, 0};
constexpr Pixel kBlue{0, 0, 255};
constexpr Pixel kGrey{10, 20, 30};

std::string big_endian(std::uint32_t value) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) {
    out += static_cast<char>(value >> static_cast<unsigned>(shift) & 255U);
  }
  return out;
}

/// A PNG of rows that start with the number of their filter.
std::string png(int width, int height, char colour, const std::string& rows) {
  uLongf size = compressBound(rows.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  packed.resize(size);
  const auto chunk = [](const std::string& kind, const std::string& data) {
    const std::string body = kind + data;
    return big_endian(static_cast<std::uint32_t>(data.size())) + body +
           big_endian(static_cast<std::uint32_t>(crc32(
               0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))));
  };
  const std::string header = big_endian(static_cast<std::uint32_t>(width)) +
                             big_endian(static_cast<std::uint32_t>(height)) + '\x08' + colour +
                             std::string(3, '\0');
  return std::string("\x89PNG\r\n\x1a\n", 8) + chunk("IHDR", header) +
         chunk("IDAT", packed.substr(0, size / 2)) + chunk("IDAT", packed.substr(size / 2)) +
         chunk("IEND", "");
}

TEST(DecodePng, ReadsEveryFilter) {
  // Each row is 10 20 30 | 40 50 60, written by the formulas of ISO/IEC 15948, 9.2.
  const std::string rows =
      std::string("\0\x0a\x14\x1e\x28\x32\x3c", 7) +  // none
      std::string("\1\x0a\x14\x1e\x1e\x1e\x1e", 7) +  // minus left
      std::string("\2\0\0\0\0\0\0", 7) +              // minus above
      std::string("\3\x05\x0a\x0f\x0f\x0f\x0f", 7) +  // minus the mean, rounded down
      std::string("\4\0\0\0\0\0\0", 7);               // minus the Paeth predictor: above
  const auto picture = cli::decode_png(png(2, 5, 2, rows));
  ASSERT_TRUE(picture) << picture.error().message;
  ASSERT_EQ(picture->height, 5);
  for (int y = 0; y < 5; ++y) {
    EXPECT_EQ(picture->at(0, y), (Pixel{10, 20, 30})) << y;
    EXPECT_EQ(picture->at(1, y), (Pixel{40, 50, 60})) << y;
  }
}

TEST(DecodePng, TransparentIsBlack) {
  const auto picture =
      cli::decode_png(png(2, 1, 6, std::string("\0\xff\xff\xff\0\xc8\x64\x32\xff", 9)));
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->at(0, 0), Pixel{});
  EXPECT_EQ(picture->at(1, 0), (Pixel{200, 100, 50}));
}

TEST(DecodePng, GreyHasThreeEqualChannels) {
  const auto picture = cli::decode_png(png(2, 1, 0, std::string("\0\x07\xc8", 3)));
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->pixels, (std::vector<Pixel>{Pixel{7, 7, 7}, Pixel{200, 200, 200}}));
}

TEST(DecodePng, RefusesMorePixelsThanAFilmMayHave) {
  for (const auto& [width, height] : {std::pair{8193, 8192}, {999999, 999999}, {1, 0x7fffffff}}) {
    const auto picture = cli::decode_png(png(width, height, 2, std::string(7, '\0')));
    EXPECT_FALSE(picture) << width << " x " << height;
  }
  EXPECT_EQ(cli::decode_png(png(8193, 8192, 2, std::string(7, '\0'))).error().code,
            core::ErrorCode::kTooLarge);
}

TEST(DecodePng, RefusesTruncatedAndBrokenFiles) {
  const std::string whole = png(2, 1, 2, std::string(7, '\0'));
  ASSERT_TRUE(cli::decode_png(whole));
  for (std::size_t size = 0; size < whole.size() - 12; ++size) {
    EXPECT_FALSE(cli::decode_png(whole.substr(0, size))) << size;
  }
  std::string other_sum = whole;
  other_sum[other_sum.size() - 13] ^= 1;  // of the last piece of data
  EXPECT_FALSE(cli::decode_png(other_sum));
  EXPECT_EQ(cli::decode_png("GIF89a and more").error().code, core::ErrorCode::kUnsupportedFormat);
  EXPECT_EQ(cli::decode_png(whole.substr(0, 40)).error().code, core::ErrorCode::kInvalidArgument);
  EXPECT_FALSE(cli::decode_png(png(2, 1, 2, std::string("\5\0\0\0\0\0\0", 7))));
  EXPECT_FALSE(cli::decode_png(png(2, 2, 2, std::string(7, '\0'))));
}

TEST(Enlarged, RepeatsEachPixel) {
  const Picture small{2, 1, {kRed, kBlue}};
  EXPECT_EQ(cli::enlarged(small, 4, 2).pixels,
            (std::vector<Pixel>{kRed, kRed, kBlue, kBlue, kRed, kRed, kBlue, kBlue}));
}

TEST(DrawBlocks, UpperPixelsAreTheForegroundAndLowerOnesTheBackground) {
  const Picture picture{2, 2, {kRed, kGreen, kBlue, kGrey}};
  EXPECT_EQ(cli::draw_blocks(picture),
            "\x1b[38;2;255;0;0m\x1b[48;2;0;0;255m\u2580"
            "\x1b[38;2;0;255;0m\x1b[48;2;10;20;30m\u2580\x1b[0m\n");
}

TEST(DrawBlocks, RepeatsNoColorAndALastHalfRowHasNoBackground) {
  const Picture picture{2, 3, {kRed, kRed, kRed, kRed, kBlue, kBlue}};
  EXPECT_EQ(cli::draw_blocks(picture),
            "\x1b[38;2;255;0;0m\x1b[48;2;255;0;0m\u2580\u2580\x1b[0m\n"
            "\x1b[38;2;0;0;255m\u2580\u2580\x1b[0m\n");
}

/// Reads sixel data as specified in the manual of the VT340: colours in percent, runs, $ and -.
class SixelReader {
 public:
  explicit SixelReader(const std::string& text) : text_(text) {}

  /// Percentages of red, green, blue for every pixel that was set; counts those that were set
  /// twice.
  std::map<std::pair<int, int>, std::array<int, 3>> pixels;
  int set_twice = 0;
  std::vector<int> raster;

  bool read() {
    if (text_.rfind("\x1bP0;1q", 0) != 0 || text_.substr(text_.size() - 2) != "\x1b\\") {
      return false;
    }
    for (at_ = 6; at_ < text_.size() - 2;) {
      const char c = text_[at_++];
      if (c == '"') {
        raster = numbers();
      } else if (c == '#') {
        const auto told = numbers();
        if (told.size() == 5) {
          palette_[told[0]] = {told[2], told[3], told[4]};
        }
        colour_ = told[0];
      } else if (c == '!') {
        const int count = numbers()[0];
        put(text_[at_++], count);
      } else if (c == '$') {
        x_ = 0;
      } else if (c == '-') {
        x_ = 0;
        top_ += 6;
      } else if (c >= '?' && c <= '~') {
        put(c, 1);
      } else {
        return false;
      }
    }
    return true;
  }

 private:
  std::vector<int> numbers() {
    std::vector<int> out;
    while (true) {
      char* end = nullptr;
      out.push_back(static_cast<int>(std::strtol(text_.c_str() + at_, &end, 10)));
      at_ = static_cast<std::size_t>(end - text_.c_str());
      if (text_[at_] != ';') {
        return out;
      }
      ++at_;
    }
  }
  void put(char c, int count) {
    for (int i = 0; i < count; ++i, ++x_) {
      for (int bit = 0; bit < 6; ++bit) {
        if (((c - '?') >> bit & 1) != 0) {
          set_twice += pixels.count({x_, top_ + bit}) > 0 ? 1 : 0;
          pixels[{x_, top_ + bit}] = palette_.at(colour_);
        }
      }
    }
  }

  std::string text_;
  std::size_t at_ = 0;
  std::map<int, std::array<int, 3>> palette_;
  int colour_ = 0;
  int x_ = 0;
  int top_ = 0;
};

TEST(DrawSixel, PureColorsRoundTrip) {
  Picture picture{7, 13, {}};
  const std::array<Pixel, 5> colours = {kRed, kGreen, kBlue, Pixel{255, 255, 255}, Pixel{}};
  for (std::size_t i = 0; i < 7 * 13; ++i) {
    picture.pixels.push_back(colours[i * i % colours.size()]);
  }
  SixelReader reader(cli::draw_sixel(picture));
  ASSERT_TRUE(reader.read());
  EXPECT_EQ(reader.raster, (std::vector<int>{1, 1, 7, 13}));
  EXPECT_EQ(reader.set_twice, 0);
  ASSERT_EQ(reader.pixels.size(), picture.pixels.size());
  for (const auto& [place, percent] : reader.pixels) {
    const Pixel& pixel = picture.at(place.first, place.second);
    EXPECT_EQ(percent,
              (std::array<int, 3>{pixel.r * 100 / 255, pixel.g * 100 / 255, pixel.b * 100 / 255}));
  }
}

TEST(DrawSixel, DitheringKeepsTheMeanOfAFlatArea) {
  // Over the 16 positions of the matrix the error of a channel is at most half of 1/16 of a step of
  // its levels (5 steps of red and blue, 6 of green), and percentages are rounded by at most 0.5.
  for (const int value : {1, 37, 64, 100, 128, 200, 254}) {
    const auto v = static_cast<std::uint8_t>(value);
    SixelReader reader(cli::draw_sixel({16, 16, std::vector<Pixel>(256, Pixel{v, v, v})}));
    ASSERT_TRUE(reader.read());
    ASSERT_EQ(reader.pixels.size(), 256U);
    std::array<double, 3> sum{};
    for (const auto& [place, percent] : reader.pixels) {
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += percent[c] / 256.0;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(sum[c], value / 2.55, 100.0 / 5 / 32 + 0.5) << value;
    }
  }
}

TEST(DrawSixel, WritesALongRunAsANumber) {
  const std::string text = cli::draw_sixel({300, 1, std::vector<Pixel>(300, kRed)});
  EXPECT_NE(text.find("!300@"), std::string::npos) << text;
  EXPECT_LT(text.size(), 60U);
}

std::string decoded_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') {
      break;
    }
    bits = bits << 6U | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      out += static_cast<char>(bits >> static_cast<unsigned>(count) & 255U);
    }
  }
  return out;
}

struct KittyPiece {
  std::string keys;
  std::string payload;
};

std::vector<KittyPiece> kitty_pieces(const std::string& text) {
  std::vector<KittyPiece> out;
  for (std::size_t at = 0; at < text.size();) {
    EXPECT_EQ(text.substr(at, 3), "\x1b_G");
    const std::size_t end = text.find("\x1b\\", at);
    const std::string body = text.substr(at + 3, end - at - 3);
    out.push_back({body.substr(0, body.find(';')), body.substr(body.find(';') + 1)});
    at = end + 2;
  }
  return out;
}

TEST(DrawKitty, ChunksOf4096BytesFormTheImage) {
  for (const std::size_t size : {1U, 2U, 3U, 3071U, 3072U, 3073U, 10000U}) {
    std::string png_bytes;
    for (std::size_t i = 0; i < size; ++i) {
      png_bytes += static_cast<char>(i * 31 % 256);
    }
    const auto pieces = kitty_pieces(cli::draw_kitty(png_bytes, {40, 12, 7, true}));
    std::string payload;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const bool last = i + 1 == pieces.size();
      EXPECT_EQ(pieces[i].keys, (i == 0 ? "a=T,f=100,q=2,i=7,c=40,r=12,C=1,m=" : "m=") +
                                    std::string(last ? "0" : "1"));
      EXPECT_TRUE(last ? pieces[i].payload.size() <= 4096 : pieces[i].payload.size() == 4096);
      payload += pieces[i].payload;
    }
    EXPECT_EQ(pieces.size(), ((size + 2) / 3 * 4 + 4095) / 4096) << size;
    EXPECT_EQ(decoded_base64(payload), png_bytes) << size;
  }
}

TEST(DrawKitty, Base64MatchesTheStandard) {  // RFC 4648, section 10
  const auto payload = [](const char* text) {
    return kitty_pieces(cli::draw_kitty(text, {})).at(0).payload;
  };
  EXPECT_EQ(payload("f"), "Zg==");
  EXPECT_EQ(payload("fo"), "Zm8=");
  EXPECT_EQ(payload("foo"), "Zm9v");
  EXPECT_EQ(payload("foobar"), "Zm9vYmFy");
}

cli::PictureWay automatic(const std::map<std::string, const char*>& variables) {
  return *cli::choose_picture_way("auto", [&](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second;
  });
}

TEST(ChoosePictureWay, AutoIsKittyOnlyIfTheTerminalSupportsIt) {
  EXPECT_EQ(automatic({}), cli::PictureWay::kBlocks);
  EXPECT_EQ(automatic({{"TERM", "xterm-256color"}}), cli::PictureWay::kBlocks);
  EXPECT_EQ(automatic({{"TERM", "xterm-kitty"}}), cli::PictureWay::kKitty);
  EXPECT_EQ(automatic({{"TERM", "xterm-256color"}, {"KITTY_WINDOW_ID", "1"}}),
            cli::PictureWay::kKitty);
  EXPECT_EQ(automatic({{"TERM_PROGRAM", "ghostty"}}), cli::PictureWay::kKitty);
  EXPECT_EQ(automatic({{"TERM", "tmux-256color"}, {"KITTY_WINDOW_ID", "1"}}),
            cli::PictureWay::kBlocks);
  EXPECT_EQ(automatic({{"TERM", "xterm-kitty"}, {"TMUX", "/tmp/x"}}), cli::PictureWay::kBlocks);
  EXPECT_FALSE(
      cli::choose_picture_way("ascii", [](const char*) -> const char* { return nullptr; }));
}

TEST(PlanPicture, FitsTheTerminalAndKeepsTheAspect) {
  for (const cli::Extent film :
       {cli::Extent{1920, 1080}, {1080, 1920}, {48, 32}, {4000, 3}, {3, 4000}, {1, 1}}) {
    for (const cli::TerminalSize size :
         {cli::TerminalSize{80, 24, 0, 0}, {200, 60, 1800, 1200}, {3, 3, 0, 0}}) {
      for (const auto way :
           {cli::PictureWay::kBlocks, cli::PictureWay::kSixel, cli::PictureWay::kKitty}) {
        const auto plan = cli::plan_picture(way, film, size);
        EXPECT_TRUE(plan.columns >= 1 && plan.columns <= size.columns);
        EXPECT_TRUE(plan.rows >= 1 && plan.rows <= std::max(1, size.rows - 2));
        EXPECT_LE(plan.side_max, std::max(film.width, film.height));
        // A side is rounded to whole pixels: by at most a half.
        const double long_side = std::max(plan.drawn.width, plan.drawn.height);
        const double ratio = (film.width > film.height ? plan.drawn.width * 1.0 / film.width
                                                       : plan.drawn.height * 1.0 / film.height);
        EXPECT_NEAR(plan.drawn.width, std::max(1.0, film.width * ratio), 0.51) << long_side;
        EXPECT_NEAR(plan.drawn.height, std::max(1.0, film.height * ratio), 0.51) << long_side;
      }
    }
  }
}

TEST(PlanPicture, UsesTheFullWidthIfTheHeightAllows) {
  const auto blocks = cli::plan_picture(cli::PictureWay::kBlocks, {1600, 800}, {80, 50, 0, 0});
  EXPECT_EQ(blocks.columns, 80);
  EXPECT_EQ(blocks.rows, 20);
  EXPECT_EQ(blocks.side_max, 80);
  const auto kitty = cli::plan_picture(cli::PictureWay::kKitty, {1600, 800}, {80, 50, 800, 1000});
  EXPECT_EQ(kitty.columns, 80);
  EXPECT_EQ(kitty.rows, 20);
  EXPECT_EQ(kitty.side_max, 800);
}

}  // namespace
