#include "api/answers/tile_frame.h"

#include <cmath>
#include <numeric>
#include <string>

#include <gtest/gtest.h>

namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

api::TileFrame small_frame(std::uint32_t flags) {
  api::TileFrame frame;
  frame.rect = {32, 64, 3, 2};
  frame.revision = 258;
  frame.flags = flags;
  frame.relative_error = 0.5F;
  frame.planes.resize((flags & api::kTileDenoised) != 0 ? 18
                      : (flags & api::kTileAlpha) != 0  ? 48
                                                        : 42);
  std::iota(frame.planes.begin(), frame.planes.end(), -3.5F);
  return frame;
}

TEST(TileFrame, HasTheDocumentedBytes) {
  api::TileFrame frame;
  frame.rect = {0x0102, 0x0304, 1, 1};
  frame.revision = 0x0A0B0C0D;
  frame.flags = 0;
  frame.relative_error = 1.0F;
  frame.planes = {1, 0, 0, 0, 0, 0, 2};
  const std::string text = api::encode_tile_frame(frame);
  const std::string header(
      "TSR1\x1c\0\0\0\x0d\x0c\x0b\x0a\x02\x01\x04\x03\x01\0\x01\0\0\0\0\0\0\0\x80\x3f", 28);
  ASSERT_EQ(text.size(), 60U);
  EXPECT_EQ(text.substr(0, 28), header);
  EXPECT_EQ(text.substr(32, 4), std::string("\0\0\x80\x3f", 4));
  EXPECT_EQ(text.substr(56, 4), std::string("\0\0\0\x40", 4));
}

TEST(TileFrame, ChecksumMatchesZlib) {
  // CRC-32 of 28 zero bytes by python3: zlib.crc32(bytes(28)).
  api::TileFrame frame;
  frame.rect = {0, 0, 1, 1};
  frame.planes.assign(7, 0.0F);
  const std::string text = api::encode_tile_frame(frame);
  EXPECT_EQ(text.substr(28, 4), std::string("\xe9\x77\x70\x80", 4));
}

TEST(TileFrame, EndFrameIsOnlyAHeader) {
  const std::string text = api::encode_end_frame(7, 0.25F);
  ASSERT_EQ(text.size(), api::kTileHeaderBytes);
  EXPECT_EQ(text.substr(20, 4), std::string("\x01\0\0\0", 4));
  EXPECT_EQ(text.substr(28, 4), std::string("\0\0\0\0", 4));
  const auto decoded = api::decode_tile_frame(bytes_of(text));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->frame.revision, 7U);
  EXPECT_EQ(decoded->frame.flags, api::kTileEnd);
}

TEST(TileFrame, ReadsWrittenFrames) {
  for (const std::uint32_t flags :
       {0U, api::kTileCorrelated, api::kTileAlpha, api::kTileDenoised}) {
    const api::TileFrame frame = small_frame(flags);
    const auto decoded = api::decode_tile_frame(bytes_of(api::encode_tile_frame(frame) + "more"));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->consumed, 32 + frame.planes.size() * 4);
    EXPECT_EQ(decoded->frame.rect, frame.rect);
    EXPECT_EQ(decoded->frame.revision, frame.revision);
    EXPECT_EQ(decoded->frame.flags, frame.flags);
    EXPECT_EQ(decoded->frame.relative_error, frame.relative_error);
    EXPECT_EQ(decoded->frame.planes, frame.planes);
  }
}

TEST(TileFrame, MeansAreHalfFloatsUpTo65504) {
  api::TileFrame frame;
  frame.rect = {0, 0, 2, 1};
  frame.flags = api::kTileMean | api::kTileAlpha;
  frame.planes = {1, 1e9F, -2, -1e9F, 0, 0.1F, 1, 0.5F};
  const std::string text = api::encode_tile_frame(frame);
  ASSERT_EQ(text.size(), 32U + 16U);
  // IEEE 754 binary16: 1 is 3c00, 65504 is 7bff, -2 is c000.
  EXPECT_EQ(text.substr(32, 8), std::string("\x00\x3c\xff\x7b\x00\xc0\xff\xfb", 8));
  const auto decoded = api::decode_tile_frame(bytes_of(text));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->consumed, text.size());
  const std::vector<float> shown = {1, 65504, -2, -65504, 0, 0.0999755859375F, 1, 0.5F};
  EXPECT_EQ(decoded->frame.planes, shown);
}

TEST(TileFrame, MeansOfAnyNumberOfPixelsAreLimitedAndKeepNan) {
  api::TileFrame frame;
  frame.rect = {0, 0, 3, 1};
  frame.flags = api::kTileMean;
  frame.planes = {0, std::nanf(""), 2, 3, 4, 5, 6, 7, 1e9F};
  const auto decoded = api::decode_tile_frame(bytes_of(api::encode_tile_frame(frame)));
  ASSERT_TRUE(decoded);
  EXPECT_TRUE(std::isnan(decoded->frame.planes[1]));
  EXPECT_EQ(decoded->frame.planes[7], 7);
  EXPECT_EQ(decoded->frame.planes[8], 65504);
  frame.rect.width = 1;
  frame.planes = {-1e9F, 0.5F, std::nanf("")};
  const auto one = api::decode_tile_frame(bytes_of(api::encode_tile_frame(frame)));
  ASSERT_TRUE(one);
  EXPECT_EQ(one->frame.planes[0], -65504);
  EXPECT_EQ(one->frame.planes[1], 0.5F);
  EXPECT_TRUE(std::isnan(one->frame.planes[2]));
}

TEST(TileFrame, KeepsNan) {
  api::TileFrame frame = small_frame(0);
  frame.relative_error = std::nanf("");
  frame.planes[20] = std::nanf("");
  const auto decoded = api::decode_tile_frame(bytes_of(api::encode_tile_frame(frame)));
  ASSERT_TRUE(decoded);
  EXPECT_TRUE(std::isnan(decoded->frame.relative_error));
  EXPECT_TRUE(std::isnan(decoded->frame.planes[20]));
}

TEST(TileFrame, WaitsForTheRestOfATruncatedFrame) {
  const std::string text = api::encode_tile_frame(small_frame(0));
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto decoded = api::decode_tile_frame(bytes_of(text.substr(0, size)));
    ASSERT_TRUE(decoded) << size;
    EXPECT_EQ(decoded->consumed, 0U) << size;
  }
}

// Of the magic number, the sizes, the checksum and the payload.
TEST(TileFrame, DetectsEveryFlippedBitOfSizesAndPayload) {
  const std::string text = api::encode_tile_frame(small_frame(0));
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (at < 8 || (at >= 16 && at < 20) || at >= 28) {
      for (unsigned bit = 0; bit < 8; ++bit) {
        std::string changed = text;
        changed[at] = static_cast<char>(static_cast<unsigned char>(changed[at]) ^ 1U << bit);
        EXPECT_FALSE(api::decode_tile_frame(bytes_of(changed))) << at << ", bit " << bit;
      }
    }
  }
}

}  // namespace
