/// Environment: infinitely distant light, constant or an equirectangular map.
///
/// A direction d (unit, world) maps to u = 0.5 + atan2(d.z, d.x) / 2pi, v = acos(d.y) / pi, with
/// row 0 on top. A positive rotation turns the environment counter-clockwise seen from above (from
/// +y).
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/image_io/image.h"
#include "core/lights/environment_map.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

using EnvironmentSample = SkySample<float>;

/// The density of sampled directions. kRadiance: proportional to radiance. kCompensated:
/// proportional to the radiance above kCompensation times its mean, 0 elsewhere; for callers that
/// combine light and BSDF samples by MIS, since BSDF samples then find the dark parts. LightSampler
/// then samples a sky without a map by the cosine. Source: Karlik et al., MIS Compensation, ACM TOG
/// 38(6), 2019, eq. 15.
enum class SkyDensity { kRadiance, kCompensated };
/// The paper subtracts the whole mean. Half of it leaves more of the sky to light samples and is as
/// efficient on products. 1/(V T) relative to kRadiance at 16 samples: products under three maps
/// 1.1 to 1.6, a hall 1.3, glass 1.05, rooms with lights 1.0.
inline constexpr float kCompensation = 0.5F;

/// A disc of uniform radiance, infinitely distant, in front of the map.
struct SunDisc {
  Vec3 direction;  ///< unit, to the disc, in the map's frame
  Rgb radiance;
  float angular_radius_rad = 0;
};

class Environment {
 public:
  /// image: null for a constant environment of settings.color * settings.intensity; else an image
  /// as radiance_of() reads it (core/image_io/radiance.h), multiplied by both. sun: in front of the
  /// image and multiplied too; null if there is none. Errors: kInvalidArgument if a product is not
  /// finite.
  static Result<std::shared_ptr<const Environment>> create(const Image* image,
                                                           const EnvironmentSettings& settings,
                                                           const SunDisc* sun = nullptr);

  /// Returns the radiance, constant over each texel, so that light sampling matches it exactly.
  Rgb radiance(Vec3 direction_world) const noexcept;
  /// Returns the radiance with bilinear filtering, for direct view, mirrors and clear glass.
  Rgb background(Vec3 direction_world) const noexcept;
  /// Returns the background as if out of focus. The first call blurs the map.
  Rgb blurred(Vec3 direction_world) const;
  EnvironmentSample sample(Vec2 u, SkyDensity density = SkyDensity::kRadiance) const noexcept;
  float pdf_solid_angle(Vec3 direction_world,
                        SkyDensity density = SkyDensity::kRadiance) const noexcept;
  /// As above, for one direction or SIMD lanes; at: their positions on the map. Pre: not constant.
  template <typename V, typename F>
  F pdf_solid_angle(V direction_world, const MapPoint<F>& at, SkyDensity density) const noexcept {
    const F of_map = pdf_map(at, density);
    if (!has_sun()) {
      return of_map;
    }
    const F of_sun = select(is_in_sun(direction_world), F(prob_sun_ / sun_solid_angle_), F(0));
    return (1 - prob_sun_) * of_map + of_sun;
  }
  /// As above, but of the map without the sun.
  template <typename U>
  auto sample_map(U u, SkyDensity density) const noexcept {
    return map().sample(distribution(density), u);
  }
  template <typename F>
  F pdf_map(const MapPoint<F>& at, SkyDensity density) const noexcept {
    return map().pdf_solid_angle(distribution(density), at);
  }

  bool has_sun() const noexcept { return prob_sun_ > 0; }
  /// Returns the part of the sun in radiance() and background().
  Rgb sun_radiance(Vec3 direction_world) const noexcept {
    return is_in_sun(direction_world) ? sun_.radiance : Rgb{};
  }

  /// Returns the irradiance from the sun on a surface facing it.
  Rgb sun_irradiance() const noexcept { return sun_.radiance * sun_solid_angle_; }
  Vec3 sun_world() const noexcept { return sun_world_; }  ///< unit, to the sun

  using Map = EnvironmentMap;
  Map map() const noexcept {
    return {texels_.data(), width_, height_, constant_, cos_rotation_, sin_rotation_};
  }

  /// Returns the integral of luminance over the sphere [W/m^2].
  float power_luminance() const noexcept { return power_luminance_; }
  bool is_black() const noexcept { return !(power_luminance_ > 0); }
  bool is_constant() const noexcept { return width_ == 0; }

 private:
  Environment() = default;
  const Distribution2D& distribution(SkyDensity density) const noexcept {
    return distribution_[static_cast<std::size_t>(density)];
  }
  template <typename V>
  MaskOf<decltype(V::x)> is_in_sun(V direction_world) const noexcept {
    const V apart = direction_world - V(sun_world_);
    return dot(apart, apart) < sun_chord_squared_;
  }
  EnvironmentSample sample_sun(Vec2 u, SkyDensity density) const noexcept;
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
  float sun_chord_squared_ = 0;  ///< squared chord from centre to edge, as unit vectors; 0: no sun
  float sun_solid_angle_ = 0;
  float prob_sun_ = 0;  ///< probability of sampling the sun
  mutable std::once_flag is_blurred_;
  mutable std::vector<Rgb> blurred_;
};

}  // namespace core
