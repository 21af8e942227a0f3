// The light of an environment on the open ground: the integral of radiance times cos theta.
#include "core/lights/outdoor.h"

#include <cstring>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/image_io/image.h"

namespace {

constexpr double kPi = std::numbers::pi;

/// A map of 8 x 4 texels whose rows have these radiances.
std::shared_ptr<const core::Environment> banded(const std::vector<float>& rows,
                                                const core::SunDisc* sun = nullptr) {
  core::Image image;
  image.width = 8;
  image.height = static_cast<int>(rows.size());
  image.channels = 3;
  image.type = core::PixelType::kF32;
  std::vector<float> values;
  for (const float radiance : rows) {
    values.insert(values.end(), std::size_t{3} * 8, radiance);
  }
  image.bytes.resize(values.size() * sizeof(float));
  std::memcpy(image.bytes.data(), values.data(), image.bytes.size());
  return *core::Environment::create(&image, {}, sun);
}

TEST(Outdoor, UniformSkyGivesPiTimesItsRadiance) {
  core::EnvironmentSettings settings;
  settings.intensity = 3;
  const auto sky = core::Environment::create(nullptr, settings);
  EXPECT_NEAR(core::horizontal_irradiance(**sky), 3 * kPi, 1e-5);
  EXPECT_NEAR(core::horizontal_irradiance(*banded({3, 3, 3, 3})), 3 * kPi, 1e-5);
}

TEST(Outdoor, BandsAreWeightedByTheirCosine) {
  // A cap of 45 degrees around the zenith: pi sin^2 45 degrees. The band below it has the rest.
  EXPECT_NEAR(core::horizontal_irradiance(*banded({1, 0, 0, 0})), kPi / 2, 1e-6);
  EXPECT_NEAR(core::horizontal_irradiance(*banded({0, 1, 0, 0})), kPi / 2, 1e-6);
  EXPECT_EQ(core::horizontal_irradiance(*banded({0, 0, 1, 1})), 0) << "light from below";
}

TEST(Outdoor, TheSunCountsByItsHeight) {
  core::SunDisc sun;
  sun.direction = {0.6F, 0.8F, 0};
  sun.radiance = core::Rgb(1e6F);
  sun.angular_radius_rad = 0.00465F;
  // The solid angle of a small disc is pi r^2; the sky adds pi.
  const double expected = 0.8 * 1e6 * kPi * 0.00465 * 0.00465 + kPi;
  EXPECT_NEAR(core::horizontal_irradiance(*banded({1, 1, 1, 1}, &sun)), expected, 1e-4 * expected);
}

}  // namespace
