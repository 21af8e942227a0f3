// Sampling of the layered BSDF: a lobe by its share of the albedo, then a direction.
#include <algorithm>
#include <cmath>

#include "core/bsdf/bsdf.h"
#include "core/bsdf/fresnel.h"
#include "core/math/frame.h"
#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {

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
    s.weight = fresnel(wo_.z) * (delta_share() / prob_specular_);
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
    s.weight = thin_ * (cover_wo_ * delta_share() / prob_thin_);
    s.is_delta = true;
    s.is_straight = true;
    return true;
  }
  const Vec3 h = ggx_.sample_visible(wo_, u);
  const Vec3 reflected = h * (2 * dot(wo_, h)) - wo_;
  s.wi_local = {reflected.x, reflected.y, -reflected.z};
  return reflected.z > 0;
}

bool Bsdf::sample_glass(float u_lobe, Vec2 u, BsdfSample& s) const noexcept {
  const bool index_matched = is_index_matched();
  const bool is_delta = is_smooth_ || index_matched;
  const Vec3 h = is_delta ? Vec3{0, 0, 1} : ggx_.sample_visible(wo_, u);
  const float cos_o = dot(wo_, h);
  const Rgb f = index_matched ? Rgb{} : glass_fresnel(cos_o);
  const float prob_reflect = max_component(f);
  s.is_delta = is_delta;
  if (u_lobe < prob_reflect) {
    s.wi_local = h * (2 * cos_o) - wo_;
    s.weight = f * glass_reflection_ * (glass_weight_ * delta_share() / (prob_glass_ * prob_reflect));
    return s.wi_local.z > 0;
  }
  const float cos_t = safe_sqrt(1 - (1 - cos_o * cos_o) / (eta_ * eta_));
  s.wi_local = normalize_or(h * (cos_o / eta_ - cos_t) - wo_ * (1 / eta_), -wo_);
  s.weight = glass_color_ * (glass_weight_ * delta_share() / (prob_glass_ * eta_ * eta_));
  s.eta = eta_;
  s.is_straight = index_matched;
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
  // Spread lobes first and delta ones last: sample_delta() relies on the order.
  float u = u_lobe;
  const auto lobe = [&u](float prob) {
    if (u < prob) {
      return true;
    }
    u -= prob;
    return false;
  };
  const auto spread = [this, u_dir] { return is_evenly_spread() ? uniform_hemisphere(u_dir) : cosine_hemisphere(u_dir); };
  if (lobe(prob_diffuse_)) {
    s.wi_local = spread();
    ok = s.wi_local.z > 0;
  } else if (lobe(prob_below_)) {
    s.wi_local = -spread();
    s.eta = prob_glass_ > 0 && is_black(below_) ? eta_ : 1.0F;
    ok = s.wi_local.z < 0;
  } else if (lobe(prob_sheen_)) {
    s.wi_local = uniform_hemisphere(u_dir);
    ok = s.wi_local.z > 0;
  } else if (!coat_smooth_ && lobe(prob_coat_)) {
    ok = sample_clearcoat(u_dir, s);
  } else if (lobe(prob_specular_)) {
    ok = sample_specular(u_dir, s);
  } else if (lobe(prob_thin_)) {
    ok = sample_thin(u_dir, s);
  } else if (lobe(coat_smooth_ ? prob_coat_ : 0.0F)) {
    ok = sample_clearcoat(u_dir, s);
  } else if (prob_glass_ > 0) {
    ok = sample_glass(std::clamp(u / prob_glass_, 0.0F, kOneMinusEpsilon), u_dir, s);
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
  const bool matched = prob_glass_ > 0 && is_index_matched();
  const float coat = coat_smooth_ ? prob_coat_ : 0.0F;
  return is_smooth_ ? prob_specular_ + prob_thin_ + coat + prob_glass_ : coat + (matched ? prob_glass_ : 0.0F);
}

BsdfSample Bsdf::sample_delta(float u_lobe, Vec2 u_dir) const noexcept {
  // The delta lobes are the last part of the interval that sample() divides; a rough solid
  // glass under a smooth coat stands after the coat, and is left out.
  const float prob = prob_delta();
  const float spread_after = !is_smooth_ && coat_smooth_ && !is_index_matched() ? prob_glass_ : 0.0F;
  BsdfSample s = sample(std::min(1 - spread_after - prob + u_lobe * prob, kOneMinusEpsilon), u_dir);
  s.weight *= prob;
  return s;
}

}  // namespace core
