#include "core/color/tone_map.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace {

using core::Rgb;
using core::ToneMap;

TEST(ToneMap, SrgbCurveMatchesTheStandard) {
  // IEC 61966-2-1: 12.92 v below 0.0031308, 1.055 v^(1/2.4) - 0.055 above.
  EXPECT_FLOAT_EQ(core::srgb_from_linear(0.001F), 0.01292F);
  EXPECT_NEAR(core::srgb_from_linear(0.5F), 0.735357F, 1e-6);
  EXPECT_FLOAT_EQ(core::srgb_from_linear(1), 1);
}

TEST(ToneMap, InverseSrgbCurveUndoesIt) {
  for (int i = 0; i <= 255; ++i) {
    const float v = static_cast<float>(i) / 255.0F;
    EXPECT_NEAR(core::srgb_from_linear(core::linear_from_srgb(v)), v, 2e-6);
  }
}

TEST(ToneMap, BytesAreTheRoundedCurve) {
  const auto rounded = [](float v) { return std::lround(255 * core::srgb_from_linear(v)); };
  const std::uint32_t most = std::bit_cast<std::uint32_t>(1.1F);
  for (std::uint32_t bits = 0; bits < most; bits += 997) {
    const auto v = std::bit_cast<float>(bits);
    ASSERT_EQ(core::srgb_byte(v), rounded(v)) << v;
  }
  // Around every step, which lies where the inverse curve leads half a byte.
  for (int byte = 0; byte < 255; ++byte) {
    const float step = core::linear_from_srgb((static_cast<float>(byte) + 0.5F) / 255);
    for (int i = -2000; i <= 2000; ++i) {
      const auto v =
          std::bit_cast<float>(std::bit_cast<std::uint32_t>(step) + static_cast<std::uint32_t>(i));
      ASSERT_EQ(core::srgb_byte(v), rounded(v)) << v;
    }
  }
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float v : {-1.0F, -kInfinity, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(core::srgb_byte(v), 0);
  }
  EXPECT_EQ(core::srgb_byte(kInfinity), 255);
}

TEST(ToneMap, LinearOnlyClips) {
  const Rgb c = core::apply_tone_map(ToneMap::kLinear, {0.25F, 2, -1});
  EXPECT_EQ(c, (Rgb{0.25F, 1, 0}));
}

TEST(ToneMap, NeutralKeepsMidtonesExceptForItsOffset) {
  // Khronos PBR Neutral: below the start of compression every channel is reduced by 0.04 if the
  // lowest is at least 0.08.
  const Rgb c = core::apply_tone_map(ToneMap::kKhronosNeutral, {0.5F, 0.3F, 0.2F});
  EXPECT_NEAR(core::linear_from_srgb(c.r), 0.46F, 1e-5);
  EXPECT_NEAR(core::linear_from_srgb(c.g), 0.26F, 1e-5);
  EXPECT_NEAR(core::linear_from_srgb(c.b), 0.16F, 1e-5);
}

TEST(ToneMap, NeutralOffsetOfDarkColorsIsQuadratic) {
  // x - 6.25 x^2 at x = 0.04: 0.03; the remainder is 0.01.
  const Rgb c = core::apply_tone_map(ToneMap::kKhronosNeutral, Rgb(0.04F));
  EXPECT_NEAR(core::linear_from_srgb(c.g), 0.01F, 1e-5);
}

TEST(ToneMap, NeutralCompressesPeaks) {
  // Grey 1.04: peak 1, new peak 1 - 0.24^2 / (1 + 0.24 - 0.76) = 0.88.
  const Rgb c = core::apply_tone_map(ToneMap::kKhronosNeutral, Rgb(1.04F));
  EXPECT_NEAR(core::linear_from_srgb(c.g), 0.88F, 1e-4);
}

TEST(ToneMap, AcesOfGreyFollowsHillsFit) {
  // Rows of both matrices sum to 1, so grey passes only the fit: (v (v + .0245786) - .000090537) /
  // (v (.983729 v + .4329510) + .238081) at v = 0.18.
  const double v = 0.18;
  const double fit =
      (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
  const Rgb c = core::apply_tone_map(ToneMap::kAces, Rgb(0.18F));
  EXPECT_NEAR(core::linear_from_srgb(c.g), fit, 1e-4);
}

TEST(ToneMap, AgxOfGreyFollowsItsPolynomial) {
  // log2(0.18) between -12.47393 and 4.026069 is at x = 0.6060623.
  const double x = (std::log2(0.18) + 12.47393) / (4.026069 + 12.47393);
  const double y = 15.5 * std::pow(x, 6) - 40.14 * std::pow(x, 5) + 31.96 * std::pow(x, 4) -
                   6.868 * std::pow(x, 3) + 0.4298 * x * x + 0.1191 * x - 0.00232;
  const Rgb c = core::apply_tone_map(ToneMap::kAgx, Rgb(0.18F));
  EXPECT_NEAR(core::linear_from_srgb(c.g), std::pow(y, 2.2), 1e-3);
}

TEST(ToneMap, EveryMapStaysInRangeAndIsMonotonicInGrey) {
  for (const core::ToneMapEntry& entry : core::tone_maps()) {
    float before = -1;
    for (int stop = -20; stop <= 20; ++stop) {
      const Rgb c = core::apply_tone_map(entry.tone_map, Rgb(std::exp2(static_cast<float>(stop))));
      EXPECT_GE(c.g, before) << entry.name << " at " << stop;
      EXPECT_GE(c.g, 0.0F);
      EXPECT_LE(c.g, 1.0F);
      before = c.g;
    }
  }
}

TEST(ToneMap, NanIsBlackAndInfinityIsBright) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const core::ToneMapEntry& entry : core::tone_maps()) {
    const Rgb black = core::apply_tone_map(entry.tone_map, Rgb(nan));
    EXPECT_LT(black.g, 0.01F) << entry.name;
    const Rgb white = core::apply_tone_map(entry.tone_map, Rgb(infinity));
    EXPECT_GT(white.g, 0.9F) << entry.name;
  }
}

}  // namespace
