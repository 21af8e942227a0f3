/// Medium: the coefficients of a participating medium, and its phase function.
///
/// Source: PBR 4th ed., chapter 11; Henyey and Greenstein 1941.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/color/lane_color.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// Coefficients per metre.
struct Medium {
  Rgb sigma_t;  ///< extinction: absorption + scattering
  Rgb sigma_s;  ///< scattering
  float g = 0;  ///< mean cosine of the scattering angle

  bool scatters() const noexcept { return max_component(sigma_s) > 0; }
  /// Returns scattering over extinction.
  Rgb albedo() const noexcept {
    const auto over = [](float s, float t) { return t > 0 ? s / t : 0.0F; };
    return {over(sigma_s.r, sigma_t.r), over(sigma_s.g, sigma_t.g), over(sigma_s.b, sigma_t.b)};
  }
};

/// exp(-sigma_t * depth_m): the Beer-Lambert law.
template <typename F>
ColorOf<F> transmittance(Rgb sigma_t, F depth_m) noexcept {
  return {exp(-sigma_t.r * depth_m), exp(-sigma_t.g * depth_m), exp(-sigma_t.b * depth_m)};
}

/// Phase function at the cosine of the scattering angle [1/sr]; it integrates to 1 over solid
/// angle.
template <typename F>
F henyey_greenstein(F cosine, float g) noexcept {
  const F base = max((1 + g * g) - 2 * g * cosine, F(1e-9F));
  return (1 - g * g) * kInvPi / (4 * base * sqrt(base));
}

/// Samples a direction from the phase function.
template <typename V = Vec3, typename U = Vec2>
V sample_henyey_greenstein(V direction, float g, U u) noexcept {
  using F = decltype(direction.x);
  // Below this, the quotient loses more digits than the truncated series.
  constexpr float kEven = 1e-3F;
  F cosine(0);
  if (std::fabs(g) < kEven) {
    const F x = 2 * u.x - 1;
    cosine = x + 1.5F * g * (1 - x * x);
  } else {
    const F s = (1 - g * g) / ((1 - g) + 2 * g * u.x);
    cosine = ((1 + g * g) - s * s) / (2 * g);
  }
  cosine = min(max(cosine, F(-1)), F(1));
  const F sine = sqrt(max(1 - cosine * cosine, F(0)));
  F sin_phi;
  F cos_phi;
  sincos(2 * kPi * u.y, sin_phi, cos_phi);
  const auto frame = frame_from_normal(direction);
  return normalize(frame.to_world({sine * cos_phi, sine * sin_phi, cosine}));
}

/// How far a path goes in a medium.
template <typename F>
struct MediumDepth {
  MaskOf<F> scatters;  ///< there; else it reaches the end
  F depth_m;
  ColorOf<F> weight;  ///< transmittance, and scattering coefficient, over density
};

/// Returns the probabilities of selecting each channel, from the path's throughput.
template <typename C>
C channel_probs(C beta) noexcept {
  const C size = each_channel(beta, [](auto b) { return abs(b); });
  const auto sum = sum_of(size);
  using F = std::remove_const_t<decltype(sum)>;
  return select(sum > 0, size * (1 / sum), color_of<F>(Rgb(1.0F / 3)));
}

/// Samples where the path scatters up to depth_m, which is above 0. probs: of channels. u: for the
/// channel, and the depth. Pre: the medium scatters.
template <typename F, typename U>
MediumDepth<F> sample_medium_depth(const Medium& medium, ColorOf<F> probs, F depth_m,
                                   U u) noexcept {
  const Rgb t = medium.sigma_t;
  const auto [red, green, blue] = channels_of(probs);
  // The last channel that can be: rounding never picks one of probability 0.
  const auto is_first = opposite(u.x >= red);
  const auto is_second = opposite(u.x >= red + green) | opposite(blue > 0);
  const F sigma =
      select(is_first, F(t.r), select(is_second, select(green > 0, F(t.g), F(t.r)), F(t.b)));
  const F at_m = select(sigma > 0, -log(1 - u.y) / sigma, depth_m);
  MediumDepth<F> out{at_m < depth_m, min(at_m, depth_m), {}};
  const ColorOf<F> passed = transmittance(t, out.depth_m);
  const auto per = [&](ColorOf<F> density, ColorOf<F> value) {
    return value * (1 / sum_of(density));
  };
  const ColorOf<F> end = per(probs * passed, passed);
  const ColorOf<F> scattered =
      per(probs * color_of<F>(t) * passed, color_of<F>(medium.sigma_s) * passed);
  out.weight = select(out.scatters, scattered, end);
  return out;
}

/// Returns the single-scattering albedo that gives an optically thick medium this colour under
/// diffuse light. Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
inline float single_scattering_albedo(float color, float g) noexcept {
  const float c = std::clamp(color, 0.0F, 1.0F);
  const float s = 4.09712F + 4.20863F * c - std::sqrt(9.59217F + 41.6808F * c + 17.7126F * c * c);
  return std::clamp((1 - s * s) / (1 - g * s * s), 0.0F, 1.0F);
}

}  // namespace core
