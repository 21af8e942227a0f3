#include "core/bsdf/bsdf.h"

#include <algorithm>
#include <cstddef>

#include "core/bsdf/albedo_tables.h"
#include "core/bsdf/anisotropic_albedo.h"
#include "core/math/numbers.h"

namespace core {

Bsdf::Bsdf(const BsdfParameters& p, Vec3 wo_local, Vec3 ng_local, const BsdfLayers* layers) noexcept
    : ng_(ng_local), is_flat_(is_flat(ng_local.z)), has_layers_(layers != nullptr) {
  if (p.f90 == 0 && p.metallic == 0 && p.transmission == 0 && is_black(p.f0) && layers == nullptr) {
    is_lambert_ = true;
    diffuse_.albedo = p.base_color;
    albedo_ = p.base_color;
    has_spread_ = !is_black(p.base_color);
    prob_[kDiffuse] = has_spread_ ? 1.0F : 0.0F;
    return;
  }
  const float roughness =
      p.alpha_x == p.alpha_y ? p.roughness : mean_roughness(p.alpha_x, p.alpha_y);
  const bool is_smooth = std::max(p.alpha_x, p.alpha_y) < kSmoothAlpha;
  facets_ = {wo_local, {p.alpha_x, p.alpha_y}, roughness, is_smooth};
  const float metal = p.metallic;
  const float dielectric = 1 - metal;
  const float solid = p.thin ? 0.0F : dielectric * p.transmission;
  const float cover = dielectric - solid;  // dielectric that is not solid glass
  const float lambert = dielectric * (1 - p.transmission);
  const float mu = wo_local.z;

  diffuse_.albedo = p.base_color * lambert;
  const bool has_interface = cover > 0 && (max_component(p.f0) > 0 || p.f90 > 0);
  SpecularAlbedo e{1, 0};
  SpecularAlbedo average{1, 0};
  if (metal > 0 || has_interface || p.transmission > 0) {
    e = albedo_of(facets_, wo_local);
    average = albedo_average(facets_);
  }
  ThinFilm film;
  if (layers != nullptr) {
    film = {layers->iridescence, layers->iridescence_ior, layers->iridescence_thickness_nm,
            layers->wavelengths_nm};
  }
  if (has_interface) {
    interface_ = Interface(p, film, facets_.roughness, mu, e, average);
  }
  Rgb specular_albedo_wo;
  Rgb multiple_albedo;
  if (metal > 0 || has_interface) {
    specular_.emplace(p, metal, cover, facets_, film, e, average);
    specular_albedo_wo = specular_->albedo(facets_, e);
    multiple_albedo = specular_->multiple_albedo(facets_, e);
  }
  Rgb diffused;
  if (layers != nullptr && layers->diffuse_transmission > 0) {
    diffused = add_below(p, *layers, solid > 0 ? p.ior : 1.0F, lambert);
  }
  const Rgb substrate_albedo = diffuse_.albedo * interface_.open_wo;
  ThinLobe::Albedos wall;
  if (p.thin && p.transmission > 0) {
    thin_ = ThinLobe{p.base_color, dielectric * p.transmission, {}};
    wall = thin_->prepare(facets_, interface_, e, average);
    if (is_smooth) {
      interface_.open_wo = 1 - interface_.fresnel(mu);
    }
  }
  if (solid > 0) {
    add_solid(p, solid, film);
  }
  prob_[kDiffuse] += luminance(substrate_albedo) + luminance(multiple_albedo);
  prob_[kSpecular] = luminance(specular_albedo_wo + wall.single.reflected);
  prob_[kThin] = thin_ ? thin_->prob(wall) : 0.0F;
  prob_[kDiffuseTransmission] +=
      luminance(diffused) * interface_.open_wo + luminance(wall.multiple);
  albedo_ = substrate_albedo + multiple_albedo + specular_albedo_wo + wall.single.reflected +
            wall.single.transmitted + wall.multiple + p.base_color * solid +
            diffused * interface_.open_wo;
  if (layers != nullptr && (layers->clearcoat > 0 || max_component(layers->sheen_color) > 0)) {
    add_top(*layers);
  }
  set_probabilities();
}

Rgb Bsdf::add_below(const BsdfParameters& p, const BsdfLayers& layers, float ior,
                    float lambert) noexcept {
  // Beside refraction, it changes radiance by the squared indices too, and less of the light in
  // the denser medium passes, so that the lobe is reciprocal.
  const float eta_2 = p.inside ? 1 / (ior * ior) : ior * ior;
  const float passed = layers.diffuse_transmission * std::min(eta_2, 1.0F);
  const Rgb diffused = layers.diffuse_transmission_color * (lambert * passed);
  below_.albedo = diffused * p.refraction_weight / eta_2;
  diffuse_.albedo *= 1 - passed;
  return diffused;
}

void Bsdf::add_solid(const BsdfParameters& p, float weight, const ThinFilm& film) noexcept {
  const GlassLobe& glass = glass_.emplace(p, facets_, weight, film);
  // Equal to the true probability: with more, the weights of paths kept inside by total reflection
  // would grow at each bounce.
  prob_[kDiffuse] = glass.diffuse_above();
  prob_[kDiffuseTransmission] = glass.diffuse_below();
  prob_[kGlass] = glass.single() * (weight * std::max(luminance(p.base_color), 0.05F));
}

/// Adds clearcoat and sheen, and reduces the probabilities of the layers below.
void Bsdf::add_top(const BsdfLayers& layers) noexcept {
  const TopLayers& top = top_.emplace(layers, facets_.wo);
  for (float& prob : prob_) {
    prob *= top.open;
  }
  if (top.has_coat) {
    interface_.norm *= top.coat.diffuse_scale(interface_, facets_.roughness);
  }
  albedo_ = albedo_ * top.open + Rgb(top.coat_albedo) + top.sheen.albedo();
  prob_[kRoughCoat] = top.rough(top.coat_albedo);
  prob_[kSmoothCoat] = top.coat_albedo - prob_[kRoughCoat];
  prob_[kSheen] = luminance(top.sheen.albedo());
}

void Bsdf::set_probabilities() noexcept {
  static_assert([] {
    for (std::size_t i = 0; i < kLobes; ++i) {
      if (kLobeKinds[i].lobe != i || std::ranges::count(kSumOrder, kLobeKinds[i].lobe) != 1) {
        return false;
      }
    }
    return true;
  }());
  float sum = 0;
  for (const Lobe lobe : kSumOrder) {
    sum += prob_[lobe];
  }
  if (sum > 0) {
    for (float& prob : prob_) {
      prob /= sum;
    }
  }
  has_spread_ = !facets_.is_smooth && sum > 0;
  for (const LobeKind& kind : kLobeKinds) {
    has_spread_ = has_spread_ || (kind.delta == Delta::kNever && prob_[kind.lobe] > 0);
  }
  diffuse_.is_even = below_.is_even =
      prob_[kGlass] > 0 && !specular_ && is_black(diffuse_.albedo) && is_black(below_.albedo);
}

Rgb Bsdf::null_transmittance() const noexcept {
  Rgb sum;
  if (facets_.is_smooth && prob_[kThin] > 0) {
    sum += thin_->faces(interface_, facets_.wo.z).transmitted * delta_share();
  }
  if (prob_[kGlass] > 0 && glass_->is_index_matched()) {
    sum += glass_->null_transmittance(delta_share());
  }
  return sum;
}

/// Adds diffuse reflection, and multiple scattering of the other lobes.
void Bsdf::add_above(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_[kDiffuse] > 0)) {
    return;
  }
  Rgb f;
  if (specular_) {
    const SpecularAlbedo e = albedo_of(facets_, wi);
    f = diffuse_.f_under(wi.z, interface_, e) + specular_->multiple(e);
  } else {
    f = diffuse_.f();
  }
  if (glass_ && glass_->has_multiple()) {
    f += glass_->multiple(facets_, wi, true);
  }
  out.value_cos += f * wi.z;
  out.pdf_solid_angle += prob_[kDiffuse] * diffuse_.pdf_solid_angle(wi.z);
}

void Bsdf::add_below(Vec3 wi, BsdfEval& out) const noexcept {
  if (!(prob_[kDiffuseTransmission] > 0)) {
    return;
  }
  const float mu = -wi.z;
  const SpecularAlbedo e = specular_ || thin_ ? albedo_of(facets_, wi) : SpecularAlbedo{};
  Rgb f = specular_ ? below_.f_under(mu, interface_, e) : below_.f();
  if (glass_ && glass_->has_multiple()) {
    f += glass_->multiple(facets_, wi, false);
  }
  if (thin_) {
    f += thin_->multiple * (1 - e.e);
  }
  out.value_cos += f * mu;
  out.pdf_solid_angle += prob_[kDiffuseTransmission] * below_.pdf_solid_angle(mu);
}

BsdfEval Bsdf::evaluate_unfolded(Vec3 wi) const noexcept {
  BsdfEval out;
  if (is_lambert_) {
    if (wi.z > 0) {
      out.value_cos = diffuse_.albedo * (wi.z * kInvPi);
      out.pdf_solid_angle = wi.z * kInvPi;
    }
    return out;
  }
  const bool above = wi.z > 0;
  if (above) {
    add_above(wi, out);
  } else if (wi.z < 0) {
    add_below(wi, out);
  } else {
    return out;
  }
  BsdfEval glossy;
  if (above && specular_) {
    specular_->add(facets_, prob_[kSpecular], wi, glossy);
  }
  if (thin_) {
    thin_->add(facets_, interface_, prob_[kThin], wi, glossy);
  }
  if (prob_[kGlass] > 0) {
    glass_->add(facets_, prob_[kGlass], wi, glossy);
  }
  out.pdf_solid_angle += glossy.pdf_solid_angle;
  if (top_) {
    top_->add(wi, out.value_cos, glossy.value_cos, {prob_[kSheen], prob_[kRoughCoat]}, out);
  } else {
    out.value_cos += glossy.value_cos;
  }
  return out;
}

BsdfEval Bsdf::evaluate(Vec3 wi) const noexcept {
  if (is_flat_) {
    return evaluate_unfolded(wi);
  }
  const float side = dot(wi, ng_);
  BsdfEval out;
  if (side * wi.z > 0) {
    out = evaluate_unfolded(wi);
  }
  const Vec3 mirrored = wi - ng_ * (2 * side);
  if (side * mirrored.z > 0) {
    const BsdfEval folded = evaluate_unfolded(mirrored);
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
      s.is_mirrored = true;
    }
  }
}

/// Samples a direction of one lobe; sets the weight only if the lobe is delta. u_lobe: remapped to
/// [0,1).
bool Bsdf::sample_lobe(Lobe lobe, float u_lobe, Vec2 u, BsdfSample& s) const noexcept {
  const float prob = prob_[lobe];
  switch (lobe) {
    case kDiffuse:
      s.wi_local = diffuse_.sample(u);
      return s.wi_local.z > 0;
    case kDiffuseTransmission:
      s.wi_local = -below_.sample(u);
      s.eta = glass_ ? glass_->eta() : 1.0F;
      return s.wi_local.z < 0;
    case kSheen:
      s.wi_local = SheenLobe::sample(u);
      return s.wi_local.z > 0;
    case kRoughCoat:
    case kSmoothCoat:
      s.wi_local = top_->coat.sample(u);
      s.is_delta = lobe == kSmoothCoat;
      s.weight = Rgb(top_->mirrored() / prob);
      return s.wi_local.z > 0;
    case kSpecular: {
      const bool is_above = specular_->sample(facets_, {prob, delta_share()}, u, s);
      if (s.is_delta && thin_) {
        s.weight += thin_->faces(interface_, facets_.wo.z).reflected * (delta_share() / prob);
      }
      return is_above;
    }
    case kThin:
      s.wi_local = ThinLobe::sample(facets_, u);
      if (facets_.is_smooth) {
        s.weight = thin_->faces(interface_, facets_.wo.z).transmitted * (delta_share() / prob);
        s.is_delta = s.is_null = true;
      }
      return s.wi_local.z < 0;
    case kGlass:
      return prob > 0 && glass_->sample(facets_, {prob, delta_share()},
                                        std::clamp(u_lobe / prob, 0.0F, kOneMinusEpsilon), u, s);
    case kLobes:
      break;
  }
  return false;
}

BsdfSample Bsdf::sample(float u_lobe, Vec2 u_dir) const noexcept {
  BsdfSample s;
  if (is_lambert_ && is_flat_) {
    s.wi_local = cosine_hemisphere(u_dir);
    s.weight = s.wi_local.z > 0 ? diffuse_.albedo : Rgb{};
    s.pdf_solid_angle = s.wi_local.z * kInvPi;
    return s;
  }
  std::size_t lobe = 0;
  while (lobe + 1 < kLobes && !(u_lobe < prob_[lobe])) {
    u_lobe -= prob_[lobe++];
  }
  if (!sample_lobe(static_cast<Lobe>(lobe), u_lobe, u_dir, s)) {
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

bool Bsdf::is_delta(Delta delta) const noexcept {
  return delta == Delta::kAlways || (delta != Delta::kNever && facets_.is_smooth) ||
         (delta == Delta::kIfSmoothOrMatched && glass_ && glass_->is_index_matched());
}

float Bsdf::prob_delta() const noexcept {
  float sum = 0;
  for (const LobeKind& kind : kLobeKinds) {
    sum += is_delta(kind.delta) ? prob_[kind.lobe] : 0.0F;
  }
  return sum;
}

BsdfSample Bsdf::sample_delta(float u_lobe, Vec2 u_dir) const noexcept {
  // The delta lobes are the last part of the interval that sample() divides; rough solid glass
  // under a smooth coat comes after the coat and is skipped.
  const float prob = prob_delta();
  const bool rough_glass =
      !facets_.is_smooth && prob_[kSmoothCoat] > 0 && glass_ && !glass_->is_index_matched();
  const float spread_after = rough_glass ? prob_[kGlass] : 0.0F;
  BsdfSample s = sample(std::min(1 - spread_after - prob + u_lobe * prob, kOneMinusEpsilon), u_dir);
  s.weight *= prob;
  return s;
}

}  // namespace core
