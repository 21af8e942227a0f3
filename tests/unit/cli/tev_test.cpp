#include "clients/cli/tev.h"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "clients/cli/tile_frames.h"

namespace {

using std::string_literals::operator""s;

constexpr std::array<std::string_view, 3> kRgb = {"R", "G", "B"};

// Expected bytes follow the protocol's description, field by field.
TEST(TevPackets, CreateImageByteForByte) {
  const std::string payload =
      "\4"s          // CreateImage
      "\1"s          // grab the focus
      "job\0"s       // name
      "\x40\1\0\0"s  // width 320
      "\xb4\0\0\0"s  // height 180
      "\3\0\0\0"s    // channels
      "R\0G\0B\0"s;
  EXPECT_EQ(cli::tev_create_image("job", 320, 180, kRgb), "\x1c\0\0\0"s + payload);
  EXPECT_EQ(4 + payload.size(), 4U + 1 + 1 + 4 + 3 * 4 + 3 * 2);
}

TEST(TevPackets, UpdateImageByteForByte) {
  const std::array<float, 6> values = {1.0F, 2.0F, 0.5F, -1.0F, 0.0F, 1.5F};
  const std::string payload =
      "\6"s  // UpdateImage with offsets and strides
      "\0"s  // leave the focus
      "j\0"s
      "\3\0\0\0"s
      "R\0G\0B\0"s
      "\x20\0\0\0"s  // x 32
      "\0\1\0\0"s    // y 256
      "\2\0\0\0"s    // width
      "\1\0\0\0"s    // height
      "\0\0\0\0\0\0\0\0"s
      "\2\0\0\0\0\0\0\0"s
      "\4\0\0\0\0\0\0\0"s  // offsets, in values
      "\1\0\0\0\0\0\0\0"s
      "\1\0\0\0\0\0\0\0"s
      "\1\0\0\0\0\0\0\0"s  // strides
      "\0\0\x80\x3f"s
      "\0\0\0\x40"s
      "\0\0\0\x3f"s
      "\0\0\x80\xbf"s
      "\0\0\0\0"s
      "\0\0\xc0\x3f"s;
  const std::string packet = cli::tev_update_image("j", {32, 256, 2, 1}, kRgb, values);
  EXPECT_EQ(packet.substr(4), payload);
  EXPECT_EQ(packet.substr(0, 4), std::string(1, static_cast<char>(payload.size() + 4)) + "\0\0\0"s);
}

TEST(TevConnection, RefusesAnInvalidAddress) {
  for (const char* address : {"", "localhost", ":14158", "localhost:", "latest"}) {
    const auto opened = cli::TevConnection::open(address);
    ASSERT_FALSE(opened) << address;
    EXPECT_EQ(opened.error().code, core::ErrorCode::kInvalidArgument) << address;
  }
}

/// A tile of one pixel at (3, 5): planes r g b, vr vg vb, n in the order of
/// api/answers/tile_frame.h, and its CRC-32.
const std::string kTile =
    "TSR1"s
    "\x1c\0\0\0"s
    "\7\0\0\0"s
    "\3\0\5\0\1\0\1\0"s
    "\0\0\0\0"s
    "\0\0\0\x3f"s
    "\xad\x85\x1e\xe9"s
    "\0\0\x80\x3f\0\0\0\x40\0\0\0\x3f"s
    "\0\0\0\0\0\0\0\0\0\0\0\0"s
    "\0\0\x80\x41"s;
const std::string kEnd =
    "TSR1"s
    "\0\0\0\0"s
    "\7\0\0\0"s
    "\0\0\0\0\0\0\0\0"s
    "\1\0\0\0"s
    "\0\0\0\x3f"s
    "\0\0\0\0"s;

TEST(TileParser, GivesTheSameTilesForAnyChunks) {
  const std::string stream = kTile + kEnd;
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    cli::TileParser parser;
    auto first = parser.feed(stream.substr(0, cut));
    auto second = parser.feed(stream.substr(cut));
    ASSERT_TRUE(first && second) << cut << (first ? second.error().message : first.error().message);
    std::vector<cli::TileFrame> frames = *first;
    frames.insert(frames.end(), second->begin(), second->end());
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[0].x, 3);
    EXPECT_EQ(frames[0].y, 5);
    EXPECT_EQ(frames[0].planes, (std::vector<float>{1.0F, 2.0F, 0.5F}));
    EXPECT_FALSE(frames[0].is_end);
    EXPECT_TRUE(frames[1].is_end);
  }
}

TEST(TileParser, DetectsAFlippedBit) {
  for (const std::size_t at : {0U, 32U, 40U, 59U}) {
    std::string tile = kTile;
    tile[at] = static_cast<char>(tile[at] ^ 1);
    cli::TileParser parser;
    EXPECT_FALSE(parser.feed(tile)) << at;
  }
}

TEST(TileParser, DiscardsAnUnfinishedTileAfterARestart) {
  cli::TileParser parser;
  ASSERT_TRUE(parser.feed(kTile.substr(0, 50)));
  parser.restart();
  const auto frames = parser.feed(kTile);
  ASSERT_TRUE(frames);
  EXPECT_EQ(frames->size(), 1U);
}

}  // namespace
