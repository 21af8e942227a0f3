#include "core/bsdf/bsdf.h"

#include <algorithm>
#include <optional>

#include "core/math/numbers.h"

namespace core {
namespace {

/// As ExtraLanes, of one surface.
struct Extra {
  const BsdfLayers* layers = nullptr;
  const BsdfParameters* solids = nullptr;
  std::optional<WallOf<float>> walls;
  const BsdfLayers* films = nullptr;

  Extra(const BsdfParameters& p, const BsdfLayers* all) noexcept {
    const float diffuse = all == nullptr ? 0.0F : all->diffuse_transmission;
    if (!p.thin && (p.transmission > 0 || (diffuse > 0 && p.ior != 1))) {
      solids = &p;
    }
    if (diffuse > 0 || (p.transmission > 0 && p.thin)) {
      walls = {p.thin ? p.transmission : 0.0F, diffuse,
               diffuse > 0 ? all->diffuse_transmission_color : Rgb{}};
    }
    if (all != nullptr && TopLayers::exist(*all)) {
      layers = all;
    }
    if (all != nullptr && all->iridescence > 0) {
      films = all;
    }
  }
};

}  // namespace

Bsdf::Bsdf(const BsdfParameters& p, Vec3 wo_local, Vec3 ng_local, const BsdfLayers* layers) noexcept
    : BsdfOf(p, {p.alpha_x, p.alpha_y}, wo_local, ng_local, Extra(p, layers)),
      has_layers_(layers != nullptr) {
  if (is_lambert_) {
    facets_.is_smooth = false;
    prob_ = {};
    prob_[kDiffuse] = has_spread_ ? 1.0F : 0.0F;
  }
}

BsdfEval Bsdf::evaluate(Vec3 wi) const noexcept { return BsdfOf::evaluate(wi); }

BsdfSample Bsdf::sample(float u_lobe, Vec2 u_dir) const noexcept {
  return BsdfOf::sample(u_lobe, u_dir);
}

Rgb Bsdf::null_transmittance() const noexcept {
  Rgb sum;
  if (is_clear()) {
    sum += wall_->faces(interface_, facets_.wo.z).transmitted * delta_share();
  }
  if (prob_[kGlass] > 0 && glass_->is_index_matched()) {
    sum += glass_->null_transmittance(delta_share());
  }
  return sum;
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
