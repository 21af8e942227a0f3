/// Bsdf: the surface of one path (see BsdfOf), and operations that only single paths need.
#pragma once

#include "core/bsdf/bsdf_of.h"

namespace core {

class Bsdf : public BsdfOf<float> {
 public:
  /// layers: null if the surface has none of them.
  Bsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
       const BsdfLayers* layers = nullptr) noexcept;

  // As of BsdfOf, compiled once.
  BsdfEval evaluate(Vec3 wi_local) const noexcept;
  BsdfSample sample(float u_lobe, Vec2 u_dir) const noexcept;
  /// Samples one of the delta lobes; the weight is that of the delta lobes alone.
  BsdfSample sample_delta(float u_lobe, Vec2 u_dir) const noexcept;
  /// Returns the probability with which sample() takes a delta lobe.
  float prob_delta() const noexcept;
  /// Returns the probability with which sample() takes a diffuse lobe.
  float prob_diffuse() const noexcept { return prob_[kDiffuse] + prob_[kDiffuseTransmission]; }
  /// Returns whether reflection is diffuse-like: one Lambertian lobe, or rough reflection without
  /// further layers.
  bool is_diffuse_like() const noexcept {
    return !has_layers_ && (is_lambert_ || (!transmits() && facets_.roughness >= 0.5F));
  }
  /// Returns the transmittance without deflection (smooth thin transmission, solids with the index
  /// of their surroundings), for shadow rays.
  Rgb null_transmittance() const noexcept;
  /// Returns the reflectance of a solid's smooth boundary. Pre: sample() took the boundary.
  Rgb mirrored_by_glass() const noexcept { return glass_->mirrored(facets_); }
  /// Returns the fraction of uniform light from wo's side that the diffuse lobe reflects along wo,
  /// under the layers above it.
  Rgb diffuse_albedo() const noexcept {
    return diffuse_ * (is_lambert_ ? 1.0F : interface_.open_wo * delta_share());
  }
  /// Returns the surface without that lobe; densities stay the same.
  Bsdf without_diffuse() const noexcept {
    Bsdf rest = *this;
    rest.diffuse_ = {};
    return rest;
  }

 private:
  bool is_delta(Delta delta) const noexcept;

  bool has_layers_;
};

}  // namespace core
