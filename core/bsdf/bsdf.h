/// Bsdf: the layered glTF surface at one point, seen from one direction.
///
/// Frame: local shading frame, n = (0,0,1) on the viewer's side, so wo.z > 0. wo points to the
/// viewer, wi to the light; both are unit vectors away from the surface; wi.z < 0 is transmission.
/// Lobes, one file each: GGX reflection of metal and of a dielectric interface (SpecularLobe), over
/// Lambertian reflection and diffuse transmission (DiffuseLobe, coupled by Interface), thin
/// transmission (ThinLobe) or solid glass (GlassLobe); on top of them TopLayers. All are
/// reciprocal. Directions on one side of the shading frame but on the other side of the horizon
/// (Shading::horizon) are mirrored at the horizon plane, in evaluation, density and sampling alike,
/// so a lossless surface stays lossless and no light leaks through.
///
/// Describes the transport of radiance; for power that arrives along wo see
/// core/materials/adjoint_bsdf.h.
#pragma once

#include <array>
#include <optional>

#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/diffuse_lobe.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/glass_lobe.h"
#include "core/bsdf/interface.h"
#include "core/bsdf/specular_lobe.h"
#include "core/bsdf/thin_lobe.h"
#include "core/bsdf/top_layers.h"

namespace core {

class Bsdf {
 public:
  /// wo_local.z > 0; ng_local: geometric normal on wo's side, unit. layers: null if the surface has
  /// none of them.
  Bsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
       const BsdfLayers* layers = nullptr) noexcept;

  BsdfEval evaluate(Vec3 wi_local) const noexcept;
  /// Samples a direction. Weight 0 and pdf 0 mean that the path is absorbed. u_lobe, u_dir in
  /// [0,1).
  BsdfSample sample(float u_lobe, Vec2 u_dir) const noexcept;
  /// Samples one of the delta lobes; the weight is that of the delta lobes alone.
  BsdfSample sample_delta(float u_lobe, Vec2 u_dir) const noexcept;
  /// Returns the probability with which sample() takes a delta lobe.
  float prob_delta() const noexcept;
  /// Returns the probability with which sample() takes a diffuse lobe.
  float prob_diffuse() const noexcept { return prob_[kDiffuse] + prob_[kDiffuseTransmission]; }
  /// Returns whether any lobe has a density over solid angle, so that light sampling is useful.
  bool has_spread() const noexcept { return has_spread_; }
  /// Returns whether reflection is diffuse-like: one Lambertian lobe, or rough reflection without
  /// further layers.
  bool is_diffuse_like() const noexcept {
    return is_lambert_ || (!transmits() && !has_layers_ && facets_.roughness >= 0.5F);
  }
  bool transmits() const noexcept {
    return prob_[kThin] + prob_[kGlass] + prob_[kDiffuseTransmission] > 0;
  }
  /// Returns the transmittance without deflection (smooth thin transmission, solids with the index
  /// of their surroundings), for shadow rays.
  Rgb null_transmittance() const noexcept;
  /// Returns the reflectance of a solid's smooth boundary. Pre: sample() took the boundary.
  Rgb mirrored_by_glass() const noexcept { return glass_->mirrored(facets_); }
  /// Returns the fraction of delta lobes that clearcoat and sheen let through.
  float delta_share() const noexcept { return top_ ? top_->open : 1.0F; }
  /// Returns the reflected and transmitted fraction of light from wo, per channel, for the albedo
  /// layer.
  Rgb albedo() const noexcept { return albedo_; }
  /// Returns the fraction of uniform light from wo's side that the diffuse lobe reflects along wo,
  /// under the layers above it.
  Rgb diffuse_albedo() const noexcept {
    return diffuse_.albedo * ((specular_ ? interface_.open_wo : 1.0F) * delta_share());
  }
  /// Returns the surface without that lobe; densities stay the same.
  Bsdf without_diffuse() const noexcept {
    Bsdf rest = *this;
    rest.diffuse_.albedo = {};
    return rest;
  }

 private:
  /// In the order in which sample() divides u_lobe: lobes with a density first, delta lobes last.
  enum Lobe {
    kDiffuse,
    kDiffuseTransmission,
    kSheen,
    kRoughCoat,
    kSpecular,
    kThin,
    kSmoothCoat,
    kGlass,
    kLobes
  };
  enum class Delta { kNever, kIfSmooth, kIfSmoothOrMatched, kAlways };
  struct LobeKind {
    Lobe lobe;
    Delta delta;
  };
  /// One row per lobe, in the order of the enumerators.
  static constexpr std::array<LobeKind, kLobes> kLobeKinds = {{
      {kDiffuse, Delta::kNever},
      {kDiffuseTransmission, Delta::kNever},
      {kSheen, Delta::kNever},
      {kRoughCoat, Delta::kNever},
      {kSpecular, Delta::kIfSmooth},
      {kThin, Delta::kIfSmooth},
      {kSmoothCoat, Delta::kAlways},
      {kGlass, Delta::kIfSmoothOrMatched},
  }};
  /// The order in which probabilities are added. Another one rounds differently.
  static constexpr std::array<Lobe, kLobes> kSumOrder = {
      kDiffuse, kSpecular, kThin, kGlass, kDiffuseTransmission, kRoughCoat, kSmoothCoat, kSheen};

  /// Adds diffuse transmission and returns its albedo. lambert: weight of the diffuse lobe.
  Rgb add_below(const BsdfParameters& p, const BsdfLayers& layers, float ior,
                float lambert) noexcept;
  void add_solid(const BsdfParameters& p, float weight, const ThinFilm& film) noexcept;
  void add_top(const BsdfLayers& layers) noexcept;
  void set_probabilities() noexcept;
  BsdfEval evaluate_unfolded(Vec3 wi) const noexcept;
  void add_above(Vec3 wi, BsdfEval& out) const noexcept;
  void add_below(Vec3 wi, BsdfEval& out) const noexcept;
  bool is_delta(Delta delta) const noexcept;
  bool sample_lobe(Lobe lobe, float u_lobe, Vec2 u, BsdfSample& s) const noexcept;
  void respect_geometry(BsdfSample& s) const noexcept;

  Facets facets_{};
  Vec3 ng_;
  bool is_lambert_ = false;  ///< diffuse_ is the only lobe
  bool is_flat_ = true;      ///< shading normal and horizon coincide
  bool has_spread_ = false;
  bool has_layers_ = false;
  std::array<float, kLobes> prob_{};
  DiffuseLobe diffuse_;
  Rgb albedo_;
  DiffuseLobe below_;  ///< diffuse transmission
  Interface interface_;
  std::optional<SpecularLobe> specular_;
  std::optional<ThinLobe> thin_;
  std::optional<GlassLobe> glass_;
  std::optional<TopLayers> top_;
};

}  // namespace core
