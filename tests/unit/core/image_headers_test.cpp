// What the headers of image files say about their pixels: alpha, windows, layers, orientation.
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <webp/encode.h>

#include "core/image_io/exr_layers.h"
#include "core/image_io/image_io.h"
#include "core/image_io/radiance.h"

namespace {

std::span<const std::byte> bytes_of(const std::string& file) {
  return std::as_bytes(std::span(file.data(), file.size()));
}

core::Image decoded(const std::string& file) {
  auto image = core::decode_image(bytes_of(file), {});
  EXPECT_TRUE(image.has_value()) << (image ? "" : image.error().message);
  const auto header = core::read_image_header(bytes_of(file));
  EXPECT_TRUE(header.has_value()) << (header ? "" : header.error().message);
  if (!image || !header) {
    return {};
  }
  EXPECT_EQ(header->width, image->width);
  EXPECT_EQ(header->height, image->height);
  EXPECT_EQ(header->channels, image->channels);
  return *image;
}

std::vector<float> floats_of(const core::Image& image) {
  std::vector<float> values;
  for (std::size_t i = 0; i < image.value_count(); ++i) {
    values.push_back(core::stored_value(image, i));
  }
  return values;
}

std::string u16(std::uint32_t v) {
  return {static_cast<char>(v & 255U), static_cast<char>(v >> 8U & 255U)};
}
std::string u32(std::uint32_t v) { return u16(v) + u16(v >> 16U); }

// WebP.

using Pixels = std::vector<std::uint8_t>;

/// Colours under alpha 0 are kept: `exact`.
std::string webp(const Pixels& rgba, int width, int height, bool lossless) {
  WebPConfig config;
  WebPPicture picture;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  EXPECT_TRUE(WebPConfigInit(&config) != 0 && WebPPictureInit(&picture) != 0);
  config.lossless = lossless ? 1 : 0;
  config.exact = 1;
  config.quality = 100;
  picture.use_argb = 1;
  picture.width = width;
  picture.height = height;
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  EXPECT_NE(WebPPictureImportRGBA(&picture, rgba.data(), 4 * width), 0);
  EXPECT_NE(WebPEncode(&config, &picture), 0);
  WebPPictureFree(&picture);
  std::string file(reinterpret_cast<const char*>(writer.mem), writer.size);
  WebPMemoryWriterClear(&writer);
  return file;
}

/// Red at half alpha, green, blue at alpha 0, white at a quarter.
const Pixels kFour = {255, 0, 0, 128, 0, 255, 0, 255, 0, 0, 255, 0, 255, 255, 255, 64};

TEST(WebpHeader, LosslessColorIsNotMultipliedByAlpha) {
  const core::Image image = decoded(webp(kFour, 2, 2, true));
  ASSERT_EQ(image.channels, 4);
  for (std::size_t i = 0; i < kFour.size(); ++i) {
    EXPECT_EQ(std::to_integer<int>(image.bytes[i]), kFour[i]) << i;
  }
}

TEST(WebpHeader, LossyColorIsNotMultipliedByAlpha) {
  Pixels flat;
  for (int i = 0; i < 16 * 16; ++i) {
    flat.insert(flat.end(), {200, 100, 50, i < 128 ? std::uint8_t{0} : std::uint8_t{90}});
  }
  const core::Image image = decoded(webp(flat, 16, 16, false));
  ASSERT_EQ(image.channels, 4);
  for (const std::size_t pixel : {3U, 200U}) {
    // YUV of 8 bits: each of the three is rounded, and weighs up to 2 in a channel.
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(std::to_integer<int>(image.bytes[pixel * 4 + c]), flat[c], 4) << pixel;
    }
    EXPECT_EQ(std::to_integer<int>(image.bytes[pixel * 4 + 3]), flat[pixel * 4 + 3]);
  }
}

TEST(WebpHeader, AnimationsShowTheirFirstFrameInItsPlace) {
  const std::string still = webp({10, 20, 30, 40}, 1, 1, true);
  const std::string bitstream = still.substr(12);  // behind RIFF, the size and WEBP
  const auto chunk = [](const std::string& name, const std::string& content) {
    return name + u32(static_cast<std::uint32_t>(content.size())) + content;
  };
  const auto u24 = [](std::uint32_t v) { return u32(v).substr(0, 3); };
  // A canvas of 3 x 3; the frame at (2, 2), in units of two pixels.
  const std::string frame =
      u24(1) + u24(1) + u24(0) + u24(0) + u24(100) + std::string(1, '\0') + bitstream;
  const std::string content =
      "WEBP" + chunk("VP8X", std::string("\x12\0\0\0", 4) + u24(2) + u24(2)) +
      chunk("ANIM", u32(0) + u16(0)) + chunk("ANMF", frame) + chunk("ANMF", frame);
  const core::Image image = decoded(chunk("RIFF", content));
  ASSERT_EQ(image.width, 3);
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(std::to_integer<int>(image.bytes[0]), 0);
  const std::size_t last = (2 * 3 + 2) * 4;
  const Pixels expected = {10, 20, 30, 40};
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_EQ(std::to_integer<int>(image.bytes[last + c]), expected[c]);
  }
}

std::string from_hex(std::string_view hex) {
  std::string out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    out += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  }
  return out;
}

// One pixel, 255 128 64 at alpha 0.
TEST(PngHeader, ColorIsNotMultipliedByAlpha) {
  const core::Image image = decoded(from_hex(
      "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c63"
      "f8dfe0c00000060101c023dde0c20000000049454e44ae426082"));
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(std::to_integer<int>(image.bytes[0]), 255);
  EXPECT_EQ(std::to_integer<int>(image.bytes[1]), 128);
  EXPECT_EQ(std::to_integer<int>(image.bytes[3]), 0);
}

TEST(TiffHeader, UnassociatedColorIsNotMultipliedByAlpha) {
  // ExtraSamples 2: unassociated alpha.
  const core::Image image = decoded(from_hex(
      "49492a00080000000b0000010400010000000100000001010400010000000100000002010300040000009200"
      "000003010300010000000100000006010300010000000200000011010400010000009a000000150103000100"
      "0000040000001601040001000000010000001701040001000000040000001c01030001000000010000005201"
      "03000100000002000000000000000800080008000800ff804000"));
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(std::to_integer<int>(image.bytes[0]), 255);
  EXPECT_EQ(std::to_integer<int>(image.bytes[1]), 128);
  EXPECT_EQ(std::to_integer<int>(image.bytes[3]), 0);
}

TEST(TiffHeader, AssociatedColorIsDividedByAlpha) {
  // ExtraSamples 1; 64 32 16 at alpha 128.
  const core::Image image = decoded(from_hex(
      "49492a00080000000b0000010400010000000100000001010400010000000100000002010300040000009200"
      "000003010300010000000100000006010300010000000200000011010400010000009a000000150103000100"
      "0000040000001601040001000000010000001701040001000000040000001c01030001000000010000005201"
      "0300010000000100000000000000080008000800080040201080"));
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(std::to_integer<int>(image.bytes[0]), 128);
  EXPECT_EQ(std::to_integer<int>(image.bytes[1]), 64);
  EXPECT_EQ(std::to_integer<int>(image.bytes[2]), 32);
  EXPECT_EQ(std::to_integer<int>(image.bytes[3]), 128);
}

TEST(TiffHeader, GreyMayCountFromWhite) {
  for (const std::uint32_t bits : {8U, 16U}) {
    std::string file = "II*" + std::string(1, '\0') + u32(8) + u16(9);
    // Width, height, bits, compression, WhiteIsZero, offset, samples, rows and bytes of the strip.
    const std::uint32_t entries[][2] = {{256, 1},   {257, 1}, {258, bits}, {259, 1},       {262, 0},
                                        {273, 122}, {277, 1}, {278, 1},    {279, bits / 8}};
    for (const auto& [tag, value] : entries) {
      file += u16(tag) + u16(4) + u32(1) + u32(value);
    }
    file += u32(0) + (bits == 8 ? std::string("\x40") : u16(0x4000));
    const std::vector<float> values = floats_of(decoded(file));
    ASSERT_EQ(values.size(), 1U);
    EXPECT_EQ(values[0], bits == 8 ? 191.0F / 255 : 49151.0F / 65535);
  }
}

// OpenEXR: "OpenEXR File Layout", openexr.com; uncompressed, floats, lines from the top.

struct Box {
  int x0, y0, x1, y1;
};
struct ExrPartFile {
  std::string name;
  std::vector<std::string> channels;  ///< in alphabetical order
  Box data;
  Box display;
};

/// value(channel, x, y), x and y of the data window.
template <typename Value>
std::string exr(const std::vector<ExrPartFile>& parts, const Value& value) {
  const bool multi = parts.size() > 1;
  const auto attribute = [](const std::string& name, const std::string& type,
                            const std::string& content) {
    return name + '\0' + type + '\0' + u32(static_cast<std::uint32_t>(content.size())) + content;
  };
  const auto box = [](const Box& b) {
    std::string text;
    for (const int v : {b.x0, b.y0, b.x1, b.y1}) {
      text += u32(static_cast<std::uint32_t>(v));
    }
    return text;
  };
  const auto number = [](float v) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    return u32(bits);
  };
  std::string head = std::string("\x76\x2f\x31\x01", 4) + u32(multi ? 0x1002 : 2);
  std::size_t lines = 0;
  for (const ExrPartFile& part : parts) {
    std::string list;
    for (const std::string& channel : part.channels) {
      list += channel + '\0' + u32(2) + u32(0) + u32(1) + u32(1);
    }
    head += attribute("channels", "chlist", list + '\0');
    head += attribute("compression", "compression", std::string(1, '\0'));
    head += attribute("dataWindow", "box2i", box(part.data));
    head += attribute("displayWindow", "box2i", box(part.display));
    head += attribute("lineOrder", "lineOrder", std::string(1, '\0'));
    head += attribute("pixelAspectRatio", "float", number(1));
    head += attribute("screenWindowCenter", "v2f", number(0) + number(0));
    head += attribute("screenWindowWidth", "float", number(1));
    const int height = part.data.y1 - part.data.y0 + 1;
    if (multi) {
      head += attribute("name", "string", part.name);
      head += attribute("type", "string", "scanlineimage");
      head += attribute("chunkCount", "int", u32(static_cast<std::uint32_t>(height)));
    }
    head += '\0';
    lines += static_cast<std::size_t>(height);
  }
  head += multi ? std::string(1, '\0') : "";
  std::string table;
  std::string content;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const ExrPartFile& part = parts[p];
    for (int y = part.data.y0; y <= part.data.y1; ++y) {
      const auto at = static_cast<std::uint32_t>(head.size() + lines * 8 + content.size());
      table += u32(at) + u32(0);
      std::string row;
      for (const std::string& channel : part.channels) {
        for (int x = part.data.x0; x <= part.data.x1; ++x) {
          row += number(value(channel, x, y));
        }
      }
      content += (multi ? u32(static_cast<std::uint32_t>(p)) : "") +
                 u32(static_cast<std::uint32_t>(y)) + u32(static_cast<std::uint32_t>(row.size())) +
                 row;
    }
  }
  return head + table + content;
}

float constant(const std::string& channel) {
  return channel.ends_with("R") || channel.ends_with("red") || channel.ends_with("Y") ? 1.0F
         : channel.ends_with("G") || channel.ends_with("green")                       ? 2.0F
         : channel.ends_with("B") || channel.ends_with("blue")                        ? 3.0F
                                                                                      : 9.0F;
}

constexpr Box kOne = {0, 0, 0, 0};

/// Adds an attribute to the header of a file of one part and one line.
std::string with_attribute(std::string file, const std::string& type, const std::string& value) {
  const std::string added =
      type + '\0' + type + '\0' + u32(static_cast<std::uint32_t>(value.size())) + value;
  const std::string last = std::string("screenWindowWidth\0float\0", 24) + u32(4);
  const std::size_t table = file.find(last) + last.size() + 4 + 1;
  std::uint32_t line = 0;
  std::memcpy(&line, &file[table], sizeof line);
  file.replace(table, sizeof line, u32(line + static_cast<std::uint32_t>(added.size())));
  return file.insert(table - 1, added);
}

std::string one_pixel(const std::vector<ExrPartFile>& parts) {
  return exr(parts, [](const std::string& channel, int, int) { return constant(channel); });
}

TEST(ExrHeader, DataWindowLiesInTheDisplayWindowWithBlackAround) {
  // 4 x 3; x from 1, two columns; the last two rows, and one below the display window.
  const std::string file = exr(
      {{"", {"B", "G", "R"}, {11, 6, 12, 8}, {10, 5, 13, 7}}},
      [](const std::string& channel, int x, int y) {
        return channel == "R" ? static_cast<float>(x) : channel == "G" ? static_cast<float>(y) : 1;
      });
  const core::Image image = decoded(file);
  ASSERT_EQ(image.width, 4);
  ASSERT_EQ(image.height, 3);
  const std::vector<float> values = floats_of(image);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      const std::size_t at = static_cast<std::size_t>(y * 4 + x) * 3;
      const bool is_stored = y >= 1 && x >= 1 && x <= 2;
      EXPECT_EQ(values[at], is_stored ? static_cast<float>(x + 10) : 0) << x << ' ' << y;
      EXPECT_EQ(values[at + 1], is_stored ? static_cast<float>(y + 5) : 0);
      EXPECT_EQ(values[at + 2], is_stored ? 1 : 0);
    }
  }
}

TEST(ExrHeader, RefusesAHugeDisplayWindow) {
  const std::string file = exr({{"", {"B", "G", "R"}, kOne, {0, 0, 999'999, 999'999}}},
                               [](const std::string&, int, int) { return 1.0F; });
  const auto image = core::decode_image(bytes_of(file), {});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

TEST(ExrHeader, PictureIsTheLayerOfThatName) {
  const std::vector<std::vector<std::string>> lists = {
      {"B", "G", "R", "Z", "albedo.B", "albedo.G", "albedo.R"},
      {"ViewLayer.AO.Q", "ViewLayer.Combined.A", "ViewLayer.Combined.B", "ViewLayer.Combined.G",
       "ViewLayer.Combined.R", "ViewLayer.Depth.Z"},
      {"AO.V", "Z", "view.B", "view.G", "view.R"},
      {"depth.Z", "rgba.blue", "rgba.green", "rgba.red"},
  };
  for (const auto& channels : lists) {
    const std::vector<float> values = floats_of(decoded(one_pixel({{"", channels, kOne, kOne}})));
    ASSERT_GE(values.size(), 3U) << channels[0];
    EXPECT_EQ(values[0], 1) << channels[0];
    EXPECT_EQ(values[1], 2) << channels[0];
    EXPECT_EQ(values[2], 3) << channels[0];
  }
}

TEST(ExrHeader, PictureMayBeALaterPart) {
  const std::vector<float> values = floats_of(decoded(
      one_pixel({{"depth", {"Z"}, kOne, kOne}, {"rgba", {"A", "B", "G", "R"}, kOne, kOne}})));
  EXPECT_EQ(values, (std::vector<float>{1, 2, 3, 9}));
}

TEST(ExrHeader, ACutFileOfSeveralPartsIsNotWhole) {
  const std::string file =
      one_pixel({{"depth", {"Z"}, kOne, kOne}, {"rgba", {"A", "B", "G", "R"}, {0, 0, 7, 7}, kOne}});
  EXPECT_TRUE(core::check_image_file(bytes_of(file)));
  for (const std::size_t cut : {std::size_t{1}, std::size_t{20}, file.size() / 2}) {
    EXPECT_FALSE(core::check_image_file(bytes_of(file.substr(0, file.size() - cut)))) << cut;
  }
}

TEST(ExrHeader, GreyHasOneChannel) {
  const core::Image image = decoded(one_pixel({{"", {"Y"}, kOne, kOne}}));
  EXPECT_EQ(image.channels, 1);
  EXPECT_EQ(core::radiance_of(image, core::AlphaUse::kIgnored)[0], core::Rgb(1));
}

core::Result<core::ExrPicture> choose(std::vector<std::string> channels) {
  return core::choose_exr_picture({{"", std::move(channels)}});
}

TEST(ExrLayers, CompositeComesBeforeTheOtherViewLayers) {
  const auto chosen =
      choose({"Composite.Combined.R", "Composite.Combined.G", "Composite.Combined.B",
              "A.Combined.R", "A.Combined.G", "A.Combined.B"});
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->channels, (std::vector{0, 1, 2}));
}

TEST(ExrLayers, SeveralWithoutANameAreListed) {
  const auto chosen = choose({"key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B"});
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().message.find("key: R G B"), std::string::npos);
  EXPECT_NE(chosen.error().message.find("fill: R G B"), std::string::npos);
}

TEST(ExrLayers, NoneWithColorIsRefused) {
  EXPECT_FALSE(choose({"Z", "AO.V"}));
  EXPECT_TRUE(choose({"normal.X", "normal.Y", "normal.Z"}));  // the only layer
}

TEST(ExrLayers, LuminanceAndChromaAreRefusedByName) {
  const auto chosen = choose({"BY", "RY", "Y"});
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().message.find("luminance and chroma"), std::string::npos);
}

// OpenEXR writes chroma with one value for 2 x 2 pixels, which some versions of OpenImageIO refuse
// and others convert.
TEST(ExrHeader, SubsampledChromaIsRefusedByName) {
  std::string file = one_pixel({{"", {"BY", "RY", "Y"}, kOne, kOne}});
  const std::string full = std::string("RY\0", 3) + u32(2) + u32(0) + u32(1) + u32(1);
  const std::size_t at = file.find(full);
  ASSERT_NE(at, std::string::npos);
  file.replace(at, full.size(), std::string("RY\0", 3) + u32(2) + u32(0) + u32(2) + u32(2));
  for (const auto& image :
       {core::decode_image(bytes_of(file), {}), core::read_image_header(bytes_of(file))}) {
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("\"RY\""), std::string::npos);
    EXPECT_NE(image.error().message.find("luminance and chroma"), std::string::npos);
  }
}

TEST(ExrHeader, CubeMapsAreRefusedByNameAndPanoramasAreRead) {
  const std::string file = one_pixel({{"", {"B", "G", "R"}, kOne, kOne}});
  EXPECT_EQ(floats_of(decoded(with_attribute(file, "envmap", std::string(1, '\0')))),
            (std::vector<float>{1, 2, 3}));
  const std::string cube = with_attribute(file, "envmap", "\1");
  for (const auto& image :
       {core::decode_image(bytes_of(cube), {}), core::read_image_header(bytes_of(cube))}) {
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("cube"), std::string::npos);
    EXPECT_NE(image.error().message.find("exrenvmap -latlong"), std::string::npos);
  }
}

/// Returns why a file is refused.
std::string fault_of(const std::string& file) {
  const auto image = core::decode_image(bytes_of(file), {});
  return image ? "" : image.error().message;
}

TEST(ExrHeader, UnsignedIntegersAreRefusedByNameInThePictureOnly) {
  std::string file = one_pixel({{"", {"B", "G", "R", "id"}, kOne, kOne}});
  const auto with_integers = [&](const std::string& channel) {
    std::string changed = file;
    const std::size_t at = changed.find(channel + '\0' + u32(2));
    EXPECT_NE(at, std::string::npos);
    return changed.replace(at, channel.size() + 5, channel + '\0' + u32(0));
  };
  EXPECT_EQ(fault_of(with_integers("id")), "");
  EXPECT_EQ(fault_of(with_integers("G")).find("channel \"G\" of the EXR has unsigned integers"), 0U)
      << fault_of(with_integers("G"));
}

TEST(ExrHeader, NewerCompressionsAreNamed) {
  std::string file = one_pixel({{"", {"B", "G", "R"}, kOne, kOne}});
  const std::string before = std::string("compression\0compression\0", 24) + u32(1);
  const std::size_t at = file.find(before) + before.size();
  for (const auto& [method, name] :
       {std::pair{'\x0a', "HTJ2K"}, {'\x0b', "HTJ2K"}, {'\x20', "method 32"}}) {
    file[at] = method;
    EXPECT_EQ(fault_of(file), std::string("the EXR is compressed with ") + name +
                                  ", which is not read here; save it with ZIP or PIZ compression");
  }
}

TEST(ExrHeader, PrimariesOtherThanThoseOfRec709GiveAWarning) {
  const auto with_primaries = [](const std::vector<float>& values) {
    std::string bytes(values.size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return with_attribute(one_pixel({{"", {"B", "G", "R"}, kOne, kOne}}), "chromaticities", bytes);
  };
  const std::string rec709 =
      with_primaries({0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.313F, 0.329F});
  const std::string aces =
      with_primaries({0.7347F, 0.2653F, 0, 1, 0.0001F, -0.077F, 0.32168F, 0.33767F});
  EXPECT_EQ(core::radiance_warning(bytes_of(rec709), decoded(rec709), "the environment"), "");
  EXPECT_NE(core::radiance_warning(bytes_of(aces), decoded(aces), "the environment")
                .find("primaries that the file of the environment states"),
            std::string::npos);
}

// Radiance HDR.

/// 3 x 2 pixels, uncompressed: the mantissas of red and green are column and row.
std::string hdr(const std::string& first_line, const std::string& order, bool by_columns,
                bool from_right, bool from_bottom) {
  std::string file = first_line + "\nFORMAT=32-bit_rle_rgbe\n\n" + order + "\n";
  const int lines = by_columns ? 3 : 2;
  for (int line = 0; line < lines; ++line) {
    for (int i = 0; i < 5 - lines; ++i) {
      const int across = by_columns ? line : i;
      const int down = by_columns ? i : line;
      const int x = from_right ? 2 - across : across;
      const int y = from_bottom ? 1 - down : down;
      file += {static_cast<char>(128 + x), static_cast<char>(128 + y), '\x40',
               static_cast<char>(128 + 8)};
    }
  }
  return file;
}

TEST(HdrHeader, ScanlinesOfAllEightOrdersMakeThePicture) {
  for (const bool by_columns : {false, true}) {
    for (const bool from_right : {false, true}) {
      for (const bool from_bottom : {false, true}) {
        const std::string x = std::string(from_right ? "-" : "+") + "X 3";
        const std::string y = std::string(from_bottom ? "+" : "-") + "Y 2";
        const std::string order = by_columns ? x + " " + y : y + " " + x;
        const core::Image image =
            decoded(hdr("#?RADIANCE", order, by_columns, from_right, from_bottom));
        ASSERT_EQ(image.width, 3) << order;
        ASSERT_EQ(image.height, 2) << order;
        const std::vector<float> values = floats_of(image);
        for (std::size_t i = 0; i < 6; ++i) {
          // Radiance takes the middle of a step, most readers, as this one, its lower end.
          EXPECT_NEAR(values[i * 3], static_cast<double>(128 + i % 3), 0.6) << order << ' ' << i;
          EXPECT_NEAR(values[i * 3 + 1], static_cast<double>(128 + i / 3), 0.6)
              << order << ' ' << i;
        }
      }
    }
  }
}

TEST(HdrHeader, NamesAnyProgram) {
  EXPECT_EQ(decoded(hdr("#?AUTOPANO", "-Y 2 +X 3", false, false, false)).width, 3);
}

TEST(HdrHeader, RefusesAWrongResolutionLine) {
  for (const char* order : {"-Y 2 +Y 3", "Y 2 X 3", "-Y 2", "-Y -2 +X 3", ""}) {
    EXPECT_FALSE(core::decode_image(bytes_of(hdr("#?RADIANCE", order, false, false, false)), {}))
        << order;
  }
}

/// A file of one scanline.
std::string hdr_line(const std::string& variables, int width, const std::string& pixels) {
  return "#?RADIANCE\n" + variables + "\n-Y 1 +X " + std::to_string(width) + "\n" + pixels;
}
const std::string kRgbe = "FORMAT=32-bit_rle_rgbe\n";
/// 1, 1/2 and 1/4: mantissas over 256, times 2^(129 - 128).
const std::string kPixel = "\x80\x40\x20\x81";

TEST(HdrHeader, ValuesAreDividedByAllExposuresAndColorCorrections) {
  const core::Image image = decoded(
      hdr_line("EXPOSURE=2\n" + kRgbe + "EXPOSURE= 4.0\nCOLORCORR= 2 1 .5\nCOLORCORR=1 4 1\n" +
                   "\tEXPOSURE=64\n",  // of a picture from which this one was made
               1, kPixel));
  EXPECT_EQ(floats_of(image), (std::vector<float>{1.0F / 16, 0.5F / 32, 0.25F / 4}));
}

TEST(HdrHeader, RefusesADivisionByZero) {
  for (const char* variable :
       {"EXPOSURE=0", "EXPOSURE=-1", "EXPOSURE=nan", "EXPOSURE=1e-30\nEXPOSURE=1e-30",
        "EXPOSURE=bright", "COLORCORR=1 1"}) {
    const auto image =
        core::decode_image(bytes_of(hdr_line(kRgbe + variable + "\n", 1, kPixel)), {});
    ASSERT_FALSE(image) << variable;
    EXPECT_NE(image.error().message.find("must be positive"), std::string::npos);
  }
}

TEST(HdrHeader, XyzIsRefusedByName) {
  const auto image =
      core::decode_image(bytes_of(hdr_line("FORMAT=32-bit_rle_xyze\n", 1, kPixel)), {});
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message.find("ra_xyze -r"), std::string::npos);
}

TEST(HdrHeader, PrimariesOtherThanThoseOfRec709GiveAWarning) {
  const auto warning = [](const std::string& primaries) {
    const std::string file = hdr_line(kRgbe + "PRIMARIES=" + primaries + "\n", 1, kPixel);
    return core::radiance_warning(bytes_of(file), decoded(file), "the environment");
  };
  EXPECT_EQ(warning(".64 .33 .3 .6 .15 .06 .3127 .329"), "");
  EXPECT_NE(warning("0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290").find("Rec. 709"),
            std::string::npos);
}

std::vector<float> reds_of(const std::string& file) {
  std::vector<float> reds;
  const std::vector<float> values = floats_of(decoded(file));
  for (std::size_t i = 0; i < values.size(); i += 3) {
    reds.push_back(values[i]);
  }
  return reds;
}

TEST(HdrRuns, OldRunsRepeatThePixelBeforeThem) {
  const std::string other = "\x80\x80\x80\x82";  // 2
  EXPECT_EQ(reds_of(hdr_line(kRgbe, 8, kPixel + "\1\1\1\4" + other + "\1\1\1\2")),
            (std::vector<float>{1, 1, 1, 1, 1, 2, 2, 2}));
  EXPECT_EQ(reds_of(hdr_line(kRgbe, 3, kPixel + other + "\1\1\1\1")),
            (std::vector<float>{1, 2, 2}));
  // 1 + 44 + 256 times.
  std::vector<float> expected(301, 1.0F);
  expected.push_back(2);
  EXPECT_EQ(reds_of(hdr_line(kRgbe, 302, kPixel + "\1\1\1\x2c\1\1\1\1" + other)), expected);
}

TEST(HdrRuns, RunsOfChannelsRepeatABytes) {
  // Red: three of 128, then 64 32 16 8 4; green and blue 0; exponent 129.
  const std::string line = std::string("\2\2\0\x08", 4) + "\x83\x80\x05\x40\x20\x10\x08\x04" +
                           std::string("\x88\0\x88\0", 4) + "\x88\x81";
  EXPECT_EQ(reds_of(hdr_line(kRgbe, 8, line)),
            (std::vector<float>{1, 1, 1, 0.5F, 0.25F, 0.125F, 0.0625F, 0.03125F}));
}

TEST(HdrRuns, RefusesRunsThatLeaveTheirLineAndMissingBytes) {
  const std::string run = std::string("\2\2\0\x08", 4);
  for (const std::string& pixels :
       {kPixel + "\1\1\1\x08", "\1\1\1\1" + kPixel, kPixel + "\1\1\1\6", kPixel.substr(0, 3),
        run + "\x89\x80", run + std::string(8, '\0'), std::string("\2\2\0\x07", 4) + kPixel,
        run + "\x88\x80\x88\x80\x88\x80\x88"}) {
    const auto image = core::decode_image(bytes_of(hdr_line(kRgbe, 8, pixels)), {});
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("cut short or damaged"), std::string::npos);
  }
}

// Light.

core::Image floats(std::vector<float> values, int channels) {
  core::Image image{
      static_cast<int>(values.size()) / channels, 1, channels, core::PixelType::kF32, {}};
  image.bytes.resize(values.size() * sizeof(float));
  std::memcpy(image.bytes.data(), values.data(), image.bytes.size());
  return image;
}

TEST(Radiance, ValuesThatAreNoLightBecomeZeroAndAreCounted) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const core::Image image = floats({1, 2, 3, -1, 5, 6, nan, inf, 9, 1, 1, -inf}, 3);
  const std::vector<core::Rgb> light = core::radiance_of(image, core::AlphaUse::kIgnored);
  EXPECT_EQ(light[0], (core::Rgb{1, 2, 3}));
  EXPECT_EQ(light[1], (core::Rgb{0, 5, 6}));
  EXPECT_EQ(light[2], (core::Rgb{0, 0, 9}));
  EXPECT_EQ(light[3], (core::Rgb{1, 1, 0}));
  EXPECT_EQ(core::radiance_warning({}, image, "the environment").find("3 texels"), 0U);
  EXPECT_EQ(core::radiance_warning({}, floats({1, 2, 3}, 3), "the environment"), "");
}

TEST(Radiance, ValuesWhoseSquareIsNoFloatAreClampedAndCounted) {
  const float huge = std::numeric_limits<float>::max();
  const core::Image image = floats({1, 2, huge, -1, 1e19F, 6, 9e17F, 0, 0}, 3);
  const std::vector<core::Rgb> light = core::radiance_of(image, core::AlphaUse::kIgnored);
  EXPECT_EQ(light[0], (core::Rgb{1, 2, core::kRadianceMost}));
  EXPECT_EQ(light[1], (core::Rgb{0, core::kRadianceMost, 6}));
  EXPECT_EQ(light[2], (core::Rgb{9e17F, 0, 0}));
  EXPECT_LT(core::kRadianceMost * core::kRadianceMost * 64, huge);
  EXPECT_EQ(core::radiance_warning({}, image, "the map"),
            "1 texel of the map has negative, infinite or undefined values, which were set to 0. "
            "2 texels of the map have values above 1e18, which were set to that.");
}

TEST(Radiance, AlphaIsNotCountedAndGreyHasThreeChannels) {
  const core::Image image = floats({0.5F, -1}, 2);
  EXPECT_EQ(core::radiance_of(image, core::AlphaUse::kIgnored)[0], core::Rgb(0.5F));
  EXPECT_EQ(core::radiance_warning({}, image, "the environment"), "");
}

// TIFF that other programs read: no compression, no predictor, no clock.

TEST(TiffWrite, HasNoPredictorAndNoTimeOfDay) {
  const core::FloatImage image{3, 2, {"R", "G", "B"}, std::vector<float>(18, 0.25F)};
  const auto& formats = core::image_formats();
  const auto file = core::encode_image(image, formats[formats.size() - 1], {});
  ASSERT_TRUE(file);
  const auto at = [&](std::size_t i) { return std::to_integer<std::uint32_t>((*file)[i]); };
  const auto short_at = [&](std::size_t i) { return at(i) | at(i + 1) << 8U; };
  const std::size_t directory = short_at(4) | short_at(6) << 16U;
  for (std::size_t entry = 0; entry < short_at(directory); ++entry) {
    const std::size_t place = directory + 2 + 12 * entry;
    const std::uint32_t tag = short_at(place);
    EXPECT_NE(tag, 317U);  // Predictor
    if (tag == 259) {      // Compression: none
      EXPECT_EQ(short_at(place + 8), 1U);
    }
    if (tag == 306) {  // DateTime
      const std::size_t text = short_at(place + 8) | short_at(place + 10) << 16U;
      EXPECT_EQ(std::memcmp(file->data() + text, "1970:01:01", 10), 0);
    }
  }
}

}  // namespace
