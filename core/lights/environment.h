/// Environment: light from infinitely far away, by direction; constant or an equirectangular map.
///
/// A direction d (unit, world) reads u = 0.5 + atan2(d.z, d.x) / 2pi, v = acos(d.y) / pi, row 0 on
/// top. A positive rotation turns the environment counter-clockwise seen from above (from +y).
#pragma once

#include <memory>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/image_io/image.h"
#include "core/math/vec.h"
#include "core/sampling/distribution.h"
#include "core/settings/settings.h"

namespace core {

struct EnvironmentSample {
  Vec3 wi_world;
  Rgb radiance;
  float pdf_solid_angle = 0;  ///< 0: nothing was sampled
};

class Environment {
 public:
  /// image: null for a constant environment of settings.color * settings.intensity; else an RGB
  /// image (any PixelType; 8-bit is taken as sRGB) multiplied by both.
  /// Errors: kInvalidArgument for an image without three channels or with negative or NaN pixels.
  static Result<std::shared_ptr<const Environment>> create(const Image* image,
                                                           const EnvironmentSettings& settings);

  /// Constant over each texel, so that light sampling matches it exactly.
  Rgb radiance(Vec3 direction_world) const noexcept;
  /// Bilinear between texels: what the eye sees directly, or in mirrors and clear glass.
  Rgb background(Vec3 direction_world) const noexcept;
  EnvironmentSample sample(Vec2 u) const noexcept;
  float pdf_solid_angle(Vec3 direction_world) const noexcept;
  /// Integral of luminance over the sphere [W/m^2].
  float power_luminance() const noexcept { return power_luminance_; }
  bool visible() const noexcept { return visible_; }
  bool is_black() const noexcept { return !(power_luminance_ > 0); }

 private:
  Environment() = default;
  Vec3 to_map(Vec3 d) const noexcept;
  Vec3 from_map(Vec3 d) const noexcept;
  Rgb texel(int x, int y) const noexcept;

  Rgb constant_;
  int width_ = 0;  ///< 0: constant
  int height_ = 0;
  std::vector<Rgb> texels_;
  Distribution2D distribution_;
  float cos_rotation_ = 1;
  float sin_rotation_ = 0;
  float power_luminance_ = 0;
  bool visible_ = true;
};

}  // namespace core
