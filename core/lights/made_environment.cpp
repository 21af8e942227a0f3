#include "core/lights/made_environment.h"

#include <cmath>
#include <cstring>

#include "core/lights/sky.h"
#include "core/lights/studio.h"
#include "core/math/numbers.h"

namespace core {
namespace {

/// Texels of 0.7 degrees: the soft edges of lights are four texels wide; the sun is separate.
constexpr int kWidth = 512;
constexpr int kHeight = 256;

/// Evaluates radiance at the texel centres, as Environment reads them.
template <typename Radiance>
Image map_of(Radiance&& radiance) {
  Image image;
  image.width = kWidth;
  image.height = kHeight;
  image.channels = 3;
  image.type = PixelType::kF32;
  image.bytes.resize(image.value_count() * sizeof(float));
  std::byte* out = image.bytes.data();
  for (int y = 0; y < kHeight; ++y) {
    const float theta = kPi * (static_cast<float>(y) + 0.5F) / kHeight;
    for (int x = 0; x < kWidth; ++x, out += 3 * sizeof(float)) {
      const float phi = kTwoPi * ((static_cast<float>(x) + 0.5F) / kWidth - 0.5F);
      const Rgb value = radiance(
          Vec3{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
      const float rgb[3] = {value.r, value.g, value.b};
      std::memcpy(out, rgb, sizeof(rgb));
    }
  }
  return image;
}

}  // namespace

Result<std::shared_ptr<const Environment>> make_environment(const EnvironmentSettings& settings) {
  if (settings.preset) {
    const Studio studio(*settings.preset);
    const Image map = map_of([&](Vec3 direction) { return studio.radiance(direction); });
    return Environment::create(&map, settings);
  }
  if (!settings.sun) {
    return Environment::create(nullptr, settings);
  }
  const SunPosition position = sun_position(*settings.sun);
  if (!(position.elevation_degrees > 0)) {
    return Error{ErrorCode::kInvalidArgument, "the sun is below the horizon at that time",
                 "/environment/sun/time"};
  }
  const Sky sky(position);
  const Image map = map_of([&](Vec3 direction) { return sky.radiance(direction); });
  return Environment::create(&map, settings, &sky.sun());
}

std::uint64_t made_environment_bytes(const EnvironmentSettings& settings) {
  constexpr std::uint64_t kTexelBytes = sizeof(Rgb) + 2 * sizeof(float);  // colour, distributions
  return settings.preset || settings.sun ? std::uint64_t{kWidth} * kHeight * kTexelBytes : 0;
}

}  // namespace core
