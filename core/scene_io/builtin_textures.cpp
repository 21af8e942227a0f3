#include "core/scene_io/builtin_textures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/math/numbers.h"

namespace core {
namespace {

float hashed(int x, int y) {
  auto h =
      static_cast<std::uint32_t>(x) * 0x9E3779B1U ^ static_cast<std::uint32_t>(y) * 0x85EBCA77U;
  h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 12U)) * 0x297A2D39U;
  return static_cast<float>((h ^ (h >> 15U)) >> 8U) * 0x1p-24F;
}

// Returns smooth noise in [0,1] with periods of period_x and period_y cells.
float noise(float x, float y, int period_x, int period_y) {
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const auto wrap = [](int i, int n) { return ((i % n) + n) % n; };
  const int x0 = wrap(static_cast<int>(fx), period_x);
  const int y0 = wrap(static_cast<int>(fy), period_y);
  const int x1 = wrap(x0 + 1, period_x);
  const int y1 = wrap(y0 + 1, period_y);
  const auto smooth = [](float t) { return t * t * (3 - 2 * t); };
  const float u = smooth(x - fx);
  const float v = smooth(y - fy);
  return (1 - v) * ((1 - u) * hashed(x0, y0) + u * hashed(x1, y0)) +
         v * ((1 - u) * hashed(x0, y1) + u * hashed(x1, y1));
}

template <typename Paint>
Image painted(int width, int height, const Paint& paint) {
  Image image{width, height, 3, PixelType::kU8, {}};
  image.bytes.reserve(image.value_count());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb c = paint((static_cast<float>(x) + 0.5F) / static_cast<float>(width),
                          (static_cast<float>(y) + 0.5F) / static_cast<float>(height));
      for (int i = 0; i < 3; ++i) {
        image.bytes.push_back(
            static_cast<std::byte>(std::lround(std::clamp(c[i], 0.0F, 1.0F) * 255)));
      }
    }
  }
  return image;
}

}  // namespace

Image wood_planks(int side_px) {
  return painted(side_px, side_px, [](float u, float v) {
    constexpr int kPlanks = 4;
    const float across = v * kPlanks;
    const int plank = static_cast<int>(across);
    const float along = u + 0.37F * static_cast<float>(plank);
    const float joint = along - std::floor(along);
    const float tone = 0.82F + 0.3F * hashed(plank, static_cast<int>(std::floor(along)));
    const float warp = noise(u * 6, v * 12, 6, 12);
    const float rings = 0.5F + 0.5F * std::sin(kTwoPi * (across * 5 + 3 * warp));
    const float pores = noise(u * 24, v * 256, 24, 256);
    const float inside = across - static_cast<float>(plank);
    const bool seam = inside < 0.018F || joint < 0.004F;
    const float shade = tone * (0.86F + 0.1F * rings + 0.1F * pores) * (seam ? 0.35F : 1.0F);
    return Rgb{0.60F, 0.42F, 0.27F} * shade;
  });
}

Image woven_check(int side_px, Rgb light_srgb, Rgb dark_srgb) {
  return painted(side_px, side_px, [=](float u, float v) {
    const auto band = [](float t) { return t - std::floor(t) < 0.5F ? 0.0F : 1.0F; };
    const float check = 0.5F * (band(u * 4) + band(v * 4));
    const float thread = 0.9F + 0.1F * std::sin(kTwoPi * 64 * u) * std::sin(kTwoPi * 64 * v);
    return lerp(light_srgb, dark_srgb, check) * thread;
  });
}

Image rug(int width_px, int height_px) {
  const float aspect = static_cast<float>(width_px) / static_cast<float>(height_px);
  return painted(width_px, height_px, [aspect](float u, float v) {
    const float x = (u - 0.5F) * 2 * aspect;
    const float y = (v - 0.5F) * 2;
    const float edge = std::min(aspect - std::abs(x), 1 - std::abs(y));
    const Rgb red = {0.48F, 0.1F, 0.11F};
    const Rgb blue = {0.1F, 0.14F, 0.27F};
    const Rgb cream = {0.86F, 0.78F, 0.62F};
    const float knots = 0.9F + 0.1F * noise(u * 160, v * 160, 160, 160);
    const float diamond = std::abs(x) / aspect * 1.25F + std::abs(y);
    const float star = 0.5F + 0.5F * std::cos(8 * std::atan2(y, x));
    const float ornament = std::sin(17 * x) * std::sin(17 * y);
    Rgb c = ornament > 0.55F ? cream : red;
    if (diamond < 0.75F) {
      c = std::abs(diamond - 0.7F) < 0.03F ? cream : blue;
    }
    if (diamond < 0.38F + 0.1F * star) {
      c = diamond < 0.12F + 0.08F * star ? cream : red;
    }
    if (edge < 0.2F) {
      c = edge < 0.05F || (edge > 0.16F) ? cream : (std::sin(24 * (x + y)) > 0 ? blue : red);
    }
    return c * knots;
  });
}

Image painting(int width_px, int height_px) {
  return painted(width_px, height_px, [](float u, float v) {
    const float stroke = 0.06F * noise(u * 40, v * 90, 40, 90);
    Rgb c = lerp({0.93F, 0.68F, 0.42F}, {0.35F, 0.45F, 0.62F}, 1 - v * 1.3F);
    const float sun = std::hypot((u - 0.66F) * 1.35F, v - 0.36F);
    if (sun < 0.12F) {
      c = {0.98F, 0.86F, 0.6F};
    }
    for (int hill = 0; hill < 4; ++hill) {
      const auto h = static_cast<float>(hill);
      const float top = 0.48F + 0.12F * h +
                        0.05F * std::sin(kTwoPi * (u * (0.8F + 0.3F * h) + 0.21F * h)) +
                        0.02F * std::sin(kTwoPi * (u * 3.1F + 0.4F * h));
      if (v > top) {
        c = lerp({0.42F, 0.48F, 0.55F}, {0.12F, 0.22F, 0.16F}, h / 3);
      }
    }
    return c + Rgb(stroke - 0.03F);
  });
}

TextureDescription add_texture(SceneDescription& scene, Image image) {
  scene.images.push_back(std::make_shared<const Image>(std::move(image)));
  TextureDescription texture;
  texture.image = static_cast<int>(scene.images.size()) - 1;
  return texture;
}

}  // namespace core
