/// Environment in lanes: radiance, and light samples of skies without a sun.
#pragma once

#include "core/lights/environment.h"
#include "core/math/frame.h"
#include "core/sampling/distribution_lanes.h"
#include "core/sampling/warp.h"

namespace core {

/// Returns the map coordinates of directions.
template <std::size_t N>
struct MapPoints {
  Floats<N> u, v, sin_theta;
};

/// EnvironmentSample
template <std::size_t N>
struct SkyLanes {
  Vec3s<N> wi_world;
  Vec3s<N> radiance;
  Floats<N> pdf_solid_angle;
};

class LaneEnvironment {
 public:
  /// environment: may be null; then no other member may be called. density: of sample().
  LaneEnvironment(const Environment* environment, SkyDensity density)
      : is_compensated_(density == SkyDensity::kCompensated) {
    if (environment != nullptr) {
      map_ = environment->map();
      distribution_ = &environment->distribution(density);
    }
  }

  /// Samples for surfaces that face `normal`, or points if it is zero.
  template <std::size_t N>
  SkyLanes<N> sample(Vec3s<N> normal, Vec2s<N> u) const {
    if (map_.width == 0) {
      const Vec3s<N> local = is_compensated_ ? cosine_hemisphere(u) : uniform_hemisphere(u);
      SkyLanes<N> out = {frame_from_normal(normal).to_world(local), constant<N>(),
                         over_hemisphere(local.z)};
      if (const Mask<N> anywhere = is_zero(normal); anywhere.any()) {
        out.wi_world = select(anywhere, uniform_sphere(u), out.wi_world);
        out.pdf_solid_angle = select(anywhere, Floats<N>(kInvPi * 0.25F), out.pdf_solid_angle);
      }
      return out;
    }
    const auto at = sample_square(*distribution_, u);
    Floats<N> sin_phi;
    Floats<N> cos_phi;
    Floats<N> sin_theta;
    Floats<N> cos_theta;
    sincos(Floats<N>(kTwoPi) * (at.uv.x - Floats<N>(0.5F)), sin_phi, cos_phi);
    sincos(Floats<N>(kPi) * at.uv.y, sin_theta, cos_theta);
    const Floats<N> x = sin_theta * cos_phi;
    const Floats<N> z = sin_theta * sin_phi;
    const Floats<N> c(map_.cos_rotation);
    const Floats<N> s(map_.sin_rotation);
    return {{x * c + z * s, cos_theta, z * c - x * s},
            texels(at.column, at.row),
            over_sphere(at.pdf_unit, sin_theta)};
  }
  /// Density of sample() at a direction d with map coordinates `at`.
  template <std::size_t N>
  Floats<N> pdf_solid_angle(Vec3s<N> normal, Vec3s<N> d, const MapPoints<N>& at) const {
    if (map_.width == 0) {
      return select(is_zero(normal), Floats<N>(kInvPi * 0.25F), over_hemisphere(dot(normal, d)));
    }
    return over_sphere(pdf_square(*distribution_, Vec2s<N>{at.u, at.v}), at.sin_theta);
  }

  template <std::size_t N>
  MapPoints<N> points(Vec3s<N> d) const {
    const Floats<N> c(map_.cos_rotation);
    const Floats<N> s(map_.sin_rotation);
    const Floats<N> x = d.x * c - d.z * s;
    const Floats<N> z = d.x * s + d.z * c;
    const Floats<N> sin_theta = sqrt(x * x + z * z);
    return {Floats<N>(0.5F) + atan2(z, x) * Floats<N>(0.5F * kInvPi),
            atan2(sin_theta, d.y) * Floats<N>(kInvPi), sin_theta};
  }

  template <std::size_t N>
  Vec3s<N> radiance(const MapPoints<N>& at) const {
    if (map_.width == 0) {
      return constant<N>();
    }
    return texels(within(truncated(at.u * width<N>()), Ints<N>(map_.width)),
                  within(truncated(at.v * height<N>()), Ints<N>(map_.height)));
  }

  template <std::size_t N>
  Vec3s<N> background(const MapPoints<N>& at) const {
    if (map_.width == 0) {
      return constant<N>();
    }
    const Ints<N> one(1);
    const Floats<N> x = at.u * width<N>() - Floats<N>(0.5F);
    const Floats<N> y = at.v * height<N>() - Floats<N>(0.5F);
    const Ints<N> column = floor_of(x);
    const Ints<N> row = floor_of(y);
    const Floats<N> right = x - to_floats(column);
    const Floats<N> down = y - to_floats(row);
    const Ints<N> x0 = around(column);
    const Ints<N> x1 = around(column + one);
    const Ints<N> y0 = within(row, Ints<N>(map_.height));
    const Ints<N> y1 = within(row + one, Ints<N>(map_.height));
    const Vec3s<N> upper = mix(texels(x0, y0), texels(x1, y0), right);
    const Vec3s<N> lower = mix(texels(x0, y1), texels(x1, y1), right);
    return mix(upper, lower, down);
  }

 private:
  template <std::size_t N>
  static Mask<N> is_zero(Vec3s<N> normal) {
    return dot(normal, normal) == Floats<N>(0);
  }
  /// Converts a density over the unit square of the map to solid angle.
  template <std::size_t N>
  static Floats<N> over_sphere(Floats<N> pdf_unit, Floats<N> sin_theta) {
    const Floats<N> zero(0);
    return select(sin_theta > zero, pdf_unit / (Floats<N>(2 * kPi * kPi) * sin_theta), zero);
  }
  /// As LightSampler::hemisphere_pdf_solid_angle().
  template <std::size_t N>
  Floats<N> over_hemisphere(Floats<N> cosine) const {
    const Floats<N> zero(0);
    return is_compensated_ ? max(cosine, zero) * Floats<N>(kInvPi)
                           : select(cosine > zero, Floats<N>(1 / kTwoPi), zero);
  }
  template <std::size_t N>
  Vec3s<N> constant() const {
    return Vec3s<N>(Vec3{map_.constant.r, map_.constant.g, map_.constant.b});
  }
  template <std::size_t N>
  Floats<N> width() const {
    return Floats<N>(static_cast<float>(map_.width));
  }
  template <std::size_t N>
  Floats<N> height() const {
    return Floats<N>(static_cast<float>(map_.height));
  }
  /// Wraps columns around.
  template <std::size_t N>
  Ints<N> around(Ints<N> i) const {
    const Ints<N> count(map_.width);
    const Ints<N> up = select(i < Ints<N>(0), i + count, i);
    return within(select(up < count, up, up - count), Ints<N>(map_.width));
  }
  template <std::size_t N>
  static Vec3s<N> mix(Vec3s<N> a, Vec3s<N> b, Floats<N> t) {
    return a + (b - a) * t;
  }
  template <std::size_t N>
  Vec3s<N> texels(Ints<N> x, Ints<N> y) const {
    static_assert(sizeof(Rgb) == 3 * sizeof(float));
    alignas(32) std::int32_t index[N];
    store(index, y * Ints<N>(map_.width) + x);
    const float* rows[N];
    for (std::size_t k = 0; k < N; ++k) {
      rows[k] = &map_.texels[index[k]].r;
    }
    Floats<N> columns[4];
    transpose(rows, columns);
    return {columns[0], columns[1], columns[2]};
  }

  Environment::Map map_;
  const Distribution2D* distribution_ = nullptr;
  bool is_compensated_;
};

}  // namespace core
