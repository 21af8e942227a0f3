/// ThinLobe: a thin wall, two parallel faces whose gap is much smaller than the wall is far.
///
/// Light passes straight on, spread by roughness as the reflection of the facets is. A face
/// reflects F and the passage from one to the other keeps the base colour c, so that the
/// reflections between the faces add up to
///   reflected    F + (1 - F)^2 c^2 F / (1 - c^2 F^2)   (c = 1: 2 F / (1 + F))
///   transmitted  (1 - F)^2 c / (1 - c^2 F^2)           (c = 1: (1 - F) / (1 + F))
/// The first F is that of SpecularLobe, which reflects as an opaque surface does; the rest is here.
/// Source: PBR 4th ed. 9.4.3, DielectricBxDF for thin surfaces. Rough walls use F of the facet;
/// their multiple scattering between facets leaves diffusely on the other side.
#pragma once

#include "core/bsdf/facets.h"
#include "core/bsdf/interface.h"

namespace core {

template <typename F>
struct ThinLobeOf {
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  using M = MaskOf<F>;
  Color color;     ///< c
  F weight;        ///< of the wall in the mixture of surface components
  Color multiple;  ///< multiple scattering, over 1 - E(wi) [1/sr]

  struct Faces {
    Color reflected;  ///< by the far face
    Color transmitted;
  };
  /// Returns the weighted shares of light at cosine cos_oh to the facets. F is that of the largest
  /// channel where light passes a face, so that transmitted light keeps its hue. Surface:
  /// InterfaceOf or Interface.
  template <typename Surface>
  Faces faces(const Surface& surface, F cos_oh) const noexcept {
    const F f = surface.fresnel(cos_oh);
    const M is_open = f < 1;
    const F passed = weight * square(1 - f);
    const Color through = each_channel(
        color, [&](F c) { return select(is_open, passed * c / (1 - square(c * f)), F(0)); });
    return {through * color * surface.fresnel_rgb(cos_oh), through};
  }

  /// Albedos for wo.
  struct Albedos {
    Faces single;
    Color multiple;
  };
  /// Returns the albedos, and sets `multiple`. e, average: albedos of the facets with F = 1.
  template <typename Surface>
  Albedos prepare(const FacetsOf<F>& s, const Surface& surface, AlbedoOf<F> e,
                  AlbedoOf<F> average) noexcept {
    // F at the mean weight of Schlick's curve over the facets, e5 / e, in place of its mean.
    const F mean = 1 - pow(e.e5 / e.e, F(0.2F));
    const Faces single = faces(surface, select(s.is_smooth, s.wo.z, mean));
    const F taken = select(s.is_smooth, F(1), e.e);
    const F lost = select(s.is_smooth, F(0), 1 - e.e);
    const Color spread = color * (weight * (1 - surface.multiple));
    multiple = spread * (lost * kInvPi / max(1 - average.e, F(1e-4F)));
    return {{single.reflected * taken, single.transmitted * taken}, spread * lost};
  }

  /// Returns the weight with which transmission is sampled.
  F prob(const Albedos& albedos) const noexcept {
    return max(luminance(albedos.single.transmitted), 0.01F * weight * luminance(color));
  }

  /// Adds transmission (wi.z < 0), or to reflection, whose density SpecularLobe adds, that of the
  /// far face.
  template <typename Surface, typename Eval>
  void add(const FacetsOf<F>& s, const Surface& surface, F prob, V wi, Eval& out) const noexcept {
    if (all(s.is_smooth)) {
      return;
    }
    const V reflected = {wi.x, wi.y, abs(wi.z)};
    const V h = s.half(reflected);
    const auto reflection = s.reflection(prob, reflected, h);
    const Faces f = faces(surface, dot(s.wo, h));
    out.value_cos =
        out.value_cos + select(wi.z > 0, f.reflected, f.transmitted) * reflection.value_cos;
    out.pdf_solid_angle = out.pdf_solid_angle + select(wi.z < 0, reflection.pdf_solid_angle, F(0));
  }
  /// Samples transmission; where smooth, straight on. Above the surface if the path is absorbed.
  static V sample(const FacetsOf<F>& s, Vec2Of<F> u) noexcept {
    const V reflected = s.sample_reflected(u);
    return {reflected.x, reflected.y, -reflected.z};
  }
};
using ThinLobe = ThinLobeOf<float>;

}  // namespace core
