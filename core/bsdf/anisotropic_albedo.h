/// Directional albedos of anisotropic GGX lobes, tabulated at build time (albedo_tables_gen.cpp).
///
/// As SpecularAlbedo, of lobes with widths alpha_y and alpha_x = lerp(alpha_y, 1, strength^2)
/// (KHR_materials_anisotropy). Nodes: mu = t^2, |cos(phi)| = u^2 from the wide axis, and linear in
/// perceptual roughness sqrt(alpha_y) and in strength. Interpolated values differ from the
/// integrals by .002 (rms) and by .007 at most.
///
/// Of glass, the difference from the albedo of the isotropic lobe with mean_roughness(), which is
/// smoother: within .007 (rms) of the integrals, and .002 too low on average inside lobes of widths
/// 1 and .01 to .16, so that a ball of them makes 1 to 2% light.
#pragma once

#include <type_traits>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/facets.h"

namespace core {

inline constexpr int kAnisotropicNodes[] = {12, 10, 8, 12};  ///< roughness, strength, phi, mu
/// inside, ior = 1 + 2 x^2 of the denser side, then as above
inline constexpr int kAnisotropicGlassNodes[] = {2, 6, 8, 8, 10, 10};

struct AnisotropicAlbedoTables {
  using Lobe = SpecularAlbedo[kAnisotropicNodes[2]][kAnisotropicNodes[3]];
  Lobe at[kAnisotropicNodes[0]][kAnisotropicNodes[1]];
  /// 1 / pi times the integral of `at` times mu over the hemisphere.
  SpecularAlbedo average[kAnisotropicNodes[0]][kAnisotropicNodes[1]];

  static constexpr const int (&kG)[6] = kAnisotropicGlassNodes;
  float glass[kG[0]][kG[1]][kG[2]][kG[3]][kG[4]][kG[5]];
  /// 1 / pi times the integral of `glass`, as interpolated, times mu over the hemisphere.
  float glass_average[kG[0]][kG[1]][kG[2]][kG[3]];
};

extern const AnisotropicAlbedoTables kAnisotropicAlbedoTables;

namespace albedo_detail {

/// A position between two nodes of an axis; x in [0,1].
template <typename F>
struct Between {
  decltype(truncated(F())) node;
  F share;

  Between(F x, int nodes) noexcept {
    const F at = clamp01(x) * F(static_cast<float>(nodes - 1));
    node = truncated(min(at, F(static_cast<float>(nodes - 2))));
    share = at - to_floats(node);
  }
  AlbedoOf<F> operator()(AlbedoOf<F> low, AlbedoOf<F> high) const noexcept {
    return {(*this)(low.e, high.e), (*this)(low.e5, high.e5)};
  }
  F operator()(F low, F high) const noexcept { return low + (high - low) * share; }
};

/// Interpolates along axis kAxis and those after it. last(offset): the value along the last axis.
template <std::size_t kAxis, std::size_t kAxes, typename F, typename Last>
auto interpolate(const Between<F> (&at)[kAxes], const int (&nodes)[kAxes], int offset,
                 const Last& last) noexcept {
  if constexpr (kAxis + 1 == kAxes) {
    return last(offset);
  } else {
    int stride = 1;
    for (std::size_t axis = kAxis + 1; axis < kAxes; ++axis) {
      stride *= nodes[axis];
    }
    return at[kAxis](interpolate<kAxis + 1>(at, nodes, offset, last),
                     interpolate<kAxis + 1>(at, nodes, offset + stride, last));
  }
}
/// Returns the index of the first of the nodes around a position.
template <std::size_t kAxes, typename F>
auto first_node(const Between<F> (&at)[kAxes], const int (&nodes)[kAxes]) noexcept {
  auto node = at[0].node;
  for (std::size_t axis = 1; axis < kAxes; ++axis) {
    node = node * nodes[axis] + at[axis].node;
  }
  return node;
}
/// Returns the value at a position in a table of AlbedoOf or float.
template <typename T, std::size_t kAxes, typename F>
auto value_at(const T* table, const Between<F> (&at)[kAxes], const int (&nodes)[kAxes],
              decltype(truncated(F())) base) noexcept {
  const auto node = base + first_node(at, nodes);
  return interpolate<0>(at, nodes, 0, [&](int offset) {
    if constexpr (std::is_same_v<T, float>) {
      return at[kAxes - 1](gather(table + offset, node), gather(table + offset + 1, node));
    } else {
      return between(table + offset, node, at[kAxes - 1].share);
    }
  });
}

}  // namespace albedo_detail

/// Widths in the terms of the tables.
template <typename F>
struct AnisotropyOf {
  F roughness;  ///< perceptual, of the narrow axis
  F strength;   ///< 0: isotropic
  MaskOf<F> is_y_wide;

  AnisotropyOf(F alpha_x, F alpha_y) noexcept : is_y_wide(alpha_y > alpha_x) {
    const F narrow = min(alpha_x, alpha_y);
    const F wide = max(alpha_x, alpha_y);
    roughness = sqrt(narrow);
    strength = select(narrow < 1, sqrt((wide - narrow) / (1 - narrow)), F(0));
  }
  /// w: local, in any hemisphere.
  [[gnu::noinline]] AlbedoOf<F> albedo(Vec3Of<F> w) const noexcept {
    constexpr const auto& kNodes = kAnisotropicNodes;
    const Between at[] = {{roughness, kNodes[0]},
                          {strength, kNodes[1]},
                          {sqrt(cos_phi(w)), kNodes[2]},
                          {sqrt(abs(w.z)), kNodes[3]}};
    return albedo_detail::value_at(&kAnisotropicAlbedoTables.at[0][0][0][0], at, kNodes, 0);
  }
  AlbedoOf<F> average() const noexcept {
    constexpr int kNodes[] = {kAnisotropicNodes[0], kAnisotropicNodes[1]};
    const Between at[] = {{roughness, kNodes[0]}, {strength, kNodes[1]}};
    return albedo_detail::value_at(&kAnisotropicAlbedoTables.average[0][0], at, kNodes, 0);
  }
  /// Returns the difference from glass_albedo() of the isotropic lobe.
  [[gnu::noinline]] F glass_difference(Vec3Of<F> w, F ior, MaskOf<F> inside) const noexcept {
    constexpr const auto& kG = kAnisotropicGlassNodes;
    constexpr int kNodes[] = {kG[1], kG[2], kG[3], kG[4], kG[5]};
    const Between at[] = {{glass_detail::axis_of_ior(ior), kNodes[0]},
                          {roughness, kNodes[1]},
                          {strength, kNodes[2]},
                          {sqrt(cos_phi(w)), kNodes[3]},
                          {sqrt(abs(w.z)), kNodes[4]}};
    constexpr int kSide = kNodes[0] * kNodes[1] * kNodes[2] * kNodes[3] * kNodes[4];
    using Node = decltype(at[0].node);
    return albedo_detail::value_at(&kAnisotropicAlbedoTables.glass[0][0][0][0][0][0], at, kNodes,
                                   select(inside, Node(kSide), Node(0)));
  }
  F glass_difference_average(F ior, bool inside) const noexcept {
    constexpr const auto& kG = kAnisotropicGlassNodes;
    constexpr int kNodes[] = {kG[1], kG[2], kG[3]};
    const Between at[] = {
        {glass_detail::axis_of_ior(ior), kNodes[0]}, {roughness, kNodes[1]}, {strength, kNodes[2]}};
    return albedo_detail::value_at(&kAnisotropicAlbedoTables.glass_average[inside ? 1 : 0][0][0][0],
                                   at, kNodes, 0);
  }

 private:
  using Between = albedo_detail::Between<F>;

  /// Returns |cos| of the azimuth from the wide axis.
  F cos_phi(Vec3Of<F> w) const noexcept {
    const F sine = hypot(w.x, w.y);
    return select(sine > 0, abs(select(is_y_wide, w.y, w.x)) / sine, F(1));
  }
};
using Anisotropy = AnisotropyOf<float>;

/// Returns the albedo of the facets' reflection in direction w, on either side, with F = 1.
template <typename F>
AlbedoOf<F> albedo_of(const FacetsOf<F>& s, Vec3Of<F> w) noexcept {
  AlbedoOf<F> out = specular_albedo(abs(w.z), s.roughness);
  const MaskOf<F> is_round = s.ggx.alpha_x == s.ggx.alpha_y;
  if (!all(is_round)) {
    const AlbedoOf<F> brushed = AnisotropyOf<F>(s.ggx.alpha_x, s.ggx.alpha_y).albedo(w);
    out = {select(is_round, out.e, brushed.e), select(is_round, out.e5, brushed.e5)};
  }
  return out;
}
/// Returns its cosine-weighted mean over the hemisphere.
template <typename F>
AlbedoOf<F> albedo_average(const FacetsOf<F>& s) noexcept {
  AlbedoOf<F> out = specular_albedo_average(s.roughness);
  const MaskOf<F> is_round = s.ggx.alpha_x == s.ggx.alpha_y;
  if (!all(is_round)) {
    const AlbedoOf<F> brushed = AnisotropyOf<F>(s.ggx.alpha_x, s.ggx.alpha_y).average();
    out = {select(is_round, out.e, brushed.e), select(is_round, out.e5, brushed.e5)};
  }
  return out;
}

/// Returns the perceptual roughness of the isotropic lobe with the quadratic mean of these widths.
template <typename F>
F mean_roughness(F alpha_x, F alpha_y) noexcept {
  return sqrt(sqrt(0.5F * (square(alpha_x) + square(alpha_y))));
}

/// Returns glass_albedo() of the facets in direction w, on either side.
template <typename F>
F glass_albedo(const FacetsOf<F>& s, Vec3Of<F> w, F ior, MaskOf<F> inside) noexcept {
  const F round = glass_albedo(abs(w.z), s.roughness, ior, inside);
  const MaskOf<F> is_round = s.ggx.alpha_x == s.ggx.alpha_y;
  if (all(is_round)) {
    return round;
  }
  const AnisotropyOf<F> brush(s.ggx.alpha_x, s.ggx.alpha_y);
  return select(is_round, round, min(round + brush.glass_difference(w, ior, inside), F(1)));
}
/// Returns its cosine-weighted mean over the hemisphere.
template <typename F>
F glass_albedo_average(const FacetsOf<F>& s, F ior, bool inside) noexcept {
  const F round = glass_albedo_average(s.roughness, ior, inside);
  const MaskOf<F> is_round = s.ggx.alpha_x == s.ggx.alpha_y;
  if (all(is_round)) {
    return round;
  }
  const AnisotropyOf<F> brush(s.ggx.alpha_x, s.ggx.alpha_y);
  return select(is_round, round, round + brush.glass_difference_average(ior, inside));
}

}  // namespace core
