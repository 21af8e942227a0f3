// Solid glass: its Fresnel curve, single scattering by facets and what meets more of them.
#include <algorithm>
#include <cmath>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/bsdf.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/thin_film.h"
#include "core/math/numbers.h"

namespace core {

/// Fresnel of the solid: F0 and F90 as KHR_materials_specular has them, and a film.
void Bsdf::prepare_glass(const BsdfParameters& p) noexcept {
  glass_color_ = p.base_color * p.refraction_weight;
  glass_reflection_ = p.reflection_weight;
  inside_ = p.inside;
  const float ior = std::max(p.ior, 1e-2F);
  eta_ = p.inside ? 1 / ior : ior;
  if (!is_smooth_ && !is_index_matched()) {
    // What is lost leaves as (1 - E) of the side it leaves to, so that each side's share is reciprocal when
    // (1 - reflected) times the mean loss is n^2 times as large outside as inside. The outer side reflects the mean of
    // Fresnel's curve (fit of d'Eon, A Hitchhiker's Guide to Multiple Scattering, 2021).
    const float n = std::max(eta_, 1 / eta_);
    const bool denser = eta_ < 1;
    const float lost = std::max(1 - glass_albedo(wo_.z, roughness_, n, denser), 0.0F);
    const float lost_outside = std::max(1 - glass_albedo_average(roughness_, n, false), 1e-4F);
    const float lost_inside = std::max(1 - glass_albedo_average(roughness_, n, true), 1e-4F);
    const float through_outside = std::min(1 - (n - 1) / (4.08567F + 1.00071F * n), n * n * lost_inside / lost_outside);
    const float through = denser ? through_outside * lost_outside / (n * n * lost_inside) : through_outside;
    const float common = glass_weight_ * lost * kInvPi;
    glass_ms_ = glass_reflection_ * (common * (1 - through) / (denser ? lost_inside : lost_outside));
    glass_ms_below_ = glass_color_ * (common * through / ((denser ? lost_outside : lost_inside) * eta_ * eta_));
    // As often as it is: more, and the weights of paths that total reflection keeps inside would grow at each turn.
    prob_diffuse_ = glass_weight_ * lost * (1 - through);
    prob_below_ = glass_weight_ * lost * through;
    prob_glass_ = 1 - lost;
  } else {
    prob_glass_ = 1;
  }
  glass_film_ = layers_ != nullptr ? layers_->iridescence : 0.0F;
  glass_bent_ = glass_film_ > 0 || p.f90 != 1 || p.specular_color.r != 1 || p.specular_color.g != 1 ||
                p.specular_color.b != 1;
  if (glass_bent_) {
    const float r0 = square((1 - ior) / (1 + ior));
    const Rgb f0 = p.specular_color * r0;
    glass_f0_ = Rgb{clamp01(f0.r), clamp01(f0.g), clamp01(f0.b)} * p.f90;
    glass_f90_ = p.f90;
  }
}

/// Reflectance of a facet of the solid; cos_oh on wo's side. The exact curve from F0 to 1 is stretched to the
/// material's F0 and F90, alike from both sides; total reflection stays total. Refraction takes what the
/// greatest channel leaves, so that it keeps its hue.
Rgb Bsdf::glass_fresnel(float cos_oh) const noexcept {
  const float exact = fresnel_dielectric(cos_oh, eta_);
  if (!glass_bent_ || exact >= 1) {
    return Rgb(exact);
  }
  const float r0 = square((1 - eta_) / (1 + eta_));
  const float w = clamp01((exact - r0) / (1 - r0));
  Rgb f = glass_f0_ * (1 - w) + Rgb(glass_f90_ * w);
  if (glass_film_ > 0) {
    const float cos_outer = inside_ ? safe_sqrt(1 - (1 - cos_oh * cos_oh) / (eta_ * eta_)) : cos_oh;
    const Rgb film = thin_film_fresnel(cos_outer, layers_->iridescence_ior, layers_->iridescence_thickness_nm, glass_f0_);
    f = f * (1 - glass_film_) + film * (glass_f90_ * glass_film_);
  }
  return f;
}

void Bsdf::add_glass(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_glass_ > 0) || is_smooth_ || is_index_matched()) {
    return;
  }
  const float lambda_o = ggx_.lambda(wo_);
  if (wi.z > 0) {
    const Vec3 h = normalize_or(wo_ + wi, {0, 0, 1});
    const Rgb f = glass_fresnel(dot(wo_, h));
    const float common = ggx_.d(h) / (4 * wo_.z);
    out.value_cos += f * glass_reflection_ * (glass_weight_ * common / (1 + lambda_o + ggx_.lambda(wi)));
    out.pdf_solid_angle += prob_glass_ * max_component(f) * common / (1 + lambda_o);
    return;
  }
  Vec3 h = normalize_or(wo_ + wi * eta_, {0, 0, 1});
  if (h.z < 0) {
    h = -h;
  }
  const float cos_o = dot(wo_, h);
  const float cos_i = dot(wi, h);
  if (!(cos_o > 0 && cos_i < 0)) {
    return;
  }
  const float t = 1 - max_component(glass_fresnel(cos_o));
  const float denominator = square(cos_o + eta_ * cos_i);
  if (!(denominator > 1e-12F)) {
    return;
  }
  const Vec3 flipped = {wi.x, wi.y, -wi.z};
  const float common = t * ggx_.d(h) * cos_o * -cos_i / (wo_.z * denominator);
  out.value_cos += glass_color_ * (glass_weight_ * common / (1 + lambda_o + ggx_.lambda(flipped)));
  out.pdf_solid_angle += prob_glass_ * common * eta_ * eta_ / (1 + lambda_o);
}

}  // namespace core
