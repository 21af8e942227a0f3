// KTX2: images are compared with the output of Basis Universal (tests/ktx2/make.mjs).
#include "core/image_io/ktx2.h"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "core/image_io/basis_huffman.h"
#include "core/image_io/image_size.h"
#include "core/image_io/uastc.h"
#include "tests/support/read_bytes.h"

namespace {

using Bytes = std::vector<std::byte>;

Bytes read_file(const std::string& name) {
  Bytes bytes = test_support::read_bytes(std::string(TESSERA_SOURCE_DIR "/tests/ktx2/") + name);
  EXPECT_FALSE(bytes.empty()) << name;
  return bytes;
}

void put_u32(Bytes& file, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    file.at(at + i) = static_cast<std::byte>(value >> (8 * i));
  }
}
std::uint32_t get_u32(const Bytes& file, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= std::to_integer<std::uint32_t>(file.at(at + i)) << (8 * i);
  }
  return value;
}

struct File {
  const char* name;
  int width;
  int height;
  int channels;
};

class EachKtx2 : public testing::TestWithParam<File> {};

TEST_P(EachKtx2, IsBitEqualToBasisUniversal) {
  const Bytes file = read_file(std::string(GetParam().name).append(".ktx2"));
  const Bytes expected = read_file(std::string(GetParam().name).append(".rgba"));
  const auto image = core::decode_image(file, {});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width, GetParam().width);
  EXPECT_EQ(image->height, GetParam().height);
  ASSERT_EQ(image->channels, GetParam().channels);
  const auto channels = static_cast<std::size_t>(image->channels);
  const std::size_t texels = image->bytes.size() / channels;
  ASSERT_EQ(expected.size(), texels * 4);
  std::size_t different = 0;
  for (std::size_t i = 0; i < texels * 4; ++i) {
    const std::size_t c = i % 4;
    const std::byte own = c < channels ? image->bytes[i / 4 * channels + c] : std::byte{255};
    different += own == expected[i] ? 0U : 1U;
  }
  EXPECT_EQ(different, 0U);
}

TEST_P(EachKtx2, ReadsItsSizeFromTheHeader) {
  const auto image =
      core::read_image_header(read_file(std::string(GetParam().name).append(".ktx2")));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width, GetParam().width);
  EXPECT_EQ(image->channels, GetParam().channels);
  EXPECT_TRUE(image->bytes.empty());
}

// Every truncation is refused: missing bytes are detected, and no byte beyond the end is read.
TEST_P(EachKtx2, RefusesTruncatedFiles) {
  const Bytes file = read_file(std::string(GetParam().name).append(".ktx2"));
  for (std::size_t size = 0; size + 1 < file.size(); size += 1 + file.size() / 300) {
    const Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(core::decode_ktx2(cut, {}).has_value()) << size;
  }
}

INSTANTIATE_TEST_SUITE_P(Ktx2, EachKtx2,
                         testing::Values(File{"etc1s", 36, 28, 3}, File{"etc1s_alpha", 36, 28, 4},
                                         File{"etc1s_odd", 5, 7, 4}, File{"uastc", 36, 28, 3},
                                         File{"uastc_zstd", 36, 28, 4},
                                         File{"uastc_modes", 128, 128, 4}),
                         [](const auto& file) { return file.param.name; });

TEST(Ktx2, RefusesALargeSizeBeforeAllocatingMemory) {
  Bytes file = read_file("etc1s.ktx2");
  put_u32(file, 20, 1U << 31U);
  const auto image = core::decode_ktx2(file, {});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

TEST(Ktx2, EnforcesThePixelLimit) {
  const auto image =
      core::decode_ktx2(read_file("uastc.ktx2"), {.decoded_bytes_max = 36 * 28 * 3 - 1});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, core::ErrorCode::kTooLarge);
}

// A Zstandard file whose content is larger than its image: the image declares half the height.
TEST(Ktx2, RefusesZstandardBeyondTheImage) {
  Bytes file = read_file("uastc_zstd.ktx2");
  put_u32(file, 24, 12);
  EXPECT_FALSE(core::decode_ktx2(file, {}).has_value());
}

TEST(Ktx2, RefusesCubesLayersAndVolumes) {
  for (const std::size_t field : {28U, 32U, 36U}) {
    Bytes file = read_file("uastc.ktx2");
    put_u32(file, field, 6);
    EXPECT_FALSE(core::decode_ktx2(file, {}).has_value()) << field;
  }
}

TEST(Ktx2, RefusesOtherCodecsByName) {
  Bytes file = read_file("uastc.ktx2");
  const std::size_t model = get_u32(file, 48) + 12;
  file.at(model) = std::byte{162};  // ASTC
  const auto image = core::decode_ktx2(file, {});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().message,
            "ktx2: its pixels are neither ETC1S nor UASTC, which is what glTF allows");
}

// Supercompression scheme 3 is ZLIB, which KHR_texture_basisu excludes.
TEST(Ktx2, RefusesOtherCompression) {
  Bytes file = read_file("uastc.ktx2");
  put_u32(file, 44, 3);
  EXPECT_FALSE(core::decode_ktx2(file, {}).has_value());
  put_u32(file, 44, 1);  // BasisLZ
  EXPECT_FALSE(core::decode_ktx2(file, {}).has_value());
}

TEST(Ktx2, RefusesVideoFrames) {
  Bytes file = read_file("etc1s.ktx2");
  const std::size_t global = get_u32(file, 64);
  put_u32(file, global + 20, 2);  // isPFrame
  EXPECT_FALSE(core::decode_ktx2(file, {}).has_value());
}

// Changes every byte of the codebooks and of the blocks in turn: the result is an image or an
// error, and wrong counts and lengths cause no read out of bounds.
TEST(Ktx2, CorruptedBytesAreHarmless) {
  const Bytes whole = read_file("etc1s_odd.ktx2");
  int refused = 0;
  for (std::size_t i = 12; i < whole.size(); ++i) {
    Bytes file = whole;
    file[i] ^= std::byte{0xFF};
    const auto image = core::decode_ktx2(file, {});
    refused += image ? 0 : 1;
    if (image) {
      EXPECT_EQ(image->bytes.size(), image->value_count());
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(Uastc, RefusesTheReservedMode) {
  std::array<std::byte, core::kUastcBlockBytes> block{};
  block[0] = std::byte{0x45};
  EXPECT_FALSE(core::decode_uastc_block(block).has_value());
}

// Mode 8: five bits of code, then red, green, blue and alpha.
TEST(Uastc, SolidColorIsTheColor) {
  std::array<std::byte, core::kUastcBlockBytes> block{};
  const std::uint64_t bits = 0x17 | 10ULL << 5U | 20ULL << 13U | 30ULL << 21U | 40ULL << 29U;
  for (std::size_t i = 0; i < 8; ++i) {
    block[i] = static_cast<std::byte>(bits >> (8 * i));
  }
  const auto texels = core::decode_uastc_block(block);
  ASSERT_TRUE(texels);
  EXPECT_EQ((*texels)[15], (std::array<std::uint8_t, 4>{10, 20, 30, 40}));
}

TEST(Uastc, RefusesAPartitionBeyondTheList) {
  std::array<std::byte, core::kUastcBlockBytes> block{};
  block[0] = std::byte{0x1D};  // mode 2: 30 partitions
  block[2] = std::byte{0xF0};  // bits 20 to 23
  block[3] = std::byte{0x01};  // and 24: 31
  EXPECT_FALSE(core::decode_uastc_block(block).has_value());
}

/// A table of `symbols` symbols with codes of one bit each.
Bytes table_of_one_bit_codes(std::uint32_t symbols) {
  std::vector<bool> bits;
  const auto put = [&bits](std::uint32_t value, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      bits.push_back(((value >> i) & 1U) != 0);
    }
  };
  put(symbols, 14);
  put(21, 5);
  for (std::size_t i = 0; i < 21; ++i) {
    put(i == 18 ? 1 : 0, 3);  // the code for a length of 1 is the 19th, and the only one
  }
  put(0, symbols);
  Bytes bytes((bits.size() + 7) / 8);
  for (std::size_t i = 0; i < bits.size(); ++i) {
    bytes[i / 8] |= static_cast<std::byte>((bits[i] ? 1U : 0U) << (i % 8));
  }
  return bytes;
}

TEST(BasisHuffman, AcceptsTwoCodesOfOneBit) {
  const Bytes bytes = table_of_one_bit_codes(2);
  core::BitReader bits(bytes);
  const auto table = core::BasisHuffman::read(bits);
  ASSERT_TRUE(table);
  const std::array symbols = {std::byte{0b10}};
  core::BitReader data(symbols);
  EXPECT_EQ(table->decode(data), 0U);
  EXPECT_EQ(table->decode(data), 1U);
}

TEST(BasisHuffman, RefusesThreeCodesOfOneBit) {
  const Bytes bytes = table_of_one_bit_codes(3);
  core::BitReader bits(bytes);
  EXPECT_FALSE(core::BasisHuffman::read(bits).has_value());
}

}  // namespace
