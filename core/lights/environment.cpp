#include "core/lights/environment.h"

#include <algorithm>
#include <cmath>

#include "core/image_io/radiance.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Size of the map that blurred() reads, and width of the lobe that blurs it: a von Mises-Fisher
/// distribution, whose standard deviation on the sphere is about 1 / sqrt(concentration) per axis.
constexpr int kBlurredWidth = 128;
constexpr int kBlurredHeight = 64;
constexpr float kBlurRadians = 7 * kPi / 180;

/// Returns the solid angle of a texel: dphi * (cos theta0 - cos theta1), exact.
float texel_solid_angle(std::size_t row, std::size_t rows, std::size_t columns) noexcept {
  const float cos0 = std::cos(kPi * static_cast<float>(row) / static_cast<float>(rows));
  const float cos1 = std::cos(kPi * static_cast<float>(row + 1) / static_cast<float>(rows));
  return kTwoPi / static_cast<float>(columns) * (cos0 - cos1);
}

}  // namespace

Result<std::shared_ptr<const Environment>> Environment::create(const Image* image,
                                                               const EnvironmentSettings& settings,
                                                               const SunDisc* sun) {
  std::shared_ptr<Environment> out(new Environment());
  const Rgb scale = settings.color * settings.intensity;
  out->constant_ = scale;
  if (image == nullptr) {
    out->power_luminance_ = luminance(scale) * 4 * kPi;
    return std::shared_ptr<const Environment>(out);
  }
  const float angle = settings.rotation_degrees * (kPi / 180);
  out->cos_rotation_ = std::cos(angle);
  out->sin_rotation_ = std::sin(angle);
  out->width_ = image->width;
  out->height_ = image->height;
  const std::vector<Rgb> light = radiance_of(*image, AlphaUse::kIgnored);
  const auto w = static_cast<std::size_t>(image->width);
  const auto h = static_cast<std::size_t>(image->height);
  out->texels_.resize(w * h + 1);
  std::vector<float> weights(w * h);
  std::vector<float> solid_angles(h);
  double power = 0;
  for (std::size_t y = 0; y < h; ++y) {
    const float solid_angle = texel_solid_angle(y, h, w);
    solid_angles[y] = solid_angle;
    for (std::size_t x = 0; x < w; ++x) {
      const Rgb value = light[y * w + x] * scale;
      if (!is_finite(value)) {
        return Error{ErrorCode::kInvalidArgument,
                     "multiplied by its intensity, the environment exceeds the range of floats",
                     "/environment/intensity"};
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
  if (sun != nullptr && !core::is_black(sun->radiance * scale)) {
    const float half = std::sin(0.5F * sun->angular_radius_rad);
    out->sun_ = *sun;
    out->sun_.radiance *= scale;
    out->sun_world_ = out->map().to_world(sun->direction);
    out->sun_chord_squared_ = 4 * half * half;
    out->sun_solid_angle_ = kPi * out->sun_chord_squared_;  // 2 pi (1 - cos), as 4 pi sin^2
    const float fluence = luminance(out->sun_.radiance) * out->sun_solid_angle_;
    out->power_luminance_ += fluence;
    out->prob_sun_ = fluence / out->power_luminance_;
  }
  return std::shared_ptr<const Environment>(out);
}

Rgb Environment::radiance(Vec3 direction_world) const noexcept {
  if (is_constant()) {
    return constant_;
  }
  const Rgb seen = map().radiance(map().point(direction_world));
  return has_sun() ? seen + sun_radiance(direction_world) : seen;
}

Rgb Environment::background(Vec3 direction_world) const noexcept {
  if (is_constant()) {
    return constant_;
  }
  const Rgb seen = map().background(map().point(direction_world));
  return has_sun() ? seen + sun_radiance(direction_world) : seen;
}

Rgb Environment::blurred(Vec3 direction_world) const {
  if (is_constant()) {
    return constant_;
  }
  std::call_once(is_blurred_, [this] { blur(); });
  Map blurred = map();
  blurred.texels = blurred_.data();
  blurred.width = kBlurredWidth;
  blurred.height = kBlurredHeight;
  return blurred.background(blurred.point(direction_world));
}

void Environment::blur() const {
  constexpr auto kWidth = static_cast<std::size_t>(kBlurredWidth);
  constexpr auto kHeight = static_cast<std::size_t>(kBlurredHeight);
  std::vector<Rgb> energy(kWidth * kHeight);
  std::vector<float> solid_angles(kWidth * kHeight);
  const auto add = [&](const MapPoint<float>& at, Rgb fluence, float solid_angle) {
    const std::size_t x = std::min(static_cast<std::size_t>(at.u * kWidth), kWidth - 1);
    const std::size_t y = std::min(static_cast<std::size_t>(at.v * kHeight), kHeight - 1);
    energy[y * kWidth + x] += fluence;
    solid_angles[y * kWidth + x] += solid_angle;
  };
  // Adds every texel to a cell, in parts if cells are smaller.
  const std::size_t parts_x =
      (kWidth + static_cast<std::size_t>(width_) - 1) / static_cast<std::size_t>(width_) * 2;
  const std::size_t parts_y =
      (kHeight + static_cast<std::size_t>(height_) - 1) / static_cast<std::size_t>(height_) * 2;
  const std::size_t columns = static_cast<std::size_t>(width_) * parts_x;
  const std::size_t rows = static_cast<std::size_t>(height_) * parts_y;
  for (std::size_t y = 0; y < rows; ++y) {
    const float solid_angle = texel_solid_angle(y, rows, columns);
    for (std::size_t x = 0; x < columns; ++x) {
      const MapPoint<float> at = {(static_cast<float>(x) + 0.5F) / static_cast<float>(columns),
                                  (static_cast<float>(y) + 0.5F) / static_cast<float>(rows)};
      add(at, texels_[y / parts_y * static_cast<std::size_t>(width_) + x / parts_x] * solid_angle,
          solid_angle);
    }
  }
  if (has_sun()) {
    add(map().point(sun_world_), sun_.radiance * sun_solid_angle_, 0);
  }
  const float concentration = 1 / (kBlurRadians * kBlurRadians);
  std::vector<float> lobe(kWidth);
  blurred_.assign(kWidth * kHeight + 1, {});
  for (std::size_t to = 0; to < kHeight; ++to) {
    std::vector<float> weight(kWidth);
    for (std::size_t from = 0; from < kHeight; ++from) {
      const float theta_to = kPi * (static_cast<float>(to) + 0.5F) / kHeight;
      const float theta_from = kPi * (static_cast<float>(from) + 0.5F) / kHeight;
      if (concentration * (std::cos(theta_to - theta_from) - 1) < -12) {  // below e^-12
        continue;
      }
      for (std::size_t k = 0; k < kWidth; ++k) {
        const float phi = kTwoPi * static_cast<float>(k) / kWidth;
        lobe[k] = std::exp(concentration *
                           (std::cos(theta_to - theta_from) - 1 -
                            std::sin(theta_to) * std::sin(theta_from) * (1 - std::cos(phi))));
      }
      for (std::size_t x = 0; x < kWidth; ++x) {
        for (std::size_t k = 0; k < kWidth; ++k) {
          const std::size_t cell = from * kWidth + (x + k) % kWidth;
          blurred_[to * kWidth + x] += energy[cell] * lobe[k];
          weight[x] += solid_angles[cell] * lobe[k];
        }
      }
    }
    for (std::size_t x = 0; x < kWidth; ++x) {
      blurred_[to * kWidth + x] *= 1 / weight[x];
    }
  }
}

/// Samples the disc or the map; the first number selects and is reused.
EnvironmentSample Environment::sample_sun(Vec2 u, SkyDensity density) const noexcept {
  if (u.x >= prob_sun_) {
    EnvironmentSample s = sample_map(Vec2{(u.x - prob_sun_) / (1 - prob_sun_), u.y}, density);
    const Rgb sun = sun_radiance(s.wi_world);
    s.radiance += sun;
    s.pdf_solid_angle = (1 - prob_sun_) * s.pdf_solid_angle +
                        (core::is_black(sun) ? 0.0F : prob_sun_ / sun_solid_angle_);
    return s;
  }
  EnvironmentSample s;
  s.wi_world = frame_from_normal(sun_world_)
                   .to_world(in_cone(u.x / prob_sun_ * 0.5F * sun_chord_squared_, u.y));
  s.radiance = radiance(s.wi_world);
  s.pdf_solid_angle =
      (1 - prob_sun_) * pdf_map(map().point(s.wi_world), density) + prob_sun_ / sun_solid_angle_;
  return s;
}

EnvironmentSample Environment::sample(Vec2 u, SkyDensity density) const noexcept {
  if (is_constant()) {
    return {uniform_sphere(u), constant_, kInvPi * 0.25F};
  }
  return has_sun() ? sample_sun(u, density) : sample_map(u, density);
}

float Environment::pdf_solid_angle(Vec3 direction_world, SkyDensity density) const noexcept {
  return is_constant() ? kInvPi * 0.25F
                       : pdf_solid_angle(direction_world, map().point(direction_world), density);
}

}  // namespace core
