#include "core/image_io/image_io.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "core/color/white_balance.h"
#include "core/image_io/image_size.h"

namespace {

using Bytes = std::vector<std::byte>;

const core::ImageFormat& format(std::string_view extension) {
  for (const core::ImageFormat& f : core::image_formats()) {
    if (f.extension == extension) {
      return f;
    }
  }
  ADD_FAILURE() << "missing format " << extension;
  return core::image_formats()[0];
}

core::FloatImage ramp(int width, int height, std::vector<std::string> names) {
  core::FloatImage image{width, height, std::move(names), {}};
  const auto count = static_cast<std::size_t>(width * height * image.channels());
  for (std::size_t i = 0; i < count; ++i) {
    image.values.push_back(static_cast<float>(i) / static_cast<float>(count));
  }
  return image;
}

Bytes encoded(const core::FloatImage& image, std::string_view extension,
              const core::EncodeOptions& options = {}) {
  auto bytes = core::encode_image(image, format(extension), options);
  EXPECT_TRUE(bytes.has_value()) << (bytes ? "" : bytes.error().message);
  return bytes ? *bytes : Bytes{};
}

core::Image decoded(const Bytes& file) {
  auto image = core::decode_image(file, {});
  EXPECT_TRUE(image.has_value()) << (image ? "" : image.error().message);
  return image ? *image : core::Image{};
}

float float_at(const core::Image& image, std::size_t i) {
  float value = 0;
  std::memcpy(&value, image.bytes.data() + i * sizeof(value), sizeof(value));
  return value;
}

/// The content of the PNG's chunk, and whether its checksum holds; empty if there is none.
std::string png_chunk(const Bytes& file, std::string_view type) {
  const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
  const auto number = [&text](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      value = value << 8U | static_cast<unsigned char>(text.at(at + i));
    }
    return value;
  };
  for (std::size_t at = 8; at + 12 <= text.size(); at += 12 + number(at)) {
    if (text.substr(at + 4, 4) == type) {
      const std::size_t bytes = number(at);
      const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(text.data() + at + 4), bytes + 4);
      EXPECT_EQ(number(at + 8 + bytes), crc);
      return text.substr(at + 8, bytes);
    }
  }
  return {};
}

std::string big_endian(std::uint32_t v) {
  return {static_cast<char>(v >> 24U), static_cast<char>(v >> 16U), static_cast<char>(v >> 8U),
          static_cast<char>(v)};
}

/// A chunk with its size and checksum.
std::string png_chunk_of(const std::string& type, const std::string& content) {
  const std::string text = type + content;
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size());
  return big_endian(static_cast<std::uint32_t>(content.size())) + text +
         big_endian(static_cast<std::uint32_t>(crc));
}

TEST(Png, ItsRenderingIntentIsPerceptual) {
  // PNG, 3rd edition, 11.3.2.5: perceptual is 0.
  for (const int size : {1, 300}) {
    EXPECT_EQ(png_chunk(encoded(ramp(size, size, {"R", "G", "B"}), "png"), "sRGB"),
              std::string(1, '\0'));
  }
  core::EncodeOptions data;
  data.is_color = false;
  EXPECT_EQ(png_chunk(encoded(ramp(2, 2, {"R", "G", "B"}), "png", data), "sRGB"), "");
}

class EachFormat : public testing::TestWithParam<std::string> {};

TEST_P(EachFormat, KeepsItsSize) {
  const core::Image image = decoded(encoded(ramp(17, 9, {"R", "G", "B"}), GetParam()));
  EXPECT_EQ(image.width, 17);
  EXPECT_EQ(image.height, 9);
  EXPECT_EQ(image.channels, 3);
}

TEST_P(EachFormat, IsDetectedByItsFirstBytes) {
  EXPECT_EQ(core::image_kind(encoded(ramp(4, 4, {"R", "G", "B"}), GetParam())), GetParam());
}

TEST_P(EachFormat, ReadsTheSizeFromTheHeader) {
  const auto header = core::read_image_header(encoded(ramp(17, 9, {"R", "G", "B"}), GetParam()));
  ASSERT_TRUE(header);
  EXPECT_EQ(header->width, 17);
  EXPECT_EQ(header->height, 9);
  EXPECT_TRUE(header->bytes.empty());
}

TEST_P(EachFormat, TruncatedFilesGiveAResult) {
  const Bytes whole = encoded(ramp(8, 8, {"R", "G", "B"}), GetParam());
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 200) {
    const auto image = core::decode_image(std::span(whole).first(size), {});
    if (size < whole.size() / 4) {
      EXPECT_FALSE(image.has_value()) << size;
    }
  }
}

TEST_P(EachFormat, EnforcesTheSideLimit) {
  const auto image =
      core::decode_image(encoded(ramp(40, 8, {"R", "G", "B"}), GetParam()), {.side_max = 39});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

TEST_P(EachFormat, EnforcesTheByteLimit) {
  const auto image = core::decode_image(encoded(ramp(40, 8, {"R", "G", "B"}), GetParam()),
                                        {.decoded_bytes_max = 40 * 8 * 3 - 1});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

TEST_P(EachFormat, SameImageGivesTheSameBytes) {
  core::EncodeOptions options;
  options.metadata = {{"tessera:seed", "7"}};
  const core::FloatImage image = ramp(16, 16, {"R", "G", "B"});
  EXPECT_EQ(encoded(image, GetParam(), options), encoded(image, GetParam(), options));
}

// Both halves of ISO/IEC 14496-12: the file's brand, and the item's size in the box `ispe`.
TEST(Avif, HasItsBrandItsSizeAndTheSameBytesEachTime) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"Y"}, {"R", "G", "B"}, {"R", "G", "B", "A"}}) {
    const core::FloatImage image = ramp(40, 9, names);
    const Bytes file = encoded(image, "avif");
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    EXPECT_EQ(text.substr(4, 8), "ftypavif");
    EXPECT_NE(text.find(std::string("ispe\0\0\0\0\0\0\0\x28\0\0\0\x09", 16)), std::string::npos);
    // The auxiliary image of alpha: ISO/IEC 23000-22.
    EXPECT_EQ(text.find("urn:mpeg:mpegB:cicp:systems:auxiliary:alpha") != std::string::npos,
              names.size() == 4);
    EXPECT_EQ(file, encoded(image, "avif"));
    // ISO/IEC 23008-12, A.2.1, and TIFF 6.0, section 2: the offset of the header, which is MM, 42.
    if (const std::size_t exif = text.rfind(std::string("Exif\0\0", 6));
        exif != std::string::npos) {
      EXPECT_EQ(text.substr(exif - 4, 14), std::string("\0\0\0\6Exif\0\0MM\0*", 14));
    }
  }
}

std::uint16_t short_at(const core::Image& image, std::size_t i) {
  std::uint16_t value = 0;
  std::memcpy(&value, image.bytes.data() + i * sizeof(value), sizeof(value));
  return value;
}

core::FloatImage flat(core::Rgb color) {
  return {1, 1, {"R", "G", "B"}, {color.r, color.g, color.b}};
}

TEST(Png, SixteenBitsHaveSixteenBits) {
  core::EncodeOptions options;
  options.bits = 16;
  options.tone_map = core::ToneMap::kLinear;
  const core::FloatImage image = ramp(33, 7, {"R", "G", "B"});
  const core::Image back = decoded(encoded(image, "png", options));
  ASSERT_EQ(back.type, core::PixelType::kU16);
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    EXPECT_EQ(short_at(back, i), std::lround(image.values[i] * 65535)) << i;
  }
}

TEST(Look, ContrastIsTheSlopeInStopsAboutMiddleGrey) {
  core::EncodeOptions options;
  options.bits = 16;
  options.tone_map = core::ToneMap::kLinear;
  options.contrast = 1.5F;
  // One stop below, at, and one stop above 0.18: 1.5 stops below, at, and above.
  const core::FloatImage image = flat({0.09F, 0.18F, 0.36F});
  const core::Image back = decoded(encoded(image, "png", options));
  const double expected[] = {0.18 * std::exp2(-1.5), 0.18, 0.18 * std::exp2(1.5)};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(short_at(back, c), expected[c] * 65535, 1) << c;
  }
  options.is_color = false;  // data stays as it is
  EXPECT_NEAR(short_at(decoded(encoded(image, "png", options)), 0), 0.09 * 65535, 1);
}

// CIE standard illuminant A is a black body of 2855.5 K in today's temperature scale (ISO/CIE
// 11664-2), x = 0.44758, y = 0.40745.
TEST(Look, WhiteBalanceMakesIlluminantAGrey) {
  const double x = 0.44758;
  const double y = 0.40745;
  const double xyz[3] = {x / y, 1, (1 - x - y) / y};
  const auto row = [&xyz](double a, double b, double c) {
    return static_cast<float>(0.5 * (a * xyz[0] + b * xyz[1] + c * xyz[2]));
  };
  const core::Rgb lamp = {row(3.2404542, -1.5371385, -0.4985314),
                          row(-0.9692660, 1.8760108, 0.0415560),
                          row(0.0556434, -0.2040259, 1.0572252)};
  EXPECT_GT(lamp.r, 3 * lamp.b);
  const core::Rgb grey = core::WhiteBalance(2855.5F)(lamp);
  EXPECT_NEAR(grey.r, 0.5F, 1e-3F);
  EXPECT_NEAR(grey.g, 0.5F, 1e-3F);
  EXPECT_NEAR(grey.b, 0.5F, 1e-3F);
  EXPECT_GT(std::fabs(core::WhiteBalance(2900)(lamp).b - 0.5F), 5e-3F);  // and nothing else
  core::EncodeOptions options;
  options.tone_map = core::ToneMap::kLinear;
  options.bits = 16;
  options.white_kelvin = 2855.5F;
  const core::Image back = decoded(encoded(flat(lamp), "png", options));
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(short_at(back, c), 0.5 * 65535, 1e-3 * 65535) << c;
  }
}

INSTANTIATE_TEST_SUITE_P(ImageIo, EachFormat,
                         testing::Values("png", "jpg", "webp", "exr", "hdr", "tif"),
                         [](const auto& test) { return test.param; });

TEST(ImageRead, RefusesUnknownBytes) {
  const Bytes rubbish(100, std::byte{42});
  const auto image = core::decode_image(rubbish, {});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kInvalidArgument);
}

TEST(ImageRead, RefusesAHugePngByItsHeader) {
  Bytes file = encoded(ramp(4, 4, {"R", "G", "B"}), "png");
  file[18] = std::byte{0x7F};  // width 0x7F04 and more
  const auto image = core::decode_image(file, {});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

TEST(ImageRead, RefusesAnExrOfMillionsOfLinesByItsHeader) {
  Bytes file = encoded(ramp(4, 4, {"R", "G", "B"}), "exr");
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  // Name, type "box2i", size 16, then x and y of the first and of the last pixel.
  const std::size_t window = text.find("dataWindow") + sizeof("dataWindow") + sizeof("box2i") + 4;
  file[window + 14] = std::byte{0x7F};  // last line: 8 million and more
  EXPECT_FALSE(core::decode_image(file, {}).has_value());
  EXPECT_FALSE(core::read_image_header(file).has_value());
}

TEST(ImageRead, RefusesAnExrAttributeTooShortForItsType) {
  // OpenEXR always reads 16 bytes of a window, regardless of the size in the file, and interprets
  // the following bytes as the next attribute, with a size of gigabytes.
  Bytes file = encoded(ramp(4, 4, {"R", "G", "B"}), "exr");
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  file[text.find("displayWindow") + sizeof("displayWindow") + sizeof("box2i")] = std::byte{2};
  EXPECT_FALSE(core::decode_image(file, {}).has_value());
}

/// A PNG made by hand: rows with their filter bytes, and chunks before them. Source: PNG, 3rd
/// edition, 5.3 and 11.2.
Bytes png_of(std::uint32_t width, std::uint32_t height, int bits, int color_type,
             const std::string& rows, const std::string& chunks = {}) {
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size()));
  packed.resize(size);
  const std::string file =
      std::string("\x89PNG\r\n\x1a\n", 8) +
      png_chunk_of("IHDR", big_endian(width) + big_endian(height) + static_cast<char>(bits) +
                               static_cast<char>(color_type) + std::string(3, '\0')) +
      chunks + png_chunk_of("IDAT", packed) + png_chunk_of("IEND", "");
  const auto bytes = std::as_bytes(std::span(file));
  return {bytes.begin(), bytes.end()};
}

std::string text_of(const core::Image& image) {
  return {reinterpret_cast<const char*>(image.bytes.data()), image.bytes.size()};
}

TEST(ImageRead, PngPalettesBecomeColours) {
  // Four pixels of two bits: entries 2, 1, 0, 1; the first two entries have alpha.
  const std::string palette = png_chunk_of("PLTE", std::string("\1\2\3\4\5\6\7\10\11", 9));
  const std::string row("\0\x91", 2);
  core::Image image = decoded(png_of(4, 1, 2, 3, row, palette));
  EXPECT_EQ(image.channels, 3);
  EXPECT_EQ(text_of(image), std::string("\7\10\11\4\5\6\1\2\3\4\5\6", 12));
  image =
      decoded(png_of(4, 1, 2, 3, row, palette + png_chunk_of("tRNS", std::string("\0\x40", 2))));
  EXPECT_EQ(image.channels, 4);
  EXPECT_EQ(text_of(image), std::string("\7\10\11\xff\4\5\6\x40\1\2\3\0\4\5\6\x40", 16));
}

TEST(ImageRead, PngKeepsGreyAndSixteenBits) {
  core::Image image = decoded(png_of(3, 1, 1, 0, std::string("\0\xa0", 2)));
  EXPECT_EQ(image.channels, 1);
  EXPECT_EQ(text_of(image), std::string("\xff\0\xff", 3));
  image = decoded(png_of(1, 2, 8, 4, std::string("\0\x11\x22\0\x33\x44", 6)));
  EXPECT_EQ(image.channels, 2);
  EXPECT_EQ(text_of(image), "\x11\x22\x33\x44");
  image = decoded(png_of(1, 1, 16, 0, std::string("\0\x12\x34", 3)));
  EXPECT_EQ(image.type, core::PixelType::kU16);
  std::uint16_t value = 0;
  std::memcpy(&value, image.bytes.data(), sizeof(value));
  EXPECT_EQ(value, 0x1234);
  // One colour is transparent.
  image = decoded(png_of(2, 1, 8, 2, std::string("\0\1\2\3\4\5\6", 7),
                         png_chunk_of("tRNS", std::string("\0\4\0\5\0\6", 6))));
  EXPECT_EQ(text_of(image), std::string("\1\2\3\xff\4\5\6\0", 8));
}

TEST(ImageRead, SaysWhatIsWrongWithAPng) {
  Bytes file = png_of(8, 8, 8, 2, std::string(8 * 25, '\0'));
  file[file.size() - 20] ^= std::byte{1};  // the data's checksum
  const auto image = core::decode_image(file, {});
  ASSERT_FALSE(image.has_value());
  EXPECT_EQ(image.error().message.substr(0, 5), "png: ");
  EXPECT_FALSE(core::decode_image(png_of(8, 8, 8, 2, std::string(8 * 24, '\0')), {}).has_value())
      << "a row is short";
}

TEST(ImageRead, PngKeepsColorWithAlpha) {
  core::EncodeOptions data;
  data.is_color = false;
  // Unassociated in the file: colour 1 at alpha 0.2 is returned as 255, 51.
  const core::Image image =
      decoded(encoded({1, 1, {"R", "G", "B", "A"}, {0.2F, 0.1F, 0, 0.2F}}, "png", data));
  ASSERT_EQ(image.bytes.size(), 4U);
  EXPECT_EQ(std::to_integer<int>(image.bytes[0]), 255);
  EXPECT_EQ(std::to_integer<int>(image.bytes[1]), 128);
  EXPECT_EQ(std::to_integer<int>(image.bytes[3]), 51);
}

TEST(ImageWrite, AppliesTheSrgbCurveToColor) {
  // 0.5 linear is 188 of 255 in sRGB.
  const core::Image image = decoded(encoded({1, 1, {"R", "G", "B"}, {0.5F, 1, 0}}, "png"));
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(0)), 188);
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(1)), 255);
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(2)), 0);
}

TEST(ImageWrite, ExposureIsInStops) {
  core::EncodeOptions options;
  options.exposure_stops = 1;
  const core::Image image =
      decoded(encoded({1, 1, {"R", "G", "B"}, {0.25F, 0.25F, 0.25F}}, "png", options));
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(0)), 188);
}

TEST(ImageWrite, DoesNotToneMapData) {
  core::EncodeOptions options;
  options.is_color = false;
  options.exposure_stops = 3;
  const core::Image image =
      decoded(encoded({1, 1, {"R", "G", "B"}, {0.5F, 0.2F, 2}}, "png", options));
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(0)), 128);
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(1)), 51);
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(2)), 255);
}

TEST(ImageWrite, NanIsBlackInDisplayFormats) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const core::Image image = decoded(encoded({1, 1, {"R", "G", "B"}, {nan, nan, 1}}, "png"));
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(0)), 0);
}

TEST(ImageWrite, ExrKeepsNan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const core::Image image = decoded(encoded({1, 1, {"R", "G", "B"}, {nan, 2, 3}}, "exr"));
  EXPECT_TRUE(std::isnan(float_at(image, 0)));
  EXPECT_EQ(float_at(image, 1), 2);
}

// A sun in photometric units has 1.6e9 cd/m^2.
TEST(ImageWrite, ExrStoresColorBeyondHalfAsFloat) {
  const float third = 1.0F / 3;
  const auto seen = [&](float brightest) {
    return decoded(encoded({2, 1, {"R", "G", "B"}, {third, 0, 0, -brightest, 0, 0}}, "exr"));
  };
  EXPECT_EQ(float_at(seen(1.6e9F), 3), -1.6e9F);
  EXPECT_EQ(float_at(seen(1.6e9F), 0), third);  // all of the part
  EXPECT_EQ(float_at(seen(65504), 3), -65504);
  EXPECT_NE(float_at(seen(65504), 0), third);  // half floats
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_NE(float_at(seen(infinity), 0), third);
}

TEST(ImageWrite, ExrStoresColorTooDarkForHalfAsFloat) {
  const float dark = 1e-8F / 3;
  const auto seen = [&](std::vector<std::string> names, std::vector<float> values) {
    const auto width = static_cast<int>(values.size() / names.size());
    return decoded(encoded({width, 1, std::move(names), std::move(values)}, "exr"));
  };
  EXPECT_EQ(float_at(seen({"R", "G", "B", "A"}, {dark, 0, 0, 1}), 0), dark);
  EXPECT_EQ(float_at(seen({"R", "G", "B"}, {dark, 6e-5F, 0}), 0), dark);
  EXPECT_NE(float_at(seen({"R", "G", "B"}, {dark, 6.2e-5F, 0}), 0), dark);  // half floats
  EXPECT_NE(float_at(seen({"R", "G", "B"}, {1.0F / 3, 0, 0, dark, 0, 0}), 0), 1.0F / 3);
}

TEST(ImageWrite, ExrKeepsAllBitsOfDepth) {
  const core::Image image = decoded(encoded({1, 1, {"depth.Z"}, {1.00000012F}}, "exr"));
  EXPECT_EQ(float_at(image, 0), 1.00000012F);
}

TEST(ImageWrite, ExrSupportsManyLayers) {
  const core::FloatImage layers =
      ramp(3, 2, {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B", "depth.Z", "normal.X"});
  EXPECT_EQ(decoded(encoded(layers, "exr")).width, 3);
}

TEST(ImageWrite, PngStoresItsMetadata) {
  core::EncodeOptions options;
  options.metadata = {{"tessera:seed", "4711"}};
  const Bytes file = encoded(ramp(2, 2, {"R", "G", "B"}), "png", options);
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  EXPECT_NE(text.find("tessera:seed"), std::string_view::npos);
  EXPECT_NE(text.find("4711"), std::string_view::npos);
}

TEST(ImageWrite, ExrStoresItsMetadata) {
  core::EncodeOptions options;
  options.metadata = {{"tessera:seed", "4711"}};
  const Bytes file = encoded(ramp(2, 2, {"R", "G", "B"}), "exr", options);
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  EXPECT_NE(text.find("tessera:seed"), std::string_view::npos);
  EXPECT_NE(text.find("4711"), std::string_view::npos);
}

TEST(ImageWrite, GreyImagesStayGrey) {
  EXPECT_EQ(decoded(encoded(ramp(2, 2, {"Y"}), "png")).channels, 1);
}

TEST(ImageWrite, WritesGreyWebpAsRgb) {
  EXPECT_EQ(decoded(encoded(ramp(8, 8, {"Y"}), "webp")).channels, 3);
}

TEST(ImageWrite, RefusesWebpBeyondItsLargestSide) {
  EXPECT_FALSE(core::encode_image(ramp(16384, 1, {"R", "G", "B"}), format("webp"), {}).has_value());
}

TEST(ImageWrite, WebpOfNoiseInAlphaTakesNoSeconds) {
  // libwebp's slowest method needs more than a second for it, its usual one some milliseconds.
  core::FloatImage image{200, 200, {"R", "G", "B", "A"}, {}};
  std::mt19937 random(1);
  for (int i = 0; i < image.width * image.height; ++i) {
    const float alpha = static_cast<float>(random() % 32U) / 32;
    image.values.insert(image.values.end(), {alpha / 2, alpha / 2, alpha / 2, alpha});
  }
  const std::clock_t begin = std::clock();  // of this process
  EXPECT_EQ(decoded(encoded(image, "webp")).channels, 4);
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 0.3);
}

TEST(ImageWrite, JpegOmitsAlpha) {
  EXPECT_EQ(decoded(encoded(ramp(8, 8, {"R", "G", "B", "A"}), "jpg")).channels, 3);
}

TEST(ImageWrite, RefusesAWrongNumberOfValues) {
  core::FloatImage image = ramp(4, 4, {"R", "G", "B"});
  image.values.pop_back();
  EXPECT_FALSE(core::encode_image(image, format("png"), {}).has_value());
}

TEST(White, FillsTransparentPixelsIfTheFormatHasNoAlpha) {
  const core::FloatImage nothing{8, 8, {"R", "G", "B", "A"}, std::vector<float>(256, 0)};
  EXPECT_EQ(std::to_integer<int>(decoded(encoded(nothing, "jpg")).bytes[0]), 255);
  EXPECT_FLOAT_EQ(float_at(decoded(encoded(nothing, "hdr")), 0), 1);
}

}  // namespace
