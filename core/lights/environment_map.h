/// EnvironmentMap: an environment without its sun, for one direction or SIMD lanes
/// (core/math/generic.h).
#pragma once

#include "core/color/lane_color.h"
#include "core/math/numbers.h"
#include "core/sampling/distribution.h"

namespace core {

/// A direction's position on a map.
template <typename F>
struct MapPoint {
  F u{0};  ///< in [0, 1]
  F v{0};
  F sin_theta{0};  ///< theta: the angle to the pole
};

template <typename F>
struct SkySample {
  Vec3Of<F> wi_world;
  ColorOf<F> radiance;
  F pdf_solid_angle{0};  ///< 0: no sample
};

struct EnvironmentMap {
  const Rgb* texels = nullptr;  ///< rows from the top, followed by one extra texel
  int width = 0;                ///< 0: `constant` everywhere
  int height = 0;
  Rgb constant;
  float cos_rotation = 1;
  float sin_rotation = 0;

  /// Returns the position of a unit direction. Rotating the map counter-clockwise seen from +y
  /// rotates directions the other way before look-up.
  template <typename V>
  auto point(V d) const noexcept {
    using F = decltype(d.x);
    const F x = d.x * cos_rotation - d.z * sin_rotation;
    const F z = d.x * sin_rotation + d.z * cos_rotation;
    // Near the poles 1 - y^2 and acos(y) lose precision; x and z do not.
    const F sin_theta = sqrt(x * x + z * z);
    return MapPoint<F>{0.5F + atan2(z, x) * (0.5F * kInvPi), atan2(sin_theta, d.y) * kInvPi,
                       sin_theta};
  }
  /// Turns a direction from the map's frame.
  template <typename V>
  V to_world(V d) const noexcept {
    return {d.x * cos_rotation + d.z * sin_rotation, d.y, d.z * cos_rotation - d.x * sin_rotation};
  }

  /// Constant over a texel, so the sampling density below matches exactly, and an image of the
  /// environment is its integral.
  template <typename F>
  ColorOf<F> radiance(const MapPoint<F>& at) const noexcept {
    if (width == 0) {
      return color_of<F>(constant);
    }
    return texel<F>(within(truncated(at.u * static_cast<float>(width)), IntOf<F>(width)),
                    within(truncated(at.v * static_cast<float>(height)), IntOf<F>(height)));
  }
  /// With bilinear filtering.
  template <typename F>
  ColorOf<F> background(const MapPoint<F>& at) const noexcept;

  /// density: of the texels.
  template <typename U>
  auto sample(const Distribution2D& density, U u) const noexcept;
  template <typename F>
  F pdf_solid_angle(const Distribution2D& density, const MapPoint<F>& at) const noexcept {
    return per_solid_angle(density.pdf_unit(Vec2Of<F>{at.u, at.v}), at.sin_theta);
  }

  template <typename F>
  ColorOf<F> texel(IntOf<F> x, IntOf<F> y) const noexcept {
    static_assert(sizeof(Rgb) == 3 * sizeof(float));
    F color[4];
    load_four(&texels->r, (y * width + x) * 3, color);
    return {color[0], color[1], color[2]};
  }

 private:
  /// Converts a density over the unit square of the map.
  template <typename F>
  static F per_solid_angle(F pdf_unit, F sin_theta) noexcept {
    return select(sin_theta > 0, pdf_unit / (2 * kPi * kPi * sin_theta), F(0));
  }
};

template <typename F>
ColorOf<F> EnvironmentMap::background(const MapPoint<F>& at) const noexcept {
  if (width == 0) {
    return color_of<F>(constant);
  }
  using I = IntOf<F>;
  const F x = at.u * static_cast<float>(width) - 0.5F;
  const F y = at.v * static_cast<float>(height) - 0.5F;
  const I column = floor_of(x);
  const I row = floor_of(y);
  const auto around = [this](I i) {
    const I up = select(i < 0, i + width, i);
    return within(select(up < width, up, up - width), I(width));
  };
  const I x0 = around(column);
  const I x1 = around(column + 1);
  const auto mix = [](ColorOf<F> a, ColorOf<F> b, F t) { return a + (b - a) * t; };
  const auto across = [&](I y_texel) {
    return mix(texel<F>(x0, y_texel), texel<F>(x1, y_texel), x - to_floats(column));
  };
  const ColorOf<F> upper = across(within(row, I(height)));
  const ColorOf<F> lower = across(within(row + 1, I(height)));
  return mix(upper, lower, y - to_floats(row));
}

template <typename U>
auto EnvironmentMap::sample(const Distribution2D& density, U u) const noexcept {
  using F = decltype(u.x);
  const auto at = density.sample(u);
  F sin_phi;
  F cos_phi;
  F sin_theta;
  F cos_theta;
  sincos(kTwoPi * (at.uv.x - 0.5F), sin_phi, cos_phi);
  sincos(kPi * at.uv.y, sin_theta, cos_theta);
  // Reads the sampled cell: a look-up by direction could, by rounding, pair a bright texel with the
  // density of its dark neighbour.
  return SkySample<F>{to_world(Vec3Of<F>{sin_theta * cos_phi, cos_theta, sin_theta * sin_phi}),
                      texel<F>(at.column, at.row), per_solid_angle(at.pdf_unit, sin_theta)};
}

}  // namespace core
