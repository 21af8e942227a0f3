/// Directional albedos of GGX lobes, tabulated at build time (albedo_tables_gen.cpp).
///
/// With F = f0 (1 - w) + f90 w and w = (1 - cos)^5, the directional albedo of the single-scattering
/// lobe is f0 * (e - e5) + f90 * e5. Nodes: mu = t^2 over t = i/(N-1); perceptual roughness
/// j/(N-1). Source: Kulla and Conty, Revisiting Physically Based Shading at Imageworks, 2017.
#pragma once

#include <algorithm>
#include <cmath>

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

struct AlbedoTables {
  SpecularAlbedo single[kAlbedoNodes][kAlbedoNodes];      ///< [roughness][mu]
  SpecularAlbedo average[kAlbedoNodes];                   ///< 2 * integral of single * mu
  float glass_outside_average[kGlassNodes][kGlassNodes];  ///< 2 * integral of glass_outside times
                                                          ///< mu; [ior][roughness]
  float glass_inside_average[kGlassNodes][kGlassNodes];
  /// Reflection plus refraction of a rough dielectric; [ior][roughness][mu]; ior = 1 + 2
  /// (k/(N-1))^2 seen from outside; the other table has its inverse, seen from inside.
  float glass_outside[kGlassNodes][kGlassNodes][kGlassNodes];
  float glass_inside[kGlassNodes][kGlassNodes][kGlassNodes];
  float sheen[kSheenNodes][kSheenNodes];  ///< [roughness][mu], mu linear
};

extern const AlbedoTables kAlbedoTables;

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

struct TableCell {
  int node[3];
  float share[3];
};

inline TableCell cell_of(float mu, float roughness, float ior) noexcept {
  constexpr float kLast = kGlassNodes - 1;
  const float at[3] = {std::sqrt(std::clamp((ior - 1) * 0.5F, 0.0F, 1.0F)) * kLast,
                       std::clamp(roughness, 0.0F, 1.0F) * kLast,
                       std::sqrt(std::clamp(mu, 0.0F, 1.0F)) * kLast};
  TableCell p{};
  for (int k = 0; k < 3; ++k) {
    p.node[k] = std::min(static_cast<int>(at[k]), kGlassNodes - 2);
    p.share[k] = at[k] - static_cast<float>(p.node[k]);
  }
  return p;
}

}  // namespace glass_detail

/// Returns the albedo of glass. ior: of the denser side over the thinner one, above 1. inside: the
/// direction is in the denser one.
inline float glass_albedo(float mu, float roughness, float ior, bool inside) noexcept {
  const auto p = glass_detail::cell_of(mu, roughness, ior);
  const auto& table = inside ? kAlbedoTables.glass_inside : kAlbedoTables.glass_outside;
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int c[3] = {corner & 1, (corner >> 1) & 1, corner >> 2};
    float weight = 1;
    for (int k = 0; k < 3; ++k) {
      weight *= c[k] != 0 ? p.share[k] : 1 - p.share[k];
    }
    sum += weight * table[p.node[0] + c[0]][p.node[1] + c[1]][p.node[2] + c[2]];
  }
  return sum;
}

/// Returns the cosine-weighted mean of glass_albedo() over the hemisphere.
inline float glass_albedo_average(float roughness, float ior, bool inside) noexcept {
  const auto p = glass_detail::cell_of(1, roughness, ior);
  const auto& t = inside ? kAlbedoTables.glass_inside_average : kAlbedoTables.glass_outside_average;
  const auto row = [&](int i) {
    return t[i][p.node[1]] + (t[i][p.node[1] + 1] - t[i][p.node[1]]) * p.share[1];
  };
  const float low = row(p.node[0]);
  return low + (row(p.node[0] + 1) - low) * p.share[0];
}

}  // namespace core
