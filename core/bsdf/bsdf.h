/// Bsdf: the layered glTF surface at one point, seen from one direction.
///
/// Frame: local shading frame, n = (0,0,1) on the viewer's side, so wo.z > 0. wo points to the viewer, wi
/// to the light; both unit, away from the surface; wi.z < 0 is transmission.
/// Layers: a GGX lobe (Schlick Fresnel, multiple scattering by Kulla and Conty 2017) over Lambert and thin
/// transmission. Diffuse lobes are coupled by (1 - E(wo)) (1 - E(wi)) / (1 - E_avg), E of the greatest channel;
/// rough thin transmission passes 1 - F at each facet, and diffusely what meets more of them; metal by weight;
/// solid glass as a lobe of its own (Walter et al. 2007 with exact Fresnel, bent to F0 and F90 of
/// KHR_materials_specular and to the film of KHR_materials_iridescence); what it loses to further facets leaves
/// diffusely on both sides (Kulla and Conty 2017), exact for the unbent curve. Above it clearcoat (over diffuse lobes by the same product, over specular ones by the
/// smaller of 1 - E(wo) and 1 - E(wi)) and sheen (KHR_materials_sheen's minimum). All are reciprocal.
/// Directions that the shading frame puts on one side of the surface and the horizon (Shading::horizon) on
/// the other are mirrored at the horizon's plane, in evaluation, density and sampling alike, so a lossless
/// surface stays lossless and nothing leaks through.
#pragma once

#include "core/bsdf/ggx.h"
#include "core/color/rgb.h"
#include "core/math/vec.h"

namespace core {

struct SpecularAlbedo;

/// glTF's parameters after textures. Colours in [0,1].
struct BsdfParameters {
  Rgb base_color = {1, 1, 1};
  float metallic = 0;
  float roughness = 1;  ///< perceptual
  float alpha_x = 1;    ///< GGX widths; equal unless anisotropic
  float alpha_y = 1;
  Rgb f0 = {0.04F, 0.04F, 0.04F};  ///< of the dielectric, KHR_materials_ior and _specular applied
  float f90 = 1;                   ///< of the dielectric
  Rgb specular_color = {1, 1, 1};  ///< of KHR_materials_specular, not clamped: F0 of solid glass, whose ior is relative
  float transmission = 0;
  bool thin = true;  ///< transmission passes straight through
  float ior = 1.5F;  ///< of the solid over that of what surrounds it; may be below 1
  bool inside = false;  ///< wo is in the solid
  Rgb reflection_weight = {1, 1, 1};  ///< of what solid glass reflects, for paths of one wavelength; may be negative
  Rgb refraction_weight = {1, 1, 1};  ///< of what it refracts
};

/// The rarer layers; a surface without any of them carries none of this.
struct BsdfLayers {
  float clearcoat = 0;
  float clearcoat_roughness = 0;
  Vec3 clearcoat_normal = {0, 0, 1};  ///< local; its own normal map
  Rgb sheen_color;
  float sheen_roughness = 0;
  float iridescence = 0;
  float iridescence_ior = 1.3F;
  float iridescence_thickness_nm = 0;
  float diffuse_transmission = 0;
  Rgb diffuse_transmission_color = {1, 1, 1};
};

struct BsdfEval {
  Rgb value_cos;               ///< f * |cos theta_i| [1/sr]
  float pdf_solid_angle = 0;   ///< density of sample() at wi; delta lobes left out
};

struct BsdfSample {
  Vec3 wi_local;
  Rgb weight;                 ///< f * |cos| / density
  float pdf_solid_angle = 0;  ///< 0 when is_delta
  bool is_delta = false;
  bool transmitted = false;  ///< wi is on the other side of the geometric plane
  bool is_straight = false;  ///< wi = -wo, as if through a hole: see straight()
  float eta = 1;             ///< n(wi) / n(wo); 1 unless refracted
};

class Bsdf {
 public:
  /// wo_local.z > 0; ng_local: geometric normal on wo's side, unit.
  /// layers: null, or borrowed for the Bsdf's life.
  Bsdf(const BsdfParameters& parameters, Vec3 wo_local, Vec3 ng_local,
       const BsdfLayers* layers = nullptr) noexcept;

  BsdfEval evaluate(Vec3 wi_local) const noexcept;
  /// weight 0 and pdf 0: nothing was sampled (absorbed). u_lobe, u_dir in [0,1).
  BsdfSample sample(float u_lobe, Vec2 u_dir) const noexcept;
  /// One of the delta lobes, chosen among them alone; weight as if they were the whole.
  BsdfSample sample_delta(float u_lobe, Vec2 u_dir) const noexcept;
  /// Probability with which sample() takes a delta lobe.
  float prob_delta() const noexcept;
  /// Does any lobe spread over solid angle, so that light sampling makes sense?
  bool has_spread() const noexcept { return has_spread_; }
  /// Light comes back from everywhere alike, more or less: one Lambert lobe, or rough reflection without further layers.
  bool is_wide() const noexcept {
    return is_lambert_ || (!transmits() && layers_ == nullptr && roughness_ >= 0.5F);
  }
  bool transmits() const noexcept { return prob_thin_ + prob_glass_ + prob_below_ > 0; }
  /// Share of light that goes straight through (smooth thin transmission, solids of the index around
  /// them), for shadow rays.
  Rgb straight() const noexcept;
  /// Share of light reflected or transmitted from wo, per channel, for the albedo layer.
  Rgb albedo() const noexcept;

 private:
  BsdfEval evaluate_raw(Vec3 wi) const noexcept;
  void add_diffuse(Vec3 wi, BsdfEval& out) const noexcept;
  void add_specular(Vec3 wi, BsdfEval& out) const noexcept;
  void add_thin(Vec3 wi, BsdfEval& out) const noexcept;
  void add_glass(Vec3 wi, BsdfEval& out) const noexcept;
  bool sample_specular(Vec2 u, BsdfSample& s) const noexcept;
  bool sample_thin(Vec2 u, BsdfSample& s) const noexcept;
  bool sample_glass(float u_lobe, Vec2 u, BsdfSample& s) const noexcept;
  void add_below(Vec3 wi, BsdfEval& out) const noexcept;
  void add_clearcoat(Vec3 wi, BsdfEval& out) const noexcept;
  void add_sheen(Vec3 wi, BsdfEval& out) const noexcept;
  bool sample_clearcoat(Vec2 u, BsdfSample& s) const noexcept;
  void prepare_cover(const BsdfParameters& p, SpecularAlbedo wo, SpecularAlbedo average) noexcept;
  void prepare_layers() noexcept;
  float cover_albedo(float mu, SpecularAlbedo e) const noexcept;
  float cover_share(float mu) const noexcept;
  float coat_albedo(Vec3 wi) const noexcept;
  float delta_share() const noexcept;
  float cover_fresnel(float cos_oh) const noexcept;
  void prepare_glass(const BsdfParameters& p) noexcept;
  Rgb glass_fresnel(float cos_oh) const noexcept;
  /// The diffuse lobes hold nothing but what facets of glass scatter more than once, most of it at grazing angles:
  /// they are sampled uniformly.
  bool is_evenly_spread() const noexcept {
    return prob_glass_ > 0 && !has_specular_ && is_black(diffuse_) && is_black(below_);
  }
  bool is_index_matched() const noexcept { return eta_ > 0.9999F && eta_ < 1.0001F; }
  Rgb fresnel(float cos_oh) const noexcept;
  void respect_geometry(BsdfSample& s) const noexcept;

  Vec3 wo_;
  Vec3 ng_;
  Ggx ggx_;
  float roughness_ = 1;
  bool is_lambert_ = false;  ///< nothing but diffuse_
  bool is_flat_ = true;      ///< shading and geometric normal agree
  bool has_specular_ = false;
  bool is_smooth_ = false;  ///< the GGX lobes are delta
  bool has_spread_ = false;
  Rgb diffuse_;             ///< Lambert albedo times weight
  Rgb f0_;                  ///< of the whole specular lobe, weighted
  Rgb f90_;
  float e_wo_ = 1;          ///< single-scattering albedo with F = 1
  float ms_scale_ = 0;      ///< (1 - E(wo)) / (pi (1 - E_avg))
  Rgb ms_color_;
  float cover_f0_ = 0;      ///< dielectric cover over the substrate, unweighted; its greatest channel
  float cover_f90_ = 0;
  float cover_ms_ = 0;
  Rgb cover_film_f0_;       ///< of the cover under a thin film
  float cover_wo_ = 1;      ///< 1 - E_cover(wo)
  float cover_norm_ = 1;    ///< 1 / (1 - E_cover_avg)
  Rgb thin_;                ///< weight of thin transmission below its cover
  Rgb below_ms_;             ///< multiple scattering of rough thin transmission, [1/sr]
  Rgb glass_color_;          ///< of refraction
  Rgb glass_reflection_;     ///< weight of reflection
  float glass_weight_ = 0;
  Rgb glass_ms_;             ///< what meets more than one facet and is reflected, [1/sr]
  Rgb glass_ms_below_;       ///< and transmitted
  bool glass_bent_ = false;  ///< its Fresnel is not the plain one: the next four count
  Rgb glass_f0_;
  float glass_f90_ = 1;
  float glass_film_ = 0;
  bool inside_ = false;
  float eta_ = 1;           ///< n(other side) / n(wo's side)
  float prob_diffuse_ = 0;
  float prob_specular_ = 0;
  float prob_thin_ = 0;
  float prob_glass_ = 0;
  float prob_below_ = 0;     ///< diffuse transmission
  float prob_coat_ = 0;
  float prob_sheen_ = 0;
  const BsdfLayers* layers_ = nullptr;
  Rgb below_;                ///< diffuse transmission, weighted
  float film_weight_ = 0;    ///< share of the specular lobe under the film
  Rgb film_base_f0_;
  Ggx coat_;
  bool coat_smooth_ = false;
  float coat_mu_ = 1;        ///< cosine between wo and the coat's normal
  float coat_e_wo_ = 0;      ///< albedo of the coat from wo, weighted
  float coat_e_average_ = 0;
  float sheen_max_ = 0;
  float sheen_e_wo_ = 0;
  Rgb albedo_;
};

}  // namespace core
