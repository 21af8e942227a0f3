/// Environment: light from infinitely far away, by direction; constant or an equirectangular map.
///
/// A direction d (unit, world) reads u = 0.5 + atan2(d.z, d.x) / 2pi, v = acos(d.y) / pi, row 0 on
/// top. A positive rotation turns the environment counter-clockwise seen from above (from +y).
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

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

/// What directions are sampled by. kRadiance: in proportion to it, wherever there is any.
/// kCompensated: only where it is above kCompensation of its mean, and the more the brighter; for
/// those who also sample the BSDF and weight both by their densities, as dark places are then found
/// by the BSDF; LightSampler samples a sky without a map by the cosine then.
/// Source: Karlik et al., MIS Compensation, ACM TOG 38(6), 2019, eq. 15.
enum class SkyDensity { kRadiance, kCompensated };
/// The paper takes all of the mean away; half of it leaves light samples more of the sky, and on
/// products both do as well. 1/(V T) against kRadiance at 16 samples: products under three maps 1.1
/// to 1.6, a hall 1.3, glass 1.05, rooms with lights 1.0.
inline constexpr float kCompensation = 0.5F;

/// A disc of even radiance, infinitely far away, before the map.
struct SunDisc {
  Vec3 direction;  ///< unit, to it, in the map's frame
  Rgb radiance;
  float angular_radius_rad = 0;
};

class Environment {
 public:
  /// image: null for a constant environment of settings.color * settings.intensity; else an RGB
  /// image (any PixelType; 8-bit is taken as sRGB) multiplied by both. sun: before the image, and
  /// multiplied too; null: none.
  /// Errors: kInvalidArgument for an image without three channels or with negative or NaN pixels.
  static Result<std::shared_ptr<const Environment>> create(const Image* image,
                                                           const EnvironmentSettings& settings,
                                                           const SunDisc* sun = nullptr);

  /// Constant over each texel, so that light sampling matches it exactly.
  Rgb radiance(Vec3 direction_world) const noexcept;
  /// Bilinear between texels: as seen directly, or in mirrors and clear glass.
  Rgb background(Vec3 direction_world) const noexcept;
  /// The background as if out of focus. The first call takes the time to blur it.
  Rgb blurred(Vec3 direction_world) const;
  EnvironmentSample sample(Vec2 u, SkyDensity density = SkyDensity::kRadiance) const noexcept;
  float pdf_solid_angle(Vec3 direction_world,
                        SkyDensity density = SkyDensity::kRadiance) const noexcept;
  /// The same where the direction's point of the map is known, [0, 1) both ways, and the sine of
  /// its angle to the pole.
  float pdf_solid_angle(Vec3 direction_world, Vec2 uv, float sin_theta,
                        SkyDensity density) const noexcept;

  bool has_sun() const noexcept { return prob_sun_ > 0; }
  /// What the sun alone adds to radiance() and background().
  Rgb sun_radiance(Vec3 direction_world) const noexcept {
    const Vec3 apart = direction_world - sun_world_;
    return dot(apart, apart) < sun_chord_squared_ ? sun_.radiance : Rgb{};
  }

  /// Of a surface that faces the sun, by it alone.
  Rgb sun_irradiance() const noexcept { return sun_.radiance * sun_solid_angle_; }
  Vec3 sun_world() const noexcept { return sun_world_; }  ///< direction to it, unit

  /// What is read at a direction, without the sun, for those who read for many at once.
  struct Map {
    const Rgb* texels = nullptr;  ///< rows from the top; one more lies behind the last
    int width = 0;                ///< 0: `constant` everywhere
    int height = 0;
    Rgb constant;
    float cos_rotation = 1;
    float sin_rotation = 0;
  };
  Map map() const noexcept {
    return {texels_.data(), width_, height_, constant_, cos_rotation_, sin_rotation_};
  }

  /// What sample() draws from where there is a map, over (u, v).
  const Distribution2D& distribution(SkyDensity density) const noexcept {
    return distribution_[static_cast<std::size_t>(density)];
  }

  /// Integral of luminance over the sphere [W/m^2].
  float power_luminance() const noexcept { return power_luminance_; }
  bool is_black() const noexcept { return !(power_luminance_ > 0); }
  bool is_constant() const noexcept { return width_ == 0; }

 private:
  Environment() = default;
  Vec3 to_map(Vec3 d) const noexcept;
  Vec3 from_map(Vec3 d) const noexcept;
  Rgb texel(int x, int y) const noexcept;
  EnvironmentSample sample_map(Vec2 u, SkyDensity density) const noexcept;
  EnvironmentSample sample_sun(Vec2 u, SkyDensity density) const noexcept;
  float pdf_map(Vec2 uv, float sin_theta, SkyDensity density) const noexcept;
  void blur() const;

  Rgb constant_;
  int width_ = 0;  ///< 0: constant
  int height_ = 0;
  std::vector<Rgb> texels_;
  Distribution2D distribution_[2];  ///< [SkyDensity]
  float cos_rotation_ = 1;
  float sin_rotation_ = 0;
  float power_luminance_ = 0;
  SunDisc sun_;
  Vec3 sun_world_;
  float sun_chord_squared_ = 0;  ///< of its edge and centre as unit vectors; 0: there is none
  float sun_solid_angle_ = 0;
  float prob_sun_ = 0;  ///< with which samples are of it
  mutable std::once_flag is_blurred_;
  mutable std::vector<Rgb> blurred_;
};

}  // namespace core
