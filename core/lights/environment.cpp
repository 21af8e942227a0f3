#include "core/lights/environment.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/math/numbers.h"
#include "core/sampling/warp.h"
#include "core/textures/texture.h"

namespace core {
namespace {

struct MapPoint {
  float u = 0;
  float v = 0;
  float sin_theta = 0;
};

/// d: unit, in the map's frame. Near the poles 1 - y^2 has no digits left and acos(y) few; x and z
/// have all of theirs.
MapPoint map_point(Vec3 d) noexcept {
  const float sin_theta = std::sqrt(d.x * d.x + d.z * d.z);
  return {0.5F + std::atan2(d.z, d.x) * (0.5F * kInvPi), std::atan2(sin_theta, d.y) * kInvPi,
          sin_theta};
}

}  // namespace

Vec3 Environment::to_map(Vec3 d) const noexcept {
  // Turning the map counter-clockwise seen from +y turns directions the other way before look-up.
  return {d.x * cos_rotation_ - d.z * sin_rotation_, d.y,
          d.x * sin_rotation_ + d.z * cos_rotation_};
}

Vec3 Environment::from_map(Vec3 d) const noexcept {
  return {d.x * cos_rotation_ + d.z * sin_rotation_, d.y,
          -d.x * sin_rotation_ + d.z * cos_rotation_};
}

Rgb Environment::texel(int x, int y) const noexcept {
  return texels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                 static_cast<std::size_t>(x)];
}

Result<std::shared_ptr<const Environment>> Environment::create(
    const Image* image, const EnvironmentSettings& settings) {
  std::shared_ptr<Environment> out(new Environment());
  out->visible_ = settings.visible;
  const Rgb scale = settings.color * settings.intensity;
  out->constant_ = scale;
  if (image == nullptr) {
    out->power_luminance_ = luminance(scale) * 4 * kPi;
    return std::shared_ptr<const Environment>(out);
  }
  if (image->channels < 3) {
    return Error{
        ErrorCode::kInvalidArgument,
        "an environment needs three channels; this image has " + std::to_string(image->channels),
        "/environment/asset"};
  }
  const float angle = settings.rotation_degrees * (kPi / 180);
  out->cos_rotation_ = std::cos(angle);
  out->sin_rotation_ = std::sin(angle);
  out->width_ = image->width;
  out->height_ = image->height;
  const std::vector<Vec4> decoded = linear_texels(*image, true);
  const auto w = static_cast<std::size_t>(image->width);
  const auto h = static_cast<std::size_t>(image->height);
  out->texels_.resize(w * h + 1);
  std::vector<float> weights(w * h);
  std::vector<float> solid_angles(h);
  double power = 0;
  for (std::size_t y = 0; y < h; ++y) {
    // The solid angle of a texel: dphi * (cos theta0 - cos theta1), exact.
    const float cos0 = std::cos(kPi * static_cast<float>(y) / static_cast<float>(h));
    const float cos1 = std::cos(kPi * static_cast<float>(y + 1) / static_cast<float>(h));
    const float solid_angle = kTwoPi / static_cast<float>(w) * (cos0 - cos1);
    solid_angles[y] = solid_angle;
    for (std::size_t x = 0; x < w; ++x) {
      const Vec4 c = decoded[y * w + x];
      const Rgb value = Rgb{c.x, c.y, c.z} * scale;
      if (!is_finite(value) || value.r < 0 || value.g < 0 || value.b < 0) {
        return Error{ErrorCode::kInvalidArgument,
                     "the environment has a negative or non-finite pixel at column " +
                         std::to_string(x) + ", row " + std::to_string(y),
                     "/environment/asset"};
      }
      out->texels_[y * w + x] = value;
      weights[y * w + x] = luminance(value) * solid_angle;
      power += static_cast<double>(weights[y * w + x]);
    }
  }
  out->power_luminance_ = static_cast<float>(power);
  out->distribution_[0] = Distribution2D(weights, image->width, image->height);
  const float least = kCompensation * out->power_luminance_ / (4 * kPi);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = std::max(weights[i] - least * solid_angles[i / w], 0.0F);
  }
  out->distribution_[1] = Distribution2D(weights, image->width, image->height);
  return std::shared_ptr<const Environment>(out);
}

Rgb Environment::radiance(Vec3 direction_world) const noexcept {
  if (width_ == 0) {
    return constant_;
  }
  // Constant over a texel: the sampling density below then matches exactly, and a picture of the
  // environment is its integral.
  const MapPoint at = map_point(to_map(direction_world));
  const int x = std::clamp(static_cast<int>(at.u * static_cast<float>(width_)), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(at.v * static_cast<float>(height_)), 0, height_ - 1);
  return texel(x, y);
}

Rgb Environment::background(Vec3 direction_world) const noexcept {
  if (width_ == 0) {
    return constant_;
  }
  const MapPoint at = map_point(to_map(direction_world));
  const float x = at.u * static_cast<float>(width_) - 0.5F;
  const float y = at.v * static_cast<float>(height_) - 0.5F;
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const int x0 = (static_cast<int>(fx) + width_) % width_;
  const int x1 = (x0 + 1) % width_;
  const int y0 = std::clamp(static_cast<int>(fy), 0, height_ - 1);
  const int y1 = std::clamp(static_cast<int>(fy) + 1, 0, height_ - 1);
  return lerp(lerp(texel(x0, y0), texel(x1, y0), x - fx),
              lerp(texel(x0, y1), texel(x1, y1), x - fx), y - fy);
}

EnvironmentSample Environment::sample(Vec2 u, SkyDensity density) const noexcept {
  EnvironmentSample s;
  if (width_ == 0) {
    s.wi_world = uniform_sphere(u);
    s.radiance = constant_;
    s.pdf_solid_angle = kInvPi * 0.25F;
    return s;
  }
  const auto at = distribution(density).sample(u);
  const float phi = kTwoPi * (at.uv.x - 0.5F);
  const float theta = kPi * at.uv.y;
  const float sin_theta = std::sin(theta);
  s.wi_world = from_map({sin_theta * std::cos(phi), std::cos(theta), sin_theta * std::sin(phi)});
  // Of the cell that was drawn: looked up again by direction, rounding would now and then pair a
  // bright texel with the density of its dark neighbour.
  s.radiance = texel(static_cast<int>(at.column), static_cast<int>(at.row));
  s.pdf_solid_angle = sin_theta > 0 ? at.pdf_unit / (2 * kPi * kPi * sin_theta) : 0.0F;
  return s;
}

float Environment::pdf_solid_angle(Vec3 direction_world, SkyDensity density) const noexcept {
  const MapPoint at = map_point(to_map(direction_world));
  return pdf_solid_angle({at.u, at.v}, at.sin_theta, density);
}

float Environment::pdf_solid_angle(Vec2 uv, float sin_theta, SkyDensity density) const noexcept {
  if (width_ == 0) {
    return kInvPi * 0.25F;
  }
  return sin_theta > 0 ? distribution(density).pdf_unit(uv) / (2 * kPi * kPi * sin_theta) : 0.0F;
}

}  // namespace core
