// Automatic exposure: the formula of its header on films with known pixels.
#include "core/layers/exposure.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "core/film/film.h"
#include "core/film/half_sums.h"

namespace {

using core::Brightness;
using core::Rgb;

constexpr int kSide = 20;

/// A pixel: premultiplied colour and alpha.
struct Pixel {
  Rgb color;
  float alpha = 1;
};

/// pixel(i): of kSide * kSide, row by row.
Brightness brightness(const std::function<Pixel(int)>& pixel) {
  const core::FilmSettings settings = {
      .width = kSide, .height = kSide, .crop = {}, .filter = {}, .shares = {}};
  core::Film film(settings, 2);
  core::TileState state = film.tile(0);  // the film is one tile
  state.samples = 2;
  for (std::size_t i = 0; i < state.pixels.size(); ++i) {
    const Pixel p = pixel(static_cast<int>(i / 2));
    core::ReplicatePixel& to = state.pixels[i];
    to.mean_r = p.color.r;
    to.mean_g = p.color.g;
    to.mean_b = p.color.b;
    to.mean_alpha = p.alpha;
    to.count = 1;
  }
  film.commit(0, state);
  return core::brightness_of(film, settings);
}

Brightness grey(const std::function<float(int)>& light) {
  return brightness([&](int i) { return Pixel{Rgb(light(i)), 1}; });
}

/// Quantiles are middles of bins of 1/64 stop, which enter the key twice; the result is rounded to
/// 0.1.
constexpr double kRounding = 0.05 + 4.0 / 128;

TEST(AutoExposure, MapsAnEvenImageToMiddleGrey) {
  EXPECT_NEAR(grey([](int) { return 0.18F; }).auto_exposure, 0, kRounding);
  EXPECT_NEAR(grey([](int) { return 3000.0F; }).auto_exposure, std::log2(0.18 / 3000), kRounding);
}

TEST(AutoExposure, FollowsReinhardsKeyForBrightAndDarkImages) {
  // 5% at 2^-8 and the rest at 1: low is -8, high 0, the log-average -0.4, so f is 7.2 / 8.
  const auto bright = grey([](int i) { return i % 20 == 0 ? 0x1p-8F : 1.0F; });
  EXPECT_NEAR(bright.auto_exposure, std::min(0.0, std::log2(0.18) + 2 * 7.2 / 8 + 0.4), kRounding);
  // The other way round: f is -7.2 / 8, and the log-average -7.6. At most a tenth is above 1.
  const auto dark = grey([](int i) { return i % 20 == 0 ? 1.0F : 0x1p-8F; });
  EXPECT_NEAR(dark.auto_exposure, std::log2(0.18) - 2 * 7.2 / 8 + 7.6, kRounding);
}

TEST(AutoExposure, KeepsNineTenthsBelowWhite) {
  // A fifth is 2^10 times as bright as the rest: the log-average would put it at 2^4.5.
  const auto light = grey([](int i) { return i % 5 == 0 ? 1.0F : 0x1p-10F; });
  EXPECT_NEAR(light.auto_exposure, 0, kRounding);
}

TEST(AutoExposure, ScalesWithTheLight) {
  const auto at = [](float scale) {
    return grey([scale](int i) { return scale * static_cast<float>(1 + i % 37); }).auto_exposure;
  };
  EXPECT_NEAR(at(1024) + 10, at(1), 1e-9);
  EXPECT_NEAR(at(0x1p-12F) - 12, at(1), 1e-9);
}

TEST(AutoExposure, IgnoresWhatIsTransparentOrBlack) {
  const double plain = grey([](int i) { return i % 2 == 0 ? 40.0F : 90.0F; }).auto_exposure;
  const auto with = [](Pixel rest) {
    return brightness([rest](int i) {
             return i < kSide * kSide / 2 ? rest : Pixel{Rgb(i % 2 == 0 ? 40.0F : 90.0F), 1};
           })
        .auto_exposure;
  };
  EXPECT_EQ(with({Rgb(1e6F), 0}), plain);
  EXPECT_EQ(with({Rgb(0), 1}), plain);
  EXPECT_NE(with({Rgb(1e6F), 1}), plain) << "a planted fault";
  // Premultiplied: half covered by the same colours.
  const auto half = brightness([](int i) { return Pixel{Rgb(i % 2 == 0 ? 20.0F : 45.0F), 0.5F}; });
  EXPECT_EQ(half.auto_exposure, plain);
}

TEST(AutoExposure, OfABlackImageIsZero) {
  const Brightness black = grey([](int) { return 0.0F; });
  EXPECT_EQ(black.auto_exposure, 0);
  EXPECT_FALSE(black.is_clipped());
}

TEST(Clipping, MostPixelsAboveWhiteAreReportedWithTheExposureThatShowsThem) {
  const Brightness most = grey([](int i) { return i % 10 == 0 ? 0.5F : 100.0F; });
  EXPECT_TRUE(most.is_clipped());
  EXPECT_DOUBLE_EQ(most.clipped, 0.9);
  EXPECT_EQ(core::clipped_warning(most, "--exposure "),
            "90 % of the pixels are above 1; --exposure " +
                core::exposure_text(most.auto_exposure) + " shows them");
  EXPECT_FALSE(grey([](int i) { return i % 2 == 0 ? 2.0F : 0.5F; }).is_clipped());
  EXPECT_FALSE(grey([](int) { return 1.0F; }).is_clipped()) << "white is not above 1";
}

}  // namespace
