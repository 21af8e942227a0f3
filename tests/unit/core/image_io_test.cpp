#include "core/image_io/image_io.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

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
