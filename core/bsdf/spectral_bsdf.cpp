#include "core/bsdf/spectral_bsdf.h"

namespace core {
namespace {

Rgb only(Rgb c, std::size_t i) noexcept {
  return {i == 0 ? c.r : 0.0F, i == 1 ? c.g : 0.0F, i == 2 ? c.b : 0.0F};
}

}  // namespace

SpectralBsdf::SpectralBsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
                           const BsdfLayers* layers, const SpectralSurface& at) noexcept
    : prob_(at.prob) {
  // Rounding must not pick a wavelength of probability 0.
  const std::size_t last = prob_.b > 0 ? 2 : (prob_.g > 0 ? 1 : 0);
  float u = at.u_pick;
  while (picked_ < last && !(u < prob_[static_cast<int>(picked_)])) {
    u -= prob_[static_cast<int>(picked_++)];
  }
  for (std::size_t i = 0; i < each_.size(); ++i) {
    if (prob_[static_cast<int>(i)] > 0) {
      BsdfParameters own = parameters;
      own.ior = at.ior[static_cast<int>(i)];
      each_[i].emplace(own, wo_local, ng_local, layers);
      disperses_ = disperses_ || i != picked_;
    }
  }
}

BsdfEval SpectralBsdf::evaluate(Vec3 wi) const noexcept {
  if (!disperses_) {
    return picked().evaluate(wi);
  }
  BsdfEval out;
  for (std::size_t i = 0; i < each_.size(); ++i) {
    if (each_[i]) {
      const BsdfEval one = each_[i]->evaluate(wi);
      out.value_cos += only(one.value_cos, i);
      out.pdf_solid_angle += prob_[static_cast<int>(i)] * one.pdf_solid_angle;
    }
  }
  return out;
}

BsdfSample SpectralBsdf::sample(float u_lobe, Vec2 u_dir) const noexcept {
  BsdfSample s = picked().sample(u_lobe, u_dir);
  if (!disperses_ || is_black(s.weight)) {
    return s;
  }
  s.is_null = false;  // null_transmittance() does not include it
  if (!s.is_delta) {
    const BsdfEval eval = evaluate(s.wi_local);
    s.pdf_solid_angle = eval.pdf_solid_angle;
    s.weight = eval.pdf_solid_angle > 0 ? eval.value_cos / eval.pdf_solid_angle : Rgb{};
  } else if (s.is_glass && s.transmitted) {
    s.weight = only(s.weight, picked_) / prob_[static_cast<int>(picked_)];
  } else if (s.is_glass) {
    // A mirror picks reflection with the largest component of its reflectance.
    const Rgb here = picked().mirrored_by_glass();
    Rgb each;
    float prob = 0;
    for (std::size_t i = 0; i < each_.size(); ++i) {
      if (each_[i]) {
        const Rgb one = each_[i]->mirrored_by_glass();
        const float own = here[static_cast<int>(i)];
        each += only(Rgb(own > 0 ? one[static_cast<int>(i)] / own : 0.0F), i);
        prob += prob_[static_cast<int>(i)] * max_component(one);
      }
    }
    s.weight *= each * (max_component(here) / prob);
  }
  return s;
}

}  // namespace core
