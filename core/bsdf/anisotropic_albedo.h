/// Directional albedos of anisotropic GGX lobes, tabulated at build time (albedo_tables_gen.cpp).
///
/// As SpecularAlbedo, of lobes with widths alpha_y and alpha_x = lerp(alpha_y, 1, strength^2)
/// (KHR_materials_anisotropy). Nodes: mu = t^2, |cos(phi)| = u^2 from the wide axis, and linear in
/// perceptual roughness sqrt(alpha_y) and in strength. Interpolated values differ from the
/// integrals by .002 (rms) and by .007 at most.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/facets.h"

namespace core {

inline constexpr int kAnisotropicNodes[4] = {12, 10, 8, 12};  ///< roughness, strength, phi, mu

struct AnisotropicAlbedoTables {
  using Lobe = SpecularAlbedo[kAnisotropicNodes[2]][kAnisotropicNodes[3]];
  Lobe at[kAnisotropicNodes[0]][kAnisotropicNodes[1]];
  /// 1 / pi times the integral of `at` times mu over the hemisphere.
  SpecularAlbedo average[kAnisotropicNodes[0]][kAnisotropicNodes[1]];
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
    return {low.e + (high.e - low.e) * share, low.e5 + (high.e5 - low.e5) * share};
  }
};

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
    constexpr int kOfStrength = kNodes[2] * kNodes[3];
    const F sine = hypot(w.x, w.y);
    const F cos_phi = select(sine > 0, abs(select(is_y_wide, w.y, w.x)) / sine, F(1));
    const Between at_mu(sqrt(abs(w.z)), kNodes[3]);
    const Between at_phi(sqrt(cos_phi), kNodes[2]);
    const Between at_strength(strength, kNodes[1]);
    const Between at_roughness(roughness, kNodes[0]);
    const auto node =
        ((at_roughness.node * kNodes[1] + at_strength.node) * kNodes[2] + at_phi.node) * kNodes[3] +
        at_mu.node;
    const auto along_mu = [&](int offset) {
      return albedo_detail::between(&kAnisotropicAlbedoTables.at[0][0][0][0] + offset, node,
                                    at_mu.share);
    };
    const auto along_phi = [&](int offset) {
      return at_phi(along_mu(offset), along_mu(offset + kNodes[3]));
    };
    const auto along_strength = [&](int offset) {
      return at_strength(along_phi(offset), along_phi(offset + kOfStrength));
    };
    return at_roughness(along_strength(0), along_strength(kNodes[1] * kOfStrength));
  }
  AlbedoOf<F> average() const noexcept {
    const Between at_strength(strength, kAnisotropicNodes[1]);
    const Between at_roughness(roughness, kAnisotropicNodes[0]);
    const auto node = at_roughness.node * kAnisotropicNodes[1] + at_strength.node;
    const SpecularAlbedo* rows = kAnisotropicAlbedoTables.average[0];
    return at_roughness(
        albedo_detail::between(rows, node, at_strength.share),
        albedo_detail::between(rows + kAnisotropicNodes[1], node, at_strength.share));
  }

 private:
  using Between = albedo_detail::Between<F>;
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

/// Returns the perceptual roughness of an isotropic lobe in place of one with these widths; its
/// tables of glass serve both. The lobe with the quadratic mean of the widths has the same mean
/// albedo within 0.06 at widths 1 and 0.01, and within 0.02 at 0.6 and 0.15; with the roughness
/// across the direction the error would be 0.4.
template <typename F>
F mean_roughness(F alpha_x, F alpha_y) noexcept {
  return sqrt(sqrt(0.5F * (square(alpha_x) + square(alpha_y))));
}

}  // namespace core
