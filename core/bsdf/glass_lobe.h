/// GlassLobe: the rough or smooth boundary of a solid.
///
/// Walter et al. 2007 with exact Fresnel, modified by F0 and F90 of KHR_materials_specular and by
/// the film of KHR_materials_iridescence. Multiple scattering between facets is diffuse on both
/// sides (Kulla and Conty 2017) and exact for the unmodified curve.
#pragma once

#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/thin_film.h"

namespace core {

class GlassLobe {
 public:
  /// weight: of the solid in the mixture of surface components.
  GlassLobe(const BsdfParameters& p, const Facets& s, float weight, const ThinFilm& film) noexcept;

  float eta() const noexcept { return eta_; }  ///< n(other side) / n(wo's side)
  bool is_index_matched() const noexcept { return eta_ > 0.9999F && eta_ < 1.0001F; }
  /// Return the albedos of single scattering, and of diffuse multiple scattering to either side.
  float single() const noexcept { return 1 - lost_; }
  float diffuse_above() const noexcept { return weight_ * lost_ * (1 - through_); }
  float diffuse_below() const noexcept { return weight_ * lost_ * through_; }
  /// Return the BSDF of multiple scattering at cosine mu of wi on its side; zero unless
  /// has_multiple.
  bool has_multiple_above() const noexcept { return !is_black(multiple_above_); }
  bool has_multiple_below() const noexcept { return !is_black(multiple_below_); }
  Rgb multiple_above(float mu, float roughness) const noexcept;
  Rgb multiple_below(float mu, float roughness) const noexcept;
  /// Returns the reflectance of the smooth boundary.
  Rgb mirrored(const Facets& s) const noexcept {
    return is_index_matched() ? Rgb{} : fresnel(s.wo.z);
  }
  /// Returns the transmittance without deflection, if the index equals that of the surroundings.
  Rgb straight(float open) const noexcept { return color_ * (weight_ * open); }

  void add(const Facets& s, float prob, Vec3 wi, BsdfEval& out) const noexcept;
  bool sample(const Facets& s, LobeShare share, float u_lobe, Vec2 u,
              BsdfSample& out) const noexcept;

 private:
  Rgb fresnel(float cos_oh) const noexcept;

  Rgb color_;       ///< of refraction
  Rgb reflection_;  ///< weight of reflection
  float weight_ = 0;
  float eta_ = 1;
  bool inside_ = false;
  bool is_bent_ = false;  ///< its Fresnel term is modified: the next three members apply
  Rgb f0_;
  float f90_ = 1;
  ThinFilm film_;
  float lost_ = 0;     ///< fraction lost by single scattering
  float through_ = 0;  ///< fraction of the loss that leaves on the other side
  Rgb multiple_above_;
  Rgb multiple_below_;
};

}  // namespace core
