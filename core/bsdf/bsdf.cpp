#include "core/bsdf/bsdf.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/fresnel.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Below this GGX width a lobe is a mirror: narrower ones are beyond float.
constexpr float kSmoothAlpha = 5e-4F;

Rgb one_minus(Rgb c) { return {1 - c.r, 1 - c.g, 1 - c.b}; }

/// Share of energy that comes back after two or more bounces between facets.
/// Source: Kulla and Conty 2017, with F_avg = F0 + (F90 - F0) / 21 for Schlick's Fresnel.
Rgb multiple_scattering(Rgb f0, Rgb f90, float e_average) {
  const Rgb f = f0 + (f90 - f0) * (1.0F / 21.0F);
  const auto channel = [e_average](float x) {
    return x * x * e_average / (1 - x * (1 - e_average));
  };
  return {channel(f.r), channel(f.g), channel(f.b)};
}

}  // namespace

Bsdf::Bsdf(const BsdfParameters& p, Vec3 wo_local, Vec3 ng_local) noexcept
    : wo_(wo_local), ng_(ng_local), ggx_{p.alpha_x, p.alpha_y}, roughness_(p.roughness) {
  is_flat_ = ng_.z > 0.9999995F;
  if (p.f90 == 0 && p.metallic == 0 && p.transmission == 0 && is_black(p.f0)) {
    is_lambert_ = true;
    diffuse_ = p.base_color;
    albedo_ = p.base_color;
    has_spread_ = !is_black(diffuse_);
    prob_diffuse_ = has_spread_ ? 1.0F : 0.0F;
    return;
  }
  const float metal = p.metallic;
  const float dielectric = 1 - metal;
  const float solid = p.thin ? 0.0F : dielectric * p.transmission;
  const float cover = dielectric - solid;  // dielectric surface that is not solid glass
  const float lambert = dielectric * (1 - p.transmission);
  is_smooth_ = std::max(p.alpha_x, p.alpha_y) < kSmoothAlpha;

  diffuse_ = p.base_color * lambert;
  f0_ = p.base_color * metal + p.f0 * cover;
  f90_ = Rgb(metal + p.f90 * cover);
  has_specular_ = max_component(f0_) > 0 || max_component(f90_) > 0;
  const bool has_cover = cover > 0 && (max_component(p.f0) > 0 || p.f90 > 0);
  SpecularAlbedo e{1, 0};
  SpecularAlbedo average{1, 0};
  if (has_specular_ || has_cover) {
    e = specular_albedo(wo_.z, roughness_);
    average = specular_albedo_average(roughness_);
  }
  if (has_cover) {
    cover_f0_ = p.f0;
    cover_f90_ = p.f90;
    cover_ms_ = multiple_scattering(p.f0, Rgb(p.f90), average.e);
    const auto total = [this](SpecularAlbedo a) {
      return cover_f0_ * (a.e - a.e5) + Rgb(cover_f90_ * a.e5) + cover_ms_ * (1 - a.e);
    };
    cover_wo_ = one_minus(total(e));
    const Rgb left = one_minus(total(average));
    cover_norm_ = {1 / std::max(left.r, 1e-4F), 1 / std::max(left.g, 1e-4F),
                   1 / std::max(left.b, 1e-4F)};
  }
  Rgb specular_albedo_wo;
  if (has_specular_) {
    e_wo_ = e.e;
    ms_scale_ = is_smooth_ ? 0.0F : (1 - e.e) * kInvPi / std::max(1 - average.e, 1e-4F);
    ms_color_ = cover_ms_ * cover;
    if (metal > 0) {
      ms_color_ += multiple_scattering(p.base_color, Rgb(1), average.e) * metal;
    }
    specular_albedo_wo = is_smooth_ ? fresnel_schlick(f0_, f90_, wo_.z)
                                    : f0_ * (e.e - e.e5) + f90_ * e.e5;
  }
  const Rgb substrate_albedo = diffuse_ * cover_wo_;
  const Rgb ms_albedo = is_smooth_ ? Rgb{} : ms_color_ * (1 - e.e);
  if (p.thin && p.transmission > 0) {
    thin_ = p.base_color * cover_wo_ * (dielectric * p.transmission);
    thin_scale_ = is_smooth_ ? 1.0F : 1 / std::max(e.e, 1e-3F);
  }
  if (solid > 0) {
    glass_color_ = p.base_color;
    glass_weight_ = solid;
    const float ior = std::max(p.ior, 1.0F);
    eta_ = p.inside ? 1 / ior : ior;
    glass_scale_ = is_smooth_ ? 1.0F : 1 / std::max(glass_albedo(wo_.z, roughness_, ior, p.inside), 1e-3F);
  }
  prob_diffuse_ = luminance(substrate_albedo) + luminance(ms_albedo);
  prob_specular_ = luminance(specular_albedo_wo);
  prob_thin_ = luminance(thin_);
  prob_glass_ = glass_weight_ * std::max(luminance(glass_color_), 0.05F);
  const float sum = prob_diffuse_ + prob_specular_ + prob_thin_ + prob_glass_;
  if (sum > 0) {
    prob_diffuse_ /= sum;
    prob_specular_ /= sum;
    prob_thin_ /= sum;
    prob_glass_ /= sum;
  }
  has_spread_ = prob_diffuse_ > 0 || (!is_smooth_ && sum > 0);
  albedo_ = substrate_albedo + ms_albedo + specular_albedo_wo + thin_ + glass_color_ * glass_weight_;
}

Rgb Bsdf::albedo() const noexcept { return albedo_; }

void Bsdf::add_diffuse(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_diffuse_ > 0)) {
    return;
  }
  Rgb f = diffuse_ * kInvPi;
  if (has_specular_) {
    const SpecularAlbedo e = specular_albedo(wi.z, roughness_);
    const Rgb cover_wi = one_minus(cover_f0_ * (e.e - e.e5) + Rgb(cover_f90_ * e.e5) +
                                   cover_ms_ * (1 - e.e));
    f = f * cover_wo_ * cover_wi * cover_norm_ + ms_color_ * (ms_scale_ * (1 - e.e));
  }
  out.value_cos += f * wi.z;
  out.pdf_solid_angle += prob_diffuse_ * cosine_hemisphere_pdf_solid_angle(wi.z);
}

void Bsdf::add_specular(Vec3 wi, BsdfEval& out) const noexcept {
  if (!has_specular_ || is_smooth_) {
    return;
  }
  const Vec3 h = normalize_or(wo_ + wi, {0, 0, 1});
  const float cos_oh = dot(wo_, h);
  const float d = ggx_.d(h);
  const float lambda_o = ggx_.lambda(wo_);
  const float g2 = 1 / (1 + lambda_o + ggx_.lambda(wi));
  const float common = d / (4 * wo_.z);
  out.value_cos += fresnel_schlick(f0_, f90_, cos_oh) * (common * g2);
  out.pdf_solid_angle += prob_specular_ * common / (1 + lambda_o);
}

void Bsdf::add_thin(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_thin_ > 0) || is_smooth_) {
    return;
  }
  const Vec3 flipped = {wi.x, wi.y, -wi.z};
  const Vec3 h = normalize_or(wo_ + flipped, {0, 0, 1});
  const float lambda_o = ggx_.lambda(wo_);
  const float common = ggx_.d(h) / (4 * wo_.z);
  out.value_cos += thin_ * (thin_scale_ * common / (1 + lambda_o + ggx_.lambda(flipped)));
  out.pdf_solid_angle += prob_thin_ * common / (1 + lambda_o);
}

void Bsdf::add_glass(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_glass_ > 0) || is_smooth_ || std::fabs(eta_ - 1) < 1e-4F) {
    return;
  }
  const float lambda_o = ggx_.lambda(wo_);
  if (wi.z > 0) {
    const Vec3 h = normalize_or(wo_ + wi, {0, 0, 1});
    const float f = fresnel_dielectric(dot(wo_, h), eta_);
    const float common = ggx_.d(h) / (4 * wo_.z);
    out.value_cos += Rgb(glass_weight_ * glass_scale_ * f * common / (1 + lambda_o + ggx_.lambda(wi)));
    out.pdf_solid_angle += prob_glass_ * f * common / (1 + lambda_o);
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
  const float t = 1 - fresnel_dielectric(cos_o, eta_);
  const float denominator = square(cos_o + eta_ * cos_i);
  if (!(denominator > 1e-12F)) {
    return;
  }
  const Vec3 flipped = {wi.x, wi.y, -wi.z};
  const float common = t * ggx_.d(h) * cos_o * -cos_i / (wo_.z * denominator);
  out.value_cos += glass_color_ * (glass_weight_ * glass_scale_ * common / (1 + lambda_o + ggx_.lambda(flipped)));
  out.pdf_solid_angle += prob_glass_ * common * eta_ * eta_ / (1 + lambda_o);
}

BsdfEval Bsdf::evaluate_raw(Vec3 wi) const noexcept {
  BsdfEval out;
  if (is_lambert_) {
    if (wi.z > 0) {
      out.value_cos = diffuse_ * (wi.z * kInvPi);
      out.pdf_solid_angle = wi.z * kInvPi;
    }
    return out;
  }
  if (wi.z > 0) {
    add_diffuse(wi, out);
    add_specular(wi, out);
    add_glass(wi, out);
  } else if (wi.z < 0) {
    add_thin(wi, out);
    add_glass(wi, out);
  }
  return out;
}

BsdfEval Bsdf::evaluate(Vec3 wi) const noexcept {
  if (is_flat_) {
    return evaluate_raw(wi);
  }
  const float side = dot(wi, ng_);
  BsdfEval out;
  if (side * wi.z > 0) {
    out = evaluate_raw(wi);
  }
  const Vec3 mirrored = wi - ng_ * (2 * side);
  if (side * mirrored.z > 0) {
    const BsdfEval folded = evaluate_raw(mirrored);
    out.value_cos += folded.value_cos;
    out.pdf_solid_angle += folded.pdf_solid_angle;
  }
  return out;
}

void Bsdf::respect_geometry(BsdfSample& s) const noexcept {
  s.transmitted = s.wi_local.z < 0;
  if (!is_flat_) {
    const float side = dot(s.wi_local, ng_);
    if (side * s.wi_local.z < 0) {
      s.wi_local = s.wi_local - ng_ * (2 * side);
    }
  }
}

bool Bsdf::sample_specular(Vec2 u, BsdfSample& s) const noexcept {
  if (is_smooth_) {
    s.wi_local = {-wo_.x, -wo_.y, wo_.z};
    s.weight = fresnel_schlick(f0_, f90_, wo_.z) / prob_specular_;
    s.is_delta = true;
    return true;
  }
  const Vec3 h = ggx_.sample_visible(wo_, u);
  s.wi_local = h * (2 * dot(wo_, h)) - wo_;
  return s.wi_local.z > 0;
}

bool Bsdf::sample_thin(Vec2 u, BsdfSample& s) const noexcept {
  if (is_smooth_) {
    s.wi_local = -wo_;
    s.weight = thin_ / prob_thin_;
    s.is_delta = true;
    return true;
  }
  const Vec3 h = ggx_.sample_visible(wo_, u);
  const Vec3 reflected = h * (2 * dot(wo_, h)) - wo_;
  s.wi_local = {reflected.x, reflected.y, -reflected.z};
  return reflected.z > 0;
}

bool Bsdf::sample_glass(float u_lobe, Vec2 u, BsdfSample& s) const noexcept {
  const bool index_matched = std::fabs(eta_ - 1) < 1e-4F;
  const bool is_delta = is_smooth_ || index_matched;
  const Vec3 h = is_delta ? Vec3{0, 0, 1} : ggx_.sample_visible(wo_, u);
  const float cos_o = dot(wo_, h);
  const float f = index_matched ? 0.0F : fresnel_dielectric(cos_o, eta_);
  s.is_delta = is_delta;
  if (u_lobe < f) {
    s.wi_local = h * (2 * cos_o) - wo_;
    s.weight = Rgb(glass_weight_ / prob_glass_);
    return s.wi_local.z > 0;
  }
  const float cos_t = safe_sqrt(1 - (1 - cos_o * cos_o) / (eta_ * eta_));
  s.wi_local = normalize_or(h * (cos_o / eta_ - cos_t) - wo_ * (1 / eta_), -wo_);
  s.weight = glass_color_ * (glass_weight_ / (prob_glass_ * eta_ * eta_));
  s.eta = eta_;
  return s.wi_local.z < 0;
}

BsdfSample Bsdf::sample(float u_lobe, Vec2 u_dir) const noexcept {
  BsdfSample s;
  if (is_lambert_ && is_flat_) {
    s.wi_local = cosine_hemisphere(u_dir);
    s.weight = s.wi_local.z > 0 ? diffuse_ : Rgb{};
    s.pdf_solid_angle = s.wi_local.z * kInvPi;
    return s;
  }
  bool ok = false;
  if (u_lobe < prob_diffuse_) {
    s.wi_local = cosine_hemisphere(u_dir);
    ok = s.wi_local.z > 0;
  } else if (u_lobe < prob_diffuse_ + prob_specular_) {
    ok = sample_specular(u_dir, s);
  } else if (u_lobe < prob_diffuse_ + prob_specular_ + prob_thin_) {
    ok = sample_thin(u_dir, s);
  } else if (prob_glass_ > 0) {
    const float rest = u_lobe - (prob_diffuse_ + prob_specular_ + prob_thin_);
    ok = sample_glass(std::clamp(rest / prob_glass_, 0.0F, kOneMinusEpsilon), u_dir, s);
  }
  if (!ok) {
    return BsdfSample{};
  }
  respect_geometry(s);
  if (s.is_delta) {
    return s;
  }
  const BsdfEval eval = evaluate(s.wi_local);
  if (!(eval.pdf_solid_angle > 0)) {
    return BsdfSample{};
  }
  s.weight = eval.value_cos / eval.pdf_solid_angle;
  s.pdf_solid_angle = eval.pdf_solid_angle;
  return s;
}

float Bsdf::prob_delta() const noexcept {
  const bool matched = prob_glass_ > 0 && std::fabs(eta_ - 1) < 1e-4F;
  return is_smooth_ ? 1 - prob_diffuse_ : (matched ? prob_glass_ : 0.0F);
}

BsdfSample Bsdf::sample_delta(float u_lobe, Vec2 u_dir) const noexcept {
  // The delta lobes are the last part of the interval that sample() divides.
  const float prob = prob_delta();
  BsdfSample s = sample(std::min(1 - prob + u_lobe * prob, kOneMinusEpsilon), u_dir);
  s.weight *= prob;
  return s;
}

}  // namespace core
