#include "core/bsdf/glass_lobe.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/fresnel.h"
#include "core/math/numbers.h"

namespace core {

GlassLobe::GlassLobe(const BsdfParameters& p, const Facets& s, float weight,
                     const ThinFilm& film) noexcept
    : color_(p.base_color * p.refraction_weight),
      reflection_(p.reflection_weight),
      weight_(weight),
      inside_(p.inside),
      film_(film) {
  const float ior = std::max(p.ior, 1e-2F);
  eta_ = p.inside ? 1 / ior : ior;
  if (!s.is_smooth && !is_index_matched()) {
    // Lost energy leaves in proportion to (1 - E) of the side it leaves to. Each side is then
    // reciprocal if (1 - reflected) times the mean loss is n^2 times as large outside as inside.
    // The outer side reflects the mean of Fresnel's curve (fit of d'Eon, A Hitchhiker's Guide to
    // Multiple Scattering, 2021).
    const float n = std::max(eta_, 1 / eta_);
    const bool denser = eta_ < 1;
    lost_ = std::max(1 - glass_albedo(s.wo.z, s.roughness, n, denser), 0.0F);
    const float lost_outside = std::max(1 - glass_albedo_average(s.roughness, n, false), 1e-4F);
    const float lost_inside = std::max(1 - glass_albedo_average(s.roughness, n, true), 1e-4F);
    const float through_outside =
        std::min(1 - (n - 1) / (4.08567F + 1.00071F * n), n * n * lost_inside / lost_outside);
    through_ = denser ? through_outside * lost_outside / (n * n * lost_inside) : through_outside;
    const float common = weight_ * lost_ * kInvPi;
    multiple_above_ =
        reflection_ * (common * (1 - through_) / (denser ? lost_inside : lost_outside));
    multiple_below_ =
        color_ * (common * through_ / ((denser ? lost_outside : lost_inside) * eta_ * eta_));
  }
  is_bent_ = film_.weight > 0 || p.f90 != 1 || p.specular_color.r != 1 || p.specular_color.g != 1 ||
             p.specular_color.b != 1;
  if (is_bent_) {
    const Rgb f0 = p.specular_color * square((1 - ior) / (1 + ior));
    f0_ = Rgb{clamp01(f0.r), clamp01(f0.g), clamp01(f0.b)} * p.f90;
    f90_ = p.f90;
  }
}

Rgb GlassLobe::multiple_above(float mu, float roughness) const noexcept {
  return multiple_above_ * (1 - glass_albedo(mu, roughness, std::max(eta_, 1 / eta_), eta_ < 1));
}

Rgb GlassLobe::multiple_below(float mu, float roughness) const noexcept {
  return multiple_below_ * (1 - glass_albedo(mu, roughness, std::max(eta_, 1 / eta_), eta_ > 1));
}

/// Returns the reflectance of a facet of the solid; cos_oh on wo's side. Stretches the exact curve
/// from F0 to 1 to the material's F0 and F90, equally for both sides; total reflection stays total.
/// Refraction gets the remainder of the largest channel, so that it keeps its hue.
Rgb GlassLobe::fresnel(float cos_oh) const noexcept {
  const float exact = fresnel_dielectric(cos_oh, eta_);
  if (!is_bent_ || exact >= 1) {
    return Rgb(exact);
  }
  const float r0 = square((1 - eta_) / (1 + eta_));
  const float w = clamp01((exact - r0) / (1 - r0));
  Rgb f = f0_ * (1 - w) + Rgb(f90_ * w);
  if (film_.weight > 0) {
    const float cos_outer = inside_ ? safe_sqrt(1 - (1 - cos_oh * cos_oh) / (eta_ * eta_)) : cos_oh;
    f = f * (1 - film_.weight) + film_.fresnel(cos_outer, f0_) * (f90_ * film_.weight);
  }
  return f;
}

void GlassLobe::add(const Facets& s, float prob, Vec3 wi, BsdfEval& out) const noexcept {
  if (s.is_smooth || is_index_matched()) {
    return;
  }
  if (wi.z > 0) {
    const Vec3 h = s.half(wi);
    const Rgb f = fresnel(dot(s.wo, h));
    const auto reflection = s.reflection(prob * max_component(f), wi, h);
    out.value_cos += f * reflection_ * (weight_ * reflection.value_cos);
    out.pdf_solid_angle += reflection.pdf_solid_angle;
    return;
  }
  Vec3 h = s.half(wi * eta_);
  if (h.z < 0) {
    h = -h;
  }
  const float cos_o = dot(s.wo, h);
  const float cos_i = dot(wi, h);
  if (!(cos_o > 0 && cos_i < 0)) {
    return;
  }
  const float t = 1 - max_component(fresnel(cos_o));
  const float denominator = square(cos_o + eta_ * cos_i);
  if (!(denominator > 1e-12F)) {
    return;
  }
  const Vec3 flipped = {wi.x, wi.y, -wi.z};
  const float common = t * s.ggx.d(h) * cos_o * -cos_i / (s.wo.z * denominator);
  out.value_cos += color_ * (weight_ * common / (1 + s.lambda_o + s.ggx.lambda(flipped)));
  out.pdf_solid_angle += prob * common * eta_ * eta_ / (1 + s.lambda_o);
}

bool GlassLobe::sample(const Facets& s, LobeShare share, float u_lobe, Vec2 u,
                       BsdfSample& out) const noexcept {
  const bool index_matched = is_index_matched();
  out.is_delta = s.is_smooth || index_matched;
  const Vec3 h = out.is_delta ? Vec3{0, 0, 1} : s.ggx.sample_visible(s.wo, u);
  const float cos_o = dot(s.wo, h);
  out.is_glass = true;
  const Rgb f = index_matched ? Rgb{} : fresnel(cos_o);
  const float prob_reflect = max_component(f);
  if (u_lobe < prob_reflect) {
    out.wi_local = h * (2 * cos_o) - s.wo;
    out.weight = f * reflection_ * (weight_ * share.open / (share.prob * prob_reflect));
    return out.wi_local.z > 0;
  }
  const float cos_t = safe_sqrt(1 - (1 - cos_o * cos_o) / (eta_ * eta_));
  out.wi_local = normalize_or(h * (cos_o / eta_ - cos_t) - s.wo * (1 / eta_), -s.wo);
  out.weight = color_ * (weight_ * share.open / (share.prob * eta_ * eta_));
  out.eta = eta_;
  out.is_null = index_matched;
  return out.wi_local.z < 0;
}

}  // namespace core
