// Mipmap levels of textures, and lookups shared between textures.
#include "core/textures/texture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::Image;
using core::Texture;
using core::Vec4;

Image image_of(int width, int height, int channels, test_support::Random& random) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.bytes.resize(image.value_count());
  for (std::byte& byte : image.bytes) {
    byte = static_cast<std::byte>(random.bits() & 255U);
  }
  return image;
}

// IEC 61966-2-1.
double linear_of(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }
double srgb_of(double c) {
  return c <= 0.0031308 ? c * 12.92 : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
}

/// The coarsest level, which a footprint of many repeats reads, also if the image is much longer
/// in one direction than in the other.
Vec4 coarsest_of(const Texture& texture) {
  Texture::Lookup at;
  at.uv = {0.5F, 0.5F};
  at.across = {64, 0};
  at.along = {0, 64};
  return texture.sample(at);
}

/// The largest distance, in steps of 1/255, between the 1x1 level of 2x2 images and the mean of
/// their texels in linear light. scale: 1, or a fault.
double worst_rounding(int channels, bool srgb, double scale = 1) {
  test_support::Random random(8);
  double worst = 0;
  for (int round = 0; round < 20'000; ++round) {
    const Image image = image_of(2, 2, channels, random);
    const Vec4 coarsest = coarsest_of(*Texture::create(image, srgb));
    const bool grey = channels <= 2;
    for (int c = 0; c < (grey ? 1 : 3); ++c) {
      double sum = 0;
      for (int i = 0; i < 4; ++i) {
        const double v =
            std::to_integer<int>(image.bytes[static_cast<std::size_t>(i * channels + c)]) / 255.0;
        sum += (srgb ? linear_of(v) : v) / 4;
      }
      const double found = c == 0 ? coarsest.x : c == 1 ? coarsest.y : coarsest.z;
      const double steps = srgb ? srgb_of(found) - srgb_of(sum * scale) : found - sum * scale;
      worst = std::max(worst, std::fabs(steps) * 255);
    }
  }
  return worst;
}

TEST(TextureLevels, RoundTheLinearMeanToTheNearestStep) {
  for (const int channels : {1, 2, 3, 4}) {
    EXPECT_LE(worst_rounding(channels, true), 0.5001) << channels;
    EXPECT_LE(worst_rounding(channels, false), 0.5001) << channels;
  }
}

// The planted fault.
TEST(TextureLevels, DetectOnePercentMoreLight) { EXPECT_GT(worst_rounding(3, true, 1.01), 0.55); }

TEST(TextureLevels, HalveOddAndNarrowImages) {
  test_support::Random random(2);
  for (const auto& [width, height] : {std::pair{1, 7}, {5, 1}, {3, 5}, {1, 1}}) {
    const auto texture = Texture::create(image_of(width, height, 4, random), false);
    const Vec4 mean = texture->mean();
    EXPECT_TRUE(mean.x >= 0 && mean.x <= 1 && mean.w >= 0 && mean.w <= 1);
  }
}

/// Float images are not rounded: each level must keep the sum over the area.
Image ramp_of(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = 3;
  image.type = core::PixelType::kF32;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // The last column and row are the brightest.
      for (const float v : {static_cast<float>(x == width - 1), static_cast<float>(y == height - 1),
                            static_cast<float>((x + 1) * (y + 1))}) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&v);
        image.bytes.insert(image.bytes.end(), bytes, bytes + sizeof v);
      }
    }
  }
  return image;
}

TEST(TextureLevels, KeepTheMeanOfEverySize) {
  for (int width = 1; width <= 17; ++width) {
    for (const int height : {1, 2, 3, 6, 7, 31}) {
      const auto texture = Texture::create(ramp_of(width, height), false);
      const auto w = static_cast<float>(width);
      const auto h = static_cast<float>(height);
      const float product = (w + 1) * (h + 1) / 4;
      for (const Vec4& found : {coarsest_of(*texture), texture->mean()}) {
        EXPECT_NEAR(found.x * w, 1, 1e-5F) << width << 'x' << height;
        EXPECT_NEAR(found.y * h, 1, 1e-5F) << width << 'x' << height;
        EXPECT_NEAR(found.z / product, 1, 1e-5F) << width << 'x' << height;
      }
    }
  }
}

TEST(TextureLevels, OfBytesKeepTheLastColumn) {
  // Black but for the last of 2^k - 1 columns, whose share halving would lose; sRGB and data.
  for (const bool srgb : {false, true}) {
    Image image;
    image.width = 7;
    image.height = 1;
    image.channels = 1;
    image.bytes.assign(7, std::byte{0});
    image.bytes[6] = std::byte{255};
    const float found = coarsest_of(*Texture::create(image, srgb)).x;
    // Two roundings to 255 steps, of up to 1/100 in linear light near 1/7.
    EXPECT_NEAR(found, 1.0F / 7, srgb ? 0.006F : 0.004F);
  }
}

TEST(TextureMean, IsThatOfTheTexelsNotOfRoundedLevels) {
  Image image;
  image.width = 64;
  image.height = 64;
  image.channels = 1;
  image.bytes.assign(64 * 64, std::byte{0});
  image.bytes[100] = std::byte{255};
  EXPECT_NEAR(Texture::create(image, true)->mean().x * 64 * 64, 1, 1e-5F);
}

TEST(TextureTaps, OfOneTextureApplyToAnotherOfItsSize) {
  test_support::Random random(6);
  const auto a = Texture::create(image_of(37, 20, 3, random), true);
  const auto b = Texture::create(image_of(37, 20, 4, random), false);
  for (int round = 0; round < 2000; ++round) {
    Texture::Lookup at;
    at.uv = {4 * random.uniform() - 2, 4 * random.uniform() - 2};
    at.across = {0.1F * random.uniform(), 0.01F};
    at.along = {0.02F, 0.3F * random.uniform()};
    at.taps_max = round % 2 == 0 ? 1 : core::kTextureTapsMax;
    at.wrap_u = core::TextureWrap::kMirroredRepeat;
    at.nearest = round % 5 == 0;
    Texture::Taps taps;
    a->find_taps(at, taps);
    const Vec4 shared = b->read(taps);
    const Vec4 own = b->sample(at);
    EXPECT_TRUE(shared.x == own.x && shared.y == own.y && shared.w == own.w);
    float weights = 0;
    for (int i = 0; i < taps.count; ++i) {
      weights += taps.tap[static_cast<std::size_t>(i)].weight;
    }
    EXPECT_NEAR(weights, 1, 1e-5F);
  }
}

TEST(TextureTaps, RepeatExactlyFarOut) {
  test_support::Random random(7);
  const auto texture = Texture::create(image_of(61, 20, 3, random), false);
  for (const auto wrap : {core::TextureWrap::kRepeat, core::TextureWrap::kMirroredRepeat}) {
    for (int round = 0; round < 200; ++round) {
      // With 12 binary digits after the point, both sums are exact.
      const auto part = [&] { return std::floor(random.uniform() * 4096) / 4096; };
      Texture::Lookup at;
      at.uv = {part(), part()};
      at.wrap_u = at.wrap_v = wrap;
      const Vec4 near = texture->sample(at);
      at.uv = {at.uv.x + 2046, at.uv.y - 2048};
      const Vec4 far = texture->sample(at);
      EXPECT_TRUE(near.x == far.x && near.y == far.y && near.z == far.z);
    }
  }
}

TEST(TextureTaps, OfAFootprintThatIsNoNumberAreThoseOfTheFinestLevel) {
  test_support::Random random(8);
  const auto texture = Texture::create(image_of(16, 16, 3, random), false);
  Texture::Lookup at;
  at.uv = {0.3F, 0.7F};
  const Vec4 finest = texture->sample(at);
  for (const int taps_max : {1, core::kTextureTapsMax}) {
    at.taps_max = taps_max;
    at.across = {0.01F, 0};
    at.along = {std::nanf(""), 0.01F};
    const Vec4 found = texture->sample(at);
    EXPECT_TRUE(found.x == finest.x && found.y == finest.y && found.z == finest.z);
  }
}

}  // namespace
