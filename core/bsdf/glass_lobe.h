/// GlassLobe: the rough or smooth boundary of a solid.
///
/// Walter et al. 2007 with exact Fresnel, modified by F0 and F90 of KHR_materials_specular and by
/// the film of KHR_materials_iridescence. Multiple scattering between facets is diffuse on both
/// sides (Kulla and Conty 2017).
#pragma once

#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/thin_film.h"

namespace core {

/// As in BsdfParameters.
template <typename F>
struct GlassParametersOf {
  ColorOf<F> color;       ///< of refraction
  ColorOf<F> reflection;  ///< weight of reflection
  ColorOf<F> specular_color;
  F f90;
  F ior;
  MaskOf<F> inside;
};

template <typename F>
class GlassLobeOf {
 public:
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  using M = MaskOf<F>;

  /// weight: of the solid in the mixture of surface components.
  GlassLobeOf(const GlassParametersOf<F>& p, const FacetsOf<F>& s, F weight,
              const ThinFilmOf<F>& film) noexcept
      : color_(p.color), reflection_(p.reflection), weight_(weight) {
    const F ior = max(p.ior, F(1e-2F));
    inside_ = p.inside;
    eta_ = select(p.inside, 1 / ior, ior);
    is_bent_ = is_not_black(p.specular_color - Color(F(1))) | opposite(p.f90 == F(1));
    if (film.exists) {
      film_ = film;
      is_bent_ = is_bent_ | (film_.weight > 0);
    }
    if (any(is_bent_)) {
      f0_ = each_channel(p.specular_color * square((1 - ior) / (1 + ior)),
                         [](F f) { return clamp01(f); }) *
            p.f90;
      f90_ = p.f90;
    }
    const M is_rough = opposite(is_delta(s));
    if (any(is_rough)) {
      if (any(is_bent_)) {
        const F r0 = square((1 - ior) / (1 + ior));
        const F first = film_.exists ? mean_of_film() : max_component(f0_);
        slope_ = select(is_bent_, (f90_ - first) / (1 - r0), F(1));
        least_ = select(is_bent_, first - slope_ * r0, F(0));
      }
      // Lost energy leaves in proportion to (1 - E) of the side it leaves to. Each side is then
      // reciprocal if (1 - reflected) times the mean loss is n^2 times as large outside as inside.
      // The outer side reflects the mean of Fresnel's curve (fit of d'Eon, A Hitchhiker's Guide to
      // Multiple Scattering, 2021).
      const F n = max(eta_, 1 / eta_);
      const M denser = eta_ < 1;
      lost_ = select(is_rough, max(1 - albedo(s, s.wo, denser), F(0)), F(0));
      const F lost_outside = max(1 - average(s, false), F(1e-4F));
      const F lost_inside = max(1 - average(s, true), F(1e-4F));
      const F mean_fresnel = least_ + slope_ * ((n - 1) / (4.08567F + 1.00071F * n));
      const F through_outside = min(1 - mean_fresnel, n * n * lost_inside / lost_outside);
      through_ =
          select(denser, through_outside * lost_outside / (n * n * lost_inside), through_outside);
      const F common = weight_ * lost_ * kInvPi;
      multiple_above_ =
          reflection_ * (common * (1 - through_) / select(denser, lost_inside, lost_outside));
      multiple_below_ =
          color_ * (common * through_ / (select(denser, lost_outside, lost_inside) * eta_ * eta_));
    }
  }

  F eta() const noexcept { return eta_; }  ///< n(other side) / n(wo's side)
  M is_index_matched() const noexcept { return (eta_ > 0.9999F) & (eta_ < 1.0001F); }
  /// Return the albedos of single scattering, and of diffuse multiple scattering to either side.
  F single() const noexcept { return 1 - lost_; }
  F diffuse_above() const noexcept { return weight_ * lost_ * (1 - through_); }
  F diffuse_below() const noexcept { return weight_ * lost_ * through_; }
  /// Returns whether multiple() is not 0 everywhere.
  bool has_multiple() const noexcept { return any(lost_ > 0); }
  /// Returns the BSDF of multiple scattering. above: wi is on the side of wo.
  Color multiple(const FacetsOf<F>& s, V wi, M above) const noexcept {
    const M inside = (above & (eta_ < 1)) | (opposite(above) & (eta_ > 1));
    return select(above, multiple_above_, multiple_below_) * (1 - albedo(s, wi, inside));
  }
  /// Returns the reflectance of the smooth boundary.
  Color mirrored(const FacetsOf<F>& s) const noexcept {
    return select(is_index_matched(), Color(F(0)), fresnel(s.wo.z));
  }
  /// Returns the transmittance without deflection, if the index equals that of the surroundings.
  Color null_transmittance(F open) const noexcept { return color_ * (weight_ * open); }

  template <typename Eval>
  void add(const FacetsOf<F>& s, F prob, V wi, Eval& out) const noexcept {
    const M is_rough = opposite(is_delta(s));
    if (!any(is_rough)) {
      return;
    }
    const M above = wi.z > 0;
    const V bent = s.half(wi * eta_);
    const V h = select(above, s.half(wi), select(bent.z < 0, -bent, bent));
    const F cos_o = dot(s.wo, h);
    const F cos_i = dot(wi, h);
    const Color f = fresnel(cos_o);
    const F reflected = max_component(f);
    const F denominator = square(cos_o + eta_ * cos_i);
    const F refraction =
        select((cos_o > 0) & (cos_i < 0) & (denominator > 1e-12F),
               (1 - reflected) * s.ggx.d(h) * cos_o * -cos_i / (s.wo.z * denominator), F(0));
    const F common = select(is_rough, select(above, s.reflected(h), refraction), F(0));
    const F g2 = 1 / (1 + s.lambda_o + s.ggx.lambda(wi));
    out.value_cos =
        out.value_cos + select(above, f * reflection_, color_) * (weight_ * (common * g2));
    out.pdf_solid_angle = out.pdf_solid_angle +
                          prob * select(above, reflected, eta_ * eta_) * common / (1 + s.lambda_o);
  }

  struct Sample {
    V wi;
    Color weight;  ///< where it is delta
    M is_delta;
    M is_refracted;
  };
  /// Samples wi, below the surface where it is refracted, else above; a path on the other side is
  /// absorbed. prob: of the lobe; open: fraction that the layers above let through.
  Sample sample(const FacetsOf<F>& s, F prob, F open, F u_lobe, Vec2Of<F> u) const noexcept {
    Sample out;
    out.is_delta = is_delta(s);
    V h = {0, 0, 1};
    if (!all(out.is_delta)) {
      h = select(out.is_delta, h, s.ggx.sample_visible(s.wo, u));
    }
    const F cos_o = dot(s.wo, h);
    const Color f = select(is_index_matched(), Color(F(0)), fresnel(cos_o));
    const F prob_reflect = max_component(f);
    const M is_reflected = u_lobe < prob_reflect;
    const F cos_t = safe_sqrt(1 - (1 - cos_o * cos_o) / (eta_ * eta_));
    const V bent = normalize_or(h * (cos_o / eta_ - cos_t) - s.wo * (1 / eta_), -s.wo);
    out.wi = select(is_reflected, h * (2 * cos_o) - s.wo, bent);
    const F common = weight_ * open / prob;
    out.weight = select(is_reflected, f * reflection_ * (common / prob_reflect),
                        color_ * (common / (eta_ * eta_)));
    out.is_refracted = opposite(is_reflected);
    return out;
  }

 private:
  M is_delta(const FacetsOf<F>& s) const noexcept { return s.is_smooth | is_index_matched(); }

  /// Returns the albedo of single scattering for w on either side. The reflectance of facets is
  /// least_ + slope_ F but for total reflection (with a film, about), so that the albedo is as
  /// linear: in that of glass, of a mirror, and of glass that does not reflect.
  F albedo(const FacetsOf<F>& s, V w, M inside) const noexcept {
    const F n = max(eta_, 1 / eta_);
    F out = glass_albedo(s, w, n, inside);
    if (any(is_bent_)) {
      const F open = glass_albedo(abs(w.z), s.roughness, n, inside, kAlbedoTables.open_glass);
      out = dimmed(out, albedo_of(s, w).e, open);
    }
    return out;
  }
  /// Returns its mean over the hemisphere.
  F average(const FacetsOf<F>& s, bool inside) const noexcept {
    const F n = max(eta_, 1 / eta_);
    F out = glass_albedo_average(s, n, inside);
    if (any(is_bent_)) {
      const F open = glass_albedo_average(s.roughness, n, inside, kAlbedoTables.open_glass);
      out = dimmed(out, albedo_average(s).e, open);
    }
    return out;
  }
  /// Returns the reflectance of the largest channel at the mean cosine of the hemisphere, 2/3;
  /// where there is no film, that at normal incidence. White rough solids under films of up to 1000
  /// nm gain at most 2.8% outside and 1.8% inside; without a film, 0.9% by the tables.
  [[gnu::noinline]] F mean_of_film() const noexcept {
    return max_component(film_.mixed(f0_, film_.fresnel(F(2.0F / 3.0F), f0_, f90_)));
  }
  F dimmed(F glass, F mirror, F open) const noexcept {
    return select(is_bent_, slope_ * glass + least_ * mirror + (1 - slope_ - least_) * open, glass);
  }

  /// Returns the reflectance of a facet of the solid; cos_oh on wo's side. Stretches the exact
  /// curve from F0 to 1 to the material's F0 and F90, equally for both sides; total reflection
  /// stays total. Refraction gets the remainder of the largest channel, so that it keeps its hue.
  Color fresnel(F cos_oh) const noexcept {
    const F exact = fresnel_dielectric(cos_oh, eta_);
    const M is_bent = is_bent_ & (exact < 1);
    if (!any(is_bent)) {
      return Color(exact);
    }
    const F r0 = square((1 - eta_) / (1 + eta_));
    const F w = clamp01((exact - r0) / (1 - r0));
    Color f = f0_ * (1 - w) + Color(f90_ * w);
    if (film_.exists) {
      f = with_film(cos_oh, f);
    }
    return select(is_bent, f, Color(exact));
  }

  [[gnu::noinline]] Color with_film(F cos_oh, Color bare) const noexcept {
    const F cos_outer =
        select(inside_, safe_sqrt(1 - (1 - cos_oh * cos_oh) / (eta_ * eta_)), cos_oh);
    return film_.mixed(bare, film_.fresnel(cos_outer, f0_, f90_));
  }

  Color color_;
  Color reflection_;
  F weight_;
  F eta_;
  M inside_;
  M is_bent_;  ///< F0 and F90 are not those of the index, or there is a film
  Color f0_ = Color(F(0));
  F f90_ = 1;
  F slope_ = 1;  ///< of the reflectance of the largest channel in that of the index
  F least_ = 0;  ///< its value where that is 0
  ThinFilmOf<F> film_;
  F lost_ = 0;     ///< fraction lost by single scattering
  F through_ = 0;  ///< fraction of the loss that leaves on the other side
  Color multiple_above_ = Color(F(0));
  Color multiple_below_ = Color(F(0));
};

using GlassLobe = GlassLobeOf<float>;

}  // namespace core
