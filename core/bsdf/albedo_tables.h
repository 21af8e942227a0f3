/// Directional albedos of GGX lobes, tabulated at build time (albedo_tables_gen.cpp).
///
/// With F = f0 (1 - w) + f90 w and w = (1 - cos)^5, the directional albedo of the single-scattering
/// lobe is f0 * (e - e5) + f90 * e5. Nodes: mu = t^2 over t = i/(N-1); perceptual roughness
/// j/(N-1). Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
#pragma once

#include "core/math/generic.h"

namespace core {

inline constexpr int kAlbedoNodes = 48;
inline constexpr int kGlassNodes = 24;
inline constexpr int kSheenNodes = 32;

/// The albedo of single scattering with F = 1, whole and weighted by w.
template <typename F>
struct AlbedoOf {
  F e = 1;
  F e5 = 0;
};
using SpecularAlbedo = AlbedoOf<float>;

/// [inside][ior][roughness][mu]; ior = 1 + 2 (k/(N-1))^2 seen from outside; from inside its
/// inverse.
struct GlassTable {
  float at[2][kGlassNodes][kGlassNodes][kGlassNodes];
  float average[2][kGlassNodes][kGlassNodes];  ///< 2 * integral of that times mu
};

struct AlbedoTables {
  SpecularAlbedo single[kAlbedoNodes][kAlbedoNodes];  ///< [roughness][mu]
  SpecularAlbedo average[kAlbedoNodes];               ///< 2 * integral of single * mu
  /// [roughness of a clearcoat][roughness]: covariances over the hemisphere, weighted by the
  /// cosine, of coat_albedo() of the one with `single` of the other.
  SpecularAlbedo under_coat[kAlbedoNodes][kAlbedoNodes];
  GlassTable glass;       ///< reflection plus refraction of a rough dielectric
  GlassTable open_glass;  ///< the same where facets reflect nothing but by total reflection
  float sheen[kSheenNodes][kSheenNodes];  ///< [roughness][mu], mu linear
};

extern const AlbedoTables kAlbedoTables;

/// F0 of a clearcoat (KHR_materials_clearcoat).
inline constexpr float kCoatF0 = 0.04F;

/// Returns the albedo of a clearcoat where that with F = 1 is a.
template <typename F>
F coat_albedo(AlbedoOf<F> a) noexcept {
  return kCoatF0 * (a.e - a.e5) + a.e5;
}

namespace albedo_detail {

/// Returns two values at share a of the way between two neighbouring nodes.
template <typename F>
AlbedoOf<F> between(const SpecularAlbedo* base, decltype(truncated(F())) node, F a) noexcept {
  F t[4];
  load_four(&base->e, node + node, t);
  return {t[0] + (t[2] - t[0]) * a, t[1] + (t[3] - t[1]) * a};
}
template <typename F>
auto node_below(F x) noexcept {
  return truncated(min(x, F(kAlbedoNodes - 2)));
}

}  // namespace albedo_detail

/// Returns the albedo at mu = cos(theta) in [0,1] and perceptual roughness in [0,1].
template <typename F>
AlbedoOf<F> specular_albedo(F mu, F roughness) noexcept {
  const F x = sqrt(clamp01(mu)) * F(kAlbedoNodes - 1);
  const F y = clamp01(roughness) * F(kAlbedoNodes - 1);
  const auto i = albedo_detail::node_below(x);
  const auto j = albedo_detail::node_below(y);
  const F a = x - to_floats(i);
  const F b = y - to_floats(j);
  const auto node = j * kAlbedoNodes + i;
  const AlbedoOf<F> low = albedo_detail::between(kAlbedoTables.single[0], node, a);
  const AlbedoOf<F> high = albedo_detail::between(kAlbedoTables.single[1], node, a);
  return {low.e + (high.e - low.e) * b, low.e5 + (high.e5 - low.e5) * b};
}

template <typename F>
AlbedoOf<F> specular_albedo_average(F roughness) noexcept {
  const F y = clamp01(roughness) * F(kAlbedoNodes - 1);
  const auto j = albedo_detail::node_below(y);
  return albedo_detail::between(kAlbedoTables.average, j, y - to_floats(j));
}

/// Returns the directional albedo of a white sheen.
template <typename F>
F sheen_albedo(F mu, F roughness) noexcept {
  const F x = clamp01(mu) * F(kSheenNodes - 1);
  const F y = clamp01(roughness) * F(kSheenNodes - 1);
  const auto i = truncated(min(x, F(kSheenNodes - 2)));
  const auto j = truncated(min(y, F(kSheenNodes - 2)));
  const auto along = [node = j * kSheenNodes + i, a = x - to_floats(i)](const float* row) {
    const F first = gather(row, node);
    return first + (gather(row + 1, node) - first) * a;
  };
  const F low = along(kAlbedoTables.sheen[0]);
  const F high = along(kAlbedoTables.sheen[1]);
  return low + (high - low) * (y - to_floats(j));
}

namespace glass_detail {

template <typename F>
struct TableCell {
  decltype(truncated(F())) node;
  F share;

  explicit TableCell(F x) noexcept
      : node(truncated(min(x * F(kGlassNodes - 1), F(kGlassNodes - 2)))),
        share(x * F(kGlassNodes - 1) - to_floats(node)) {}
};
template <typename F>
F axis_of_ior(F ior) noexcept {
  return sqrt(clamp01((ior - 1) * 0.5F));
}

/// Returns the value at a share of the way to another.
template <typename F>
F between(F low, F high, F share) noexcept {
  return low + (high - low) * share;
}

}  // namespace glass_detail

/// Returns the albedo of glass. ior: of the denser side over the thinner one, above 1. inside: the
/// direction is in the denser one. table: of kAlbedoTables.
template <typename F>
F glass_albedo(F mu, F roughness, F ior, MaskOf<F> inside,
               const GlassTable& table = kAlbedoTables.glass) noexcept {
  using glass_detail::between;
  constexpr int kRow = kGlassNodes;
  constexpr int kPlane = kRow * kRow;
  const glass_detail::TableCell<F> i(glass_detail::axis_of_ior(ior));
  const glass_detail::TableCell<F> r(clamp01(roughness));
  const glass_detail::TableCell<F> m(sqrt(clamp01(mu)));
  using Node = decltype(m.node);
  const Node first =
      (i.node * kRow + r.node) * kRow + m.node + select(inside, Node(kRow * kPlane), Node(0));
  const auto along_mu = [&](int offset) {
    const float* row = &table.at[0][0][0][0] + offset;
    return between(gather(row, first), gather(row + 1, first), m.share);
  };
  const auto in_plane = [&](int offset) {
    return between(along_mu(offset), along_mu(offset + kRow), r.share);
  };
  return between(in_plane(0), in_plane(kPlane), i.share);
}

/// Returns the cosine-weighted mean of glass_albedo() over the hemisphere.
template <typename F>
F glass_albedo_average(F roughness, F ior, bool inside,
                       const GlassTable& table = kAlbedoTables.glass) noexcept {
  using glass_detail::between;
  const glass_detail::TableCell<F> i(glass_detail::axis_of_ior(ior));
  const glass_detail::TableCell<F> r(clamp01(roughness));
  const auto first = i.node * kGlassNodes + r.node;
  const auto row = [&](int offset) {
    const float* at = &table.average[inside ? 1 : 0][0][0] + offset;
    return between(gather(at, first), gather(at + 1, first), r.share);
  };
  return between(row(0), row(kGlassNodes), i.share);
}

}  // namespace core
