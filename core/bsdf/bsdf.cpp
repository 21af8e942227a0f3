#include "core/bsdf/bsdf.h"

#include <algorithm>
#include <cmath>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/fresnel.h"
#include "core/bsdf/sheen.h"
#include "core/bsdf/thin_film.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// Below this GGX width a lobe is a mirror: narrower ones are beyond float.
constexpr float kSmoothAlpha = 5e-4F;

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

Bsdf::Bsdf(const BsdfParameters& p, Vec3 wo_local, Vec3 ng_local, const BsdfLayers* layers) noexcept
    : wo_(wo_local), ng_(ng_local), ggx_{p.alpha_x, p.alpha_y}, roughness_(p.roughness), layers_(layers) {
  is_flat_ = ng_.z > 0.9999995F;
  if (p.alpha_x != p.alpha_y) {
    // The tables know round lobes. One whose width is the quadratic mean has the albedo of the long one within 0.06 at
    // widths 1 and 0.01, and within 0.02 at 0.6 and 0.15; the roughness across it would be off by 0.4.
    roughness_ = std::sqrt(std::sqrt(0.5F * (square(p.alpha_x) + square(p.alpha_y))));
  }
  if (p.f90 == 0 && p.metallic == 0 && p.transmission == 0 && is_black(p.f0) &&
      layers == nullptr) {
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
  if (has_specular_ || has_cover || p.transmission > 0) {
    e = specular_albedo(wo_.z, roughness_);
    average = specular_albedo_average(roughness_);
  }
  if (layers_ != nullptr && layers_->iridescence > 0 && has_specular_) {
    film_weight_ = layers_->iridescence;
    film_base_f0_ = f0_ / (metal + cover);
  }
  if (has_cover) {
    prepare_cover(p, e, average);
  }
  Rgb specular_albedo_wo;
  if (has_specular_) {
    e_wo_ = e.e;
    ms_scale_ = is_smooth_ ? 0.0F : (1 - e.e) * kInvPi / std::max(1 - average.e, 1e-4F);
    ms_color_ = multiple_scattering(p.f0, Rgb(p.f90), average.e) * cover;
    if (metal > 0) {
      ms_color_ += multiple_scattering(p.base_color, Rgb(1), average.e) * metal;
    }
    specular_albedo_wo = is_smooth_ ? fresnel_schlick(f0_, f90_, wo_.z)
                                    : f0_ * (e.e - e.e5) + f90_ * e.e5;
  }
  if (layers_ != nullptr && layers_->diffuse_transmission > 0) {
    below_ = layers_->diffuse_transmission_color * (lambert * layers_->diffuse_transmission);
    diffuse_ *= 1 - layers_->diffuse_transmission;
  }
  if (film_weight_ > 0) {
    // At the view angle, for the albedo that picks lobes; evaluation uses the half vector.
    specular_albedo_wo = specular_albedo_wo * (1 - film_weight_) +
                         fresnel(wo_.z) * (is_smooth_ ? film_weight_ : film_weight_ * e.e);
  }
  const Rgb substrate_albedo = diffuse_ * cover_wo_;
  const Rgb ms_albedo = is_smooth_ ? Rgb{} : ms_color_ * (1 - e.e);
  if (p.thin && p.transmission > 0) {
    thin_ = p.base_color * (dielectric * p.transmission);
    if (is_smooth_) {
      cover_wo_ = 1 - cover_fresnel(wo_.z);
    } else {  // what meets more than one facet goes on diffusely
      below_ms_ = thin_ * ((1 - cover_ms_) * (1 - e.e) * kInvPi / std::max(1 - average.e, 1e-4F));
    }
  }
  if (solid > 0) {
    glass_weight_ = solid;
    prepare_glass(p);
  }
  prob_diffuse_ += luminance(substrate_albedo) + luminance(ms_albedo);
  prob_specular_ = luminance(specular_albedo_wo);
  const float thin_diffuse = is_smooth_ ? 0.0F : (1 - e.e) * (1 - cover_ms_);
  prob_thin_ = luminance(thin_) * std::max(cover_wo_ - thin_diffuse, 0.01F);
  prob_glass_ *= glass_weight_ * std::max(luminance(p.base_color), 0.05F);
  prob_below_ += luminance(below_) * cover_wo_ + luminance(thin_) * thin_diffuse;
  albedo_ = substrate_albedo + ms_albedo + specular_albedo_wo + thin_ * cover_wo_ + p.base_color * glass_weight_ +
            below_ * cover_wo_;
  below_ *= p.refraction_weight;
  if (layers_ != nullptr) {
    prepare_layers();
  }
  const float sum = prob_diffuse_ + prob_specular_ + prob_thin_ + prob_glass_ + prob_below_ + prob_coat_ +
                    prob_sheen_;
  if (sum > 0) {
    for (float* prob : {&prob_diffuse_, &prob_specular_, &prob_thin_, &prob_glass_, &prob_below_,
                        &prob_coat_, &prob_sheen_}) {
      *prob /= sum;
    }
  }
  has_spread_ = prob_diffuse_ + prob_below_ + prob_sheen_ > 0 || (!is_smooth_ && sum > 0) ||
                (prob_coat_ > 0 && !coat_smooth_);
}

/// What a facet of the cover reflects of the greatest channel, which is lost to thin transmission.
float Bsdf::cover_fresnel(float cos_oh) const noexcept {
  const float plain = lerp(cover_f0_, cover_f90_, schlick_weight(cos_oh));
  if (!(film_weight_ > 0)) {
    return plain;
  }
  const Rgb film = thin_film_fresnel(std::max(cos_oh, 0.0F), layers_->iridescence_ior,
                                     layers_->iridescence_thickness_nm, cover_film_f0_);
  return lerp(plain, max_component(film) * cover_f90_, film_weight_);
}

/// KHR_materials_specular dims what lies below by the greatest channel, so that it keeps its hue.
void Bsdf::prepare_cover(const BsdfParameters& p, SpecularAlbedo wo, SpecularAlbedo average) noexcept {
  cover_f0_ = max_component(p.f0);
  cover_f90_ = p.f90;
  cover_film_f0_ = p.f0;
  cover_ms_ = multiple_scattering(Rgb(cover_f0_), Rgb(cover_f90_), average.e).r;
  cover_wo_ = 1 - cover_albedo(wo_.z, wo);
  // The mean over the hemisphere; of a film by the two points of Gauss's rule for the weight 2 mu.
  constexpr float kMu[2] = {0.3550510F, 0.8449490F};
  constexpr float kWeight[2] = {0.3639173F, 0.6360827F};
  float mean = 0;
  if (film_weight_ > 0) {
    for (int i = 0; i < 2; ++i) {
      mean += kWeight[i] * cover_albedo(kMu[i], specular_albedo(kMu[i], roughness_));
    }
  } else {
    mean = cover_albedo(1, average);
  }
  cover_norm_ = 1 / std::max(1 - mean, 1e-4F);
}

/// What the dielectric cover reflects of light at cosine mu, where the lobe's own albedo is e.
float Bsdf::cover_albedo(float mu, SpecularAlbedo e) const noexcept {
  float single = cover_f0_ * (e.e - e.e5) + cover_f90_ * e.e5;
  if (film_weight_ > 0) {
    const Rgb film = thin_film_fresnel(mu, layers_->iridescence_ior, layers_->iridescence_thickness_nm,
                                       cover_film_f0_);
    single = lerp(single, max_component(film) * cover_f90_ * e.e, film_weight_);
  }
  return single + cover_ms_ * (1 - e.e);
}

/// Clearcoat and sheen: what they reflect, and how much less the layers below are picked.
void Bsdf::prepare_layers() noexcept {
  float below = 1;
  if (layers_->clearcoat > 0) {
    const float alpha = std::max(square(layers_->clearcoat_roughness), 1e-4F);
    coat_ = {alpha, alpha};
    coat_smooth_ = alpha < kSmoothAlpha;
    coat_mu_ = std::max(dot(wo_, layers_->clearcoat_normal), 1e-3F);
    const auto weighted = [this](SpecularAlbedo a) {
      return layers_->clearcoat * (0.04F * (a.e - a.e5) + a.e5);
    };
    coat_e_wo_ = weighted(specular_albedo(coat_mu_, layers_->clearcoat_roughness));
    coat_e_average_ = weighted(specular_albedo_average(layers_->clearcoat_roughness));
    below *= 1 - coat_e_wo_;
    prob_coat_ = coat_e_wo_;
  }
  sheen_max_ = max_component(layers_->sheen_color);
  if (sheen_max_ > 0) {
    sheen_e_wo_ = sheen_albedo(wo_.z, layers_->sheen_roughness);
    const float open = 1 - sheen_max_ * sheen_e_wo_;
    below *= open;
    prob_coat_ *= open;
    prob_sheen_ = luminance(layers_->sheen_color) * sheen_e_wo_;
  }
  for (float* prob : {&prob_diffuse_, &prob_specular_, &prob_thin_, &prob_glass_, &prob_below_}) {
    *prob *= below;
  }
  albedo_ = albedo_ * below + Rgb(prob_coat_) + layers_->sheen_color * sheen_e_wo_;
}

Rgb Bsdf::fresnel(float cos_oh) const noexcept {
  const Rgb plain = fresnel_schlick(f0_, f90_, cos_oh);
  if (!(film_weight_ > 0)) {
    return plain;
  }
  const Rgb film = thin_film_fresnel(std::max(cos_oh, 0.0F), layers_->iridescence_ior,
                                     layers_->iridescence_thickness_nm, film_base_f0_);
  return plain * (1 - film_weight_) + film * (f90_ * film_weight_);
}

/// Share of light that the dielectric cover lets through to the substrate, at cosine mu.
float Bsdf::cover_share(float mu) const noexcept {
  return 1 - cover_albedo(mu, specular_albedo(mu, roughness_));
}

void Bsdf::add_below(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_below_ > 0)) {
    return;
  }
  Rgb f = below_ * kInvPi;
  if (has_specular_) {
    f *= cover_wo_ * cover_share(-wi.z) * cover_norm_;
  }
  if (!is_black(glass_ms_below_)) {
    f += glass_ms_below_ * (1 - glass_albedo(-wi.z, roughness_, std::max(eta_, 1 / eta_), eta_ > 1));
  }
  if (!is_black(below_ms_)) {
    f += below_ms_ * (1 - specular_albedo(-wi.z, roughness_).e);
  }
  out.value_cos += f * -wi.z;
  out.pdf_solid_angle +=
      prob_below_ * (is_evenly_spread() ? 0.5F * kInvPi : cosine_hemisphere_pdf_solid_angle(-wi.z));
}

/// The coat's own lobe, about its own normal; what lies below has been scaled already.
void Bsdf::add_clearcoat(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_coat_ > 0) || coat_smooth_) {
    return;
  }
  const Frame frame = frame_from_normal(layers_->clearcoat_normal);
  const Vec3 i = frame.to_local(wi);
  Vec3 o = frame.to_local(wo_);
  o.z = std::max(o.z, 1e-3F);
  if (!(i.z > 0)) {
    return;
  }
  const Vec3 h = normalize_or(o + i, {0, 0, 1});
  const float lambda_o = coat_.lambda(o);
  const float common = coat_.d(h) / (4 * o.z);
  const float f = lerp(0.04F, 1.0F, schlick_weight(dot(o, h)));
  out.value_cos += Rgb(layers_->clearcoat * f * common / (1 + lambda_o + coat_.lambda(i)));
  out.pdf_solid_angle += prob_coat_ * common / (1 + lambda_o);
}

bool Bsdf::sample_clearcoat(Vec2 u, BsdfSample& s) const noexcept {
  const Frame frame = frame_from_normal(layers_->clearcoat_normal);
  Vec3 o = frame.to_local(wo_);
  o.z = std::max(o.z, 1e-3F);
  const Vec3 h = coat_smooth_ ? Vec3{0, 0, 1} : coat_.sample_visible(o, u);
  const Vec3 i = h * (2 * dot(o, h)) - o;
  if (coat_smooth_) {
    s.is_delta = true;
    const float open = sheen_max_ > 0 ? 1 - sheen_max_ * sheen_e_wo_ : 1.0F;
    s.weight = Rgb(open * layers_->clearcoat * lerp(0.04F, 1.0F, schlick_weight(o.z)) / prob_coat_);
  }
  s.wi_local = normalize_or(frame.to_world(i), {0, 0, 1});
  return i.z > 0 && s.wi_local.z > 0;
}

void Bsdf::add_sheen(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_sheen_ > 0)) {
    return;
  }
  out.value_cos += layers_->sheen_color * (sheen_brdf(wo_, wi, layers_->sheen_roughness) * wi.z);
  out.pdf_solid_angle += prob_sheen_ * (0.5F * kInvPi);
}

Rgb Bsdf::albedo() const noexcept { return albedo_; }

Rgb Bsdf::straight() const noexcept {
  Rgb sum;
  if (is_smooth_ && prob_thin_ > 0) {
    sum += thin_ * (cover_wo_ * delta_share());
  }
  if (prob_glass_ > 0 && is_index_matched()) {
    sum += glass_color_ * (glass_weight_ * delta_share());
  }
  return sum;
}

void Bsdf::add_diffuse(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_diffuse_ > 0)) {
    return;
  }
  Rgb f = diffuse_ * kInvPi;
  if (has_specular_) {
    const SpecularAlbedo e = specular_albedo(wi.z, roughness_);
    f = f * (cover_wo_ * cover_share(wi.z) * cover_norm_) + ms_color_ * (ms_scale_ * (1 - e.e));
  }
  if (!is_black(glass_ms_)) {
    f += glass_ms_ * (1 - glass_albedo(wi.z, roughness_, std::max(eta_, 1 / eta_), eta_ < 1));
  }
  out.value_cos += f * wi.z;
  out.pdf_solid_angle +=
      prob_diffuse_ * (is_evenly_spread() ? 0.5F * kInvPi : cosine_hemisphere_pdf_solid_angle(wi.z));
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
  out.value_cos += fresnel(cos_oh) * (common * g2);
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
  const float open = 1 - cover_fresnel(dot(wo_, h));
  out.value_cos += thin_ * (open * common / (1 + lambda_o + ggx_.lambda(flipped)));
  out.pdf_solid_angle += prob_thin_ * common / (1 + lambda_o);
}

/// Albedo of the coat from the side of wi, as weighted as coat_e_wo_.
float Bsdf::coat_albedo(Vec3 wi) const noexcept {
  const float mu = dot(wi, layers_->clearcoat_normal);
  const SpecularAlbedo a = specular_albedo(std::max(wi.z > 0 ? mu : -mu, 1e-3F), layers_->clearcoat_roughness);
  return layers_->clearcoat * (0.04F * (a.e - a.e5) + a.e5);
}

/// What clearcoat and sheen leave of a delta lobe below them; its wi has the cosine of wo.
float Bsdf::delta_share() const noexcept {
  return layers_ == nullptr ? 1.0F : (1 - coat_e_wo_) * (1 - sheen_max_ * sheen_e_wo_);
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
  } else if (wi.z < 0) {
    add_below(wi, out);
  } else {
    return out;
  }
  if (coat_e_wo_ > 0) {
    out.value_cos *= (1 - coat_e_wo_) * (1 - coat_albedo(wi)) / (1 - coat_e_average_);
  }
  BsdfEval glossy;
  if (wi.z > 0) {
    add_specular(wi, glossy);
    add_glass(wi, glossy);
  } else {
    add_thin(wi, glossy);
    add_glass(wi, glossy);
  }
  if (coat_e_wo_ > 0) {
    glossy.value_cos *= 1 - std::max(coat_e_wo_, coat_albedo(wi));
  }
  out.value_cos += glossy.value_cos;
  out.pdf_solid_angle += glossy.pdf_solid_angle;
  if (layers_ != nullptr && wi.z > 0) {
    add_clearcoat(wi, out);
  }
  if (sheen_max_ > 0) {
    out.value_cos *= 1 - sheen_max_ * std::max(sheen_e_wo_, sheen_albedo(std::fabs(wi.z), layers_->sheen_roughness));
    if (wi.z > 0) {
      add_sheen(wi, out);
    }
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

}  // namespace core
