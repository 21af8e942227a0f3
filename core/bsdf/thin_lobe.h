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

struct ThinLobe {
  Rgb color;         ///< c
  float weight = 0;  ///< of the wall in the mixture of surface components
  Rgb multiple;      ///< multiple scattering, over 1 - E(wi) [1/sr]

  struct Faces {
    Rgb reflected;  ///< by the far face
    Rgb transmitted;
  };
  /// Returns the weighted shares of light at cosine cos_oh to the facets. F is that of the largest
  /// channel where light passes a face, so that transmitted light keeps its hue.
  Faces faces(const Interface& interface, float cos_oh) const noexcept {
    const float f = interface.fresnel(cos_oh);
    if (!(f < 1)) {
      return {};
    }
    const float passed = weight * square(1 - f);
    const auto sum = [f, passed](float c) { return passed * c / (1 - square(c * f)); };
    const Rgb through = {sum(color.r), sum(color.g), sum(color.b)};
    return {through * color * interface.fresnel_rgb(cos_oh), through};
  }

  /// Adds transmission (wi.z < 0), or to reflection, whose density SpecularLobe adds, that of the
  /// far face.
  void add(const Facets& s, const Interface& interface, float prob, Vec3 wi,
           BsdfEval& out) const noexcept {
    if (s.is_smooth) {
      return;
    }
    const Vec3 reflected = {wi.x, wi.y, std::fabs(wi.z)};
    const Vec3 h = s.half(reflected);
    const auto reflection = s.reflection(prob, reflected, h);
    const Faces f = faces(interface, dot(s.wo, h));
    out.value_cos += (wi.z > 0 ? f.reflected : f.transmitted) * reflection.value_cos;
    if (wi.z < 0) {
      out.pdf_solid_angle += reflection.pdf_solid_angle;
    }
  }
  bool sample(const Facets& s, const Interface& interface, LobeShare share, Vec2 u,
              BsdfSample& out) const noexcept {
    if (s.is_smooth) {
      out.wi_local = -s.wo;
      out.weight = faces(interface, s.wo.z).transmitted * (share.open / share.prob);
      out.is_delta = true;
      out.is_null = true;
      return true;
    }
    const Vec3 reflected = s.sample_reflected(u);
    out.wi_local = {reflected.x, reflected.y, -reflected.z};
    return reflected.z > 0;
  }
};

}  // namespace core
