/// BsdfOf: the layered glTF surface at one point, seen from one direction, or at a point per lane.
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
/// Each lane is either Lambert or not; if all are Lambert, nothing else is computed. Parts that few
/// surfaces need are not inlined: inlined copies could round differently, and a lane must not
/// depend on the code path that its neighbours need. They change nothing in the lanes without them.
///
/// Describes the transport of radiance; for power that arrives along wo see
/// core/materials/adjoint_bsdf.h.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>

#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/bsdf_types.h"
#include "core/bsdf/diffuse_lobe.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/glass_lobe.h"
#include "core/bsdf/interface.h"
#include "core/bsdf/specular_lobe.h"
#include "core/bsdf/thin_lobe.h"
#include "core/bsdf/top_layers.h"

namespace core {

template <typename F>
class BsdfOf {
 public:
  using V = Vec3Of<F>;
  using Color = ColorOf<F>;
  using M = MaskOf<F>;
  using Eval = BsdfEvalOf<F>;
  using Sample = BsdfSampleOf<F>;

  /// s: has the base_color, metallic, roughness, f0 and f90 of BsdfParameters. wo: local, z > 0.
  /// ng: local geometric normal on wo's side, unit; it defines the horizon. extra: layers, solids,
  /// walls and films, each null if no lane has any. layers: as for TopLayersOf; solids: have the
  /// transmission, specular_color, ior and inside of BsdfParameters; walls: WallOf; films: have
  /// film(), ThinFilmOf. Weights are 0, and the ior is 1, in lanes without such a part.
  template <typename Surface, typename Extra>
  BsdfOf(const Surface& s, GgxOf<F> ggx, V wo, V ng, const Extra& extra) noexcept
      : ng_(ng),
        is_flat_(is_flat(ng.z)),
        is_lambert_((s.f90 == F(0)) & (s.metallic == F(0)) & opposite(is_not_black(s.f0))),
        has_spread_(is_not_black(s.base_color)),
        diffuse_(s.base_color),
        albedo_(s.base_color) {
    if (extra.layers) {
      is_lambert_ = is_lambert_ & opposite(TopLayersOf<F>::exist(*extra.layers));
    }
    if (extra.solids) {
      is_lambert_ = is_lambert_ & opposite(extra.solids->transmission > 0);
    }
    if (extra.walls) {
      is_lambert_ = is_lambert_ & opposite(extra.walls->exist());
    }
    ThinFilmOf<F> film;
    if (extra.films) {
      film = extra.films->film();
      is_lambert_ = is_lambert_ & opposite(film.weight > 0);
    }
    is_lambert_all_ = all(is_lambert_);
    is_flat_all_ = all(is_flat_);
    if (!is_lambert_all_) {
      set_lobes(s, ggx, wo, film, extra);
    }
  }

  Eval evaluate(V wi) const noexcept {
    if (is_flat_all_) {
      return evaluate_unfolded(wi);
    }
    const F side = dot(wi, ng_);
    const V mirrored = wi - ng_ * (2 * side);
    const M keep_a = is_flat_ | (side * wi.z > 0);
    const M keep_b = opposite(is_flat_) & (side * mirrored.z > 0);
    const Eval a = may(keep_a) ? evaluate_unfolded(wi) : Eval();
    const Eval b = may(keep_b) ? evaluate_unfolded(mirrored) : Eval();
    return {select(keep_a, a.value_cos, black()) + select(keep_b, b.value_cos, black()),
            select(keep_a, a.pdf_solid_angle, F(0)) + select(keep_b, b.pdf_solid_angle, F(0))};
  }
  /// Samples a direction. Weight 0 means that the path is absorbed; the rest is unspecified then.
  /// u_lobe, u in [0,1).
  Sample sample(F u_lobe, Vec2Of<F> u) const noexcept {
    Draft draft;
    Sample& s = draft.s;
    M rest{};  // lanes whose lobe comes later
    if (!is_lambert_all_) {
      rest = opposite(is_lambert_) & opposite(u_lobe < prob_[kDiffuse]);
    }
    if (may(opposite(rest))) {
      s.wi_local = spread_.sample(u);
      draft.is_valid = opposite(rest) & (s.wi_local.z > 0);
    }
    if (is_lambert_all_ && is_flat_all_) {
      s.weight = select(draft.is_valid, diffuse_, black());
      s.pdf_solid_angle = s.wi_local.z * kInvPi;
      return s;
    }
    if (any(rest)) {
      const F left = u_lobe - prob_[kDiffuse];
      M specular = rest & (left < prob_[kSpecular]);
      if (has_below_ || top_) {
        draft = sample_rest(rest, left, u, draft, specular);
      }
      if (any(specular)) {
        draft = sample_specular(specular, u, draft);
      }
    }
    s.transmitted = s.wi_local.z < 0;
    if (!is_flat_all_) {
      const F side = dot(s.wi_local, ng_);
      s.is_mirrored = opposite(is_flat_) & (side * s.wi_local.z < 0);
      s.wi_local = select(s.is_mirrored, s.wi_local - ng_ * (2 * side), s.wi_local);
    }
    const Eval f = any(draft.is_valid & opposite(s.is_delta)) ? evaluate(s.wi_local) : Eval();
    const M plain = is_lambert_ & is_flat_;
    const M is_valid = draft.is_valid & (plain | s.is_delta | (f.pdf_solid_angle > 0));
    const Color weight = select(plain, diffuse_, f.value_cos * (1 / f.pdf_solid_angle));
    s.weight = select(is_valid, select(s.is_delta, s.weight, weight), black());
    s.pdf_solid_angle = select(s.is_delta, F(0), f.pdf_solid_angle);
    return may(is_valid) ? s : Sample();
  }

  /// Returns whether any lobe has a density over solid angle, so that light sampling is useful.
  M has_spread() const noexcept { return has_spread_; }
  /// If true, sample() does not use u_lobe.
  bool has_one_lobe() const noexcept { return is_lambert_all_; }
  M transmits() const noexcept {
    return has_below_ ? prob_[kThin] + prob_[kGlass] + prob_[kDiffuseTransmission] > 0 : M{};
  }
  /// Returns where light may pass a wall without deflection.
  M is_clear() const noexcept { return wall_ ? facets_.is_smooth & (prob_[kThin] > 0) : M{}; }
  /// Returns the reflected and transmitted fraction of light from wo, per channel, for the albedo
  /// layer.
  Color albedo() const noexcept { return albedo_; }
  /// Returns the fraction of delta lobes that clearcoat and sheen let through.
  F delta_share() const noexcept { return top_ ? top_->open : F(1); }

 protected:
  using Glass = GlassLobeOf<F>;
  using Wall = ThinLobeOf<F>;
  using Film = ThinFilmOf<F>;
  using Albedo = AlbedoOf<F>;
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
      kDiffuse, kSpecular, kRoughCoat, kSmoothCoat, kSheen, kDiffuseTransmission, kGlass, kThin};

  static Color black() noexcept { return Color(F(0)); }
  /// Tests whether a common part is needed; for lanes it is nearly always, and they do not ask.
  static bool may(M where) noexcept {
    if constexpr (std::is_same_v<F, float>) {
      return where;
    } else {
      return true;
    }
  }
  /// Returns whether some lane may have the lobe.
  bool has(Lobe lobe) const noexcept {
    switch (lobe) {
      case kDiffuse:
      case kSpecular:
        return true;
      case kDiffuseTransmission:
        return has_below_;
      case kThin:
        return wall_.has_value();
      case kGlass:
        return glass_.has_value();
      case kSheen:
      case kRoughCoat:
      case kSmoothCoat:
        return top_.has_value();
      case kLobes:
        break;
    }
    return false;
  }

  V ng_;
  M is_flat_;     ///< shading normal and horizon coincide
  M is_lambert_;  ///< diffuse_ is the only lobe
  M has_spread_;
  bool is_flat_all_;
  bool is_lambert_all_;
  bool has_below_ = false;  ///< some lane may have a lobe below
  Color diffuse_;           ///< weighted colour of diffuse reflection
  Color albedo_;
  DiffuseLobeOf<F> spread_;  ///< of diffuse reflection and transmission
  M transmits_{};            ///< solids and walls; valid, like the next ones, only if not Lambert
  FacetsOf<F> facets_;
  std::array<F, kLobes> prob_;
  M has_specular_;
  InterfaceOf<F> interface_;
  std::optional<SpecularLobeOf<F>> specular_;  ///< where has_specular_
  Color below_;  ///< weighted colour of diffuse transmission; valid if has_below_
  std::optional<Wall> wall_;
  std::optional<Glass> glass_;
  M is_solid_{};
  std::optional<TopLayersOf<F>> top_;
  M has_top_;

 private:
  /// Weights and albedos that the parts of a surface share.
  struct Base {
    F dielectric;
    F lambert;          ///< weight of the diffuse lobe
    Color passed;       ///< albedo of diffuse transmission under the interface
    Albedo e, average;  ///< of the facets with F = 1: for wo, and on average
  };
  template <typename Surface, typename Extra>
  [[gnu::noinline]] void set_lobes(const Surface& s, GgxOf<F> ggx, V wo, const Film& film,
                                   const Extra& extra) noexcept {
    const F metal = s.metallic;
    const F dielectric = 1 - metal;
    F cover = dielectric;  // dielectric that is not solid glass
    Base base = {dielectric, dielectric, black(), {}, {}};
    if (extra.solids) {
      cover = dielectric - dielectric * extra.solids->transmission;
      base.lambert = dielectric * (1 - extra.solids->transmission);
    }
    if (extra.walls) {
      base.lambert = base.lambert * (1 - extra.walls->transmission);
    }
    F roughness = s.roughness;
    const M is_round = ggx.alpha_x == ggx.alpha_y;
    if (!all(is_round)) {
      roughness = select(is_round, roughness, mean_roughness(ggx.alpha_x, ggx.alpha_y));
    }
    facets_ = {wo, ggx, roughness, max(ggx.alpha_x, ggx.alpha_y) < kSmoothAlpha};
    const M has_interface = (cover > 0) & ((max_component(s.f0) > 0) | (s.f90 > 0));
    has_specular_ = (metal > 0) | has_interface;
    if (may(has_specular_) || extra.walls) {
      base.e = albedo_of(facets_, wo);
      base.average = albedo_average(facets_);
    }
    interface_ = may(has_interface)
                     ? InterfaceOf<F>(select(has_interface, s.f0, black()),
                                      select(has_interface, s.f90, F(0)), film, facets_, base.e,
                                      base.average, base.lambert > 0)
                     : InterfaceOf<F>::none();
    diffuse_ = s.base_color * base.lambert;
    has_below_ = extra.solids || extra.walls;
    if (has_below_) {
      below_ = black();
    }
    if (extra.walls) {
      add_below(*extra.walls, extra.solids, base);
    }
    const Color substrate = diffuse_ * interface_.open_wo;
    prob_.fill(F(0));
    prob_[kDiffuse] = luminance(substrate);
    Color seen = substrate;
    if (may(has_specular_)) {
      specular_.emplace(s, metal, cover, film, facets_, base.e, base.average);
      const Color specular = specular_->albedo(facets_, base.e);
      const Color multiple = specular_->multiple_albedo(facets_, base.e);
      prob_[kDiffuse] = prob_[kDiffuse] + luminance(multiple);
      prob_[kSpecular] = luminance(specular);
      seen = substrate + multiple + specular;
    }
    albedo_ = select(is_lambert_, albedo_, seen);
    if (extra.solids) {
      add_solid(s, *extra.solids, dielectric * extra.solids->transmission, film);
    }
    if (extra.walls) {
      add_wall(s, *extra.walls, base);
    }
    if (extra.layers) {
      add_top(*extra.layers);
    }
    set_probabilities();
  }
  /// The weights of BsdfParameters; lanes have one wavelength per colour only.
  template <typename Solids>
  static Color reflection_weight([[maybe_unused]] const Solids& solids) noexcept {
    if constexpr (requires { solids.reflection_weight; }) {
      return solids.reflection_weight;
    }
    return Color(F(1));
  }
  template <typename Solids>
  static Color refraction_weight([[maybe_unused]] const Solids& solids) noexcept {
    if constexpr (requires { solids.refraction_weight; }) {
      return solids.refraction_weight;
    }
    return Color(F(1));
  }
  /// Adds diffuse transmission. solids: null if there are none.
  template <typename Solids>
  void add_below(const WallOf<F>& walls, const Solids* solids, Base& base) noexcept {
    F passed = walls.diffuse;
    if (solids == nullptr) {
      base.passed = walls.diffuse_color * (base.lambert * passed);
      below_ = base.passed;
    } else {
      // It changes radiance by the squared indices as refraction does, and less of the light in the
      // denser medium passes, so that the lobe is reciprocal.
      const F squared = square(solids->ior);
      const F eta_2 = select(solids->inside, 1 / squared, squared);
      passed = passed * min(eta_2, F(1));
      base.passed = walls.diffuse_color * (base.lambert * passed);
      below_ = base.passed * refraction_weight(*solids) * (1 / eta_2);
    }
    diffuse_ = diffuse_ * (1 - passed);
  }
  template <typename Surface, typename Solids>
  [[gnu::noinline]] void add_solid(const Surface& s, const Solids& solids, F weight,
                                   const Film& film) noexcept {
    const Glass& glass = glass_.emplace(
        GlassParametersOf<F>{s.base_color * refraction_weight(solids), reflection_weight(solids),
                             solids.specular_color, s.f90, solids.ior, solids.inside},
        facets_, weight, film);
    is_solid_ = transmits_ = weight > 0;
    // Equal to the true probability: with more, the weights of paths kept inside by total
    // reflection would grow at each bounce.
    prob_[kDiffuse] = prob_[kDiffuse] + select(is_solid_, glass.diffuse_above(), F(0));
    prob_[kDiffuseTransmission] = select(is_solid_, glass.diffuse_below(), F(0));
    prob_[kGlass] =
        select(is_solid_, glass.single() * (weight * max(luminance(s.base_color), F(0.05F))), F(0));
    albedo_ = albedo_ + s.base_color * select(is_solid_, weight, F(0));
  }
  /// Adds a thin wall, and the albedo of diffuse transmission.
  template <typename Surface>
  [[gnu::noinline]] void add_wall(const Surface& s, const WallOf<F>& walls,
                                  const Base& base) noexcept {
    transmits_ = transmits_ | walls.exist();
    if (any(walls.transmission > 0)) {
      Wall& wall = wall_.emplace(Wall{s.base_color, base.dielectric * walls.transmission, black()});
      const auto seen = wall.prepare(facets_, interface_, base.e, base.average);
      interface_.open_wo = select(facets_.is_smooth & (walls.transmission > 0),
                                  1 - interface_.fresnel(facets_.wo.z), interface_.open_wo);
      prob_[kSpecular] = prob_[kSpecular] + luminance(seen.single.reflected);
      prob_[kThin] = wall.prob(seen);
      prob_[kDiffuseTransmission] = prob_[kDiffuseTransmission] + luminance(seen.multiple);
      albedo_ = albedo_ + seen.single.reflected + seen.single.transmitted + seen.multiple;
    }
    const Color under = base.passed * interface_.open_wo;
    prob_[kDiffuseTransmission] = prob_[kDiffuseTransmission] + luminance(under);
    albedo_ = albedo_ + under;
  }
  /// Adds clearcoat and sheen, and reduces the probabilities of the layers below.
  template <typename Layers>
  [[gnu::noinline]] void add_top(const Layers& layers) noexcept {
    const TopLayersOf<F>& top = top_.emplace(layers, facets_.wo);
    if (top.has_coat) {
      interface_.norm = interface_.norm * top.coat.diffuse_scale(interface_, facets_.roughness);
    }
    for (F& prob : prob_) {
      prob = prob * top.open;
    }
    albedo_ = albedo_ * top.open + Color(top.coat_albedo) + top.sheen.albedo();
    prob_[kRoughCoat] = top.rough(top.coat_albedo);
    prob_[kSmoothCoat] = top.coat_albedo - prob_[kRoughCoat];
    prob_[kSheen] = luminance(top.sheen.albedo());
    has_top_ = top.exist(layers);
  }
  void set_probabilities() noexcept {
    static_assert([] {
      for (std::size_t i = 0; i < kLobes; ++i) {
        if (kLobeKinds[i].lobe != i || std::ranges::count(kSumOrder, kLobeKinds[i].lobe) != 1) {
          return false;
        }
      }
      return true;
    }());
    F sum(0);
    for (const Lobe lobe : kSumOrder) {
      sum = has(lobe) ? sum + prob_[lobe] : sum;
    }
    const F scale = select(sum > 0, sum, F(1));
    M spreads = opposite(facets_.is_smooth) & (sum > 0);
    for (const LobeKind& kind : kLobeKinds) {
      if (has(kind.lobe)) {
        F& prob = prob_[kind.lobe];
        prob = prob / scale;
        spreads = kind.delta == Delta::kNever ? spreads | (prob > 0) : spreads;
      }
    }
    has_spread_ = (is_lambert_ & has_spread_) | (opposite(is_lambert_) & spreads);
    if (glass_) {
      spread_.is_even = is_solid_ & opposite(has_specular_) & (prob_[kGlass] > 0) &
                        opposite(is_not_black(diffuse_)) & opposite(is_not_black(below_));
    }
  }

  /// Never inlined: see above.
  [[gnu::noinline]] Eval evaluate_unfolded(V wi) const noexcept {
    M seen = wi.z > 0;
    const F cos_pi = wi.z * kInvPi;
    Eval out = {diffuse_ * cos_pi, cos_pi};
    if (!is_lambert_all_) {
      if (has_below_) {
        seen = seen | (transmits_ & (wi.z < 0));
      }
      if (!may(seen)) {
        return {};
      }
      const Eval layered = evaluate_lobes(wi);
      out.value_cos = select(is_lambert_, out.value_cos, layered.value_cos);
      out.pdf_solid_angle = select(is_lambert_, cos_pi, layered.pdf_solid_angle);
    }
    return {select(seen, out.value_cos, black()), select(seen, out.pdf_solid_angle, F(0))};
  }
  Eval evaluate_lobes(V wi) const noexcept {
    const M above = wi.z > 0;
    F under(kInvPi);
    Albedo e;
    Parts parts;
    if (may(has_specular_) || wall_) {
      e = albedo_of(facets_, wi);
      under = interface_.coupling(abs(wi.z), e) * kInvPi;
    }
    Color f = diffuse_ * under;
    if (may(has_specular_)) {
      f = f + specular_->multiple(e);
    }
    parts.diffuse = select(prob_[kDiffuse] > 0, f * wi.z, black());
    Eval single;
    if (may(above & has_specular_ & opposite(facets_.is_smooth))) {
      single = specular_->single(facets_, prob_[kSpecular], wi);
    }
    parts.glossy = single.value_cos;
    parts.out = {parts.diffuse + parts.glossy,
                 prob_[kDiffuse] * spread_.pdf_solid_angle(wi.z) + single.pdf_solid_angle};
    if (has_below_ && any(opposite(above))) {
      turn_below(wi, under, e, parts);
    }
    if (wall_) {
      add_wall(wi, parts);
    }
    if (glass_) {
      add_glass(wi, parts);
    }
    if (top_) {
      Eval covered = parts.out;
      top_->add(wi, parts.diffuse, parts.glossy, {prob_[kSheen], prob_[kRoughCoat]}, covered);
      parts.out.value_cos = select(has_top_, covered.value_cos, parts.out.value_cos);
      parts.out.pdf_solid_angle = covered.pdf_solid_angle;
    }
    return parts.out;
  }
  /// Values of lobes, times the cosine, and of all together without top layers.
  struct Parts {
    Color diffuse;
    Color glossy;
    Eval out;
  };
  static void replace(M where, Color diffuse, const Eval& glossy, Parts& parts) noexcept {
    parts.diffuse = select(where, diffuse, parts.diffuse);
    parts.glossy = select(where, glossy.value_cos, parts.glossy);
    parts.out = {select(where, diffuse + glossy.value_cos, parts.out.value_cos),
                 select(where, glossy.pdf_solid_angle, parts.out.pdf_solid_angle)};
  }
  /// Replaces reflection by diffuse transmission where wi is below. under, e: of wi.
  [[gnu::noinline]] void turn_below(V wi, F under, Albedo e, Parts& parts) const noexcept {
    const M above = wi.z > 0;
    const F mu = abs(wi.z);
    const F prob = prob_[kDiffuseTransmission];
    Color f = below_ * under;
    if (wall_) {
      f = f + wall_->multiple * (1 - e.e);
    }
    const Color below = select(prob > 0, f * mu, black());
    parts.diffuse = select(above, parts.diffuse, below);
    parts.glossy = select(above, parts.glossy, black());
    parts.out = {select(above, parts.out.value_cos, below),
                 select(above, parts.out.pdf_solid_angle, prob * spread_.pdf_solid_angle(mu))};
  }
  [[gnu::noinline]] void add_wall(V wi, Parts& parts) const noexcept {
    Eval lobe = {parts.glossy, parts.out.pdf_solid_angle};
    wall_->add(facets_, interface_, prob_[kThin], wi, lobe);
    replace(wall_->weight > 0, parts.diffuse, lobe, parts);
  }
  /// Adds solid glass and its multiple scattering.
  [[gnu::noinline]] void add_glass(V wi, Parts& parts) const noexcept {
    const M above = wi.z > 0;
    const F prob = select(above, prob_[kDiffuse], prob_[kDiffuseTransmission]);
    Color diffuse = parts.diffuse;
    if (glass_->has_multiple()) {
      diffuse =
          diffuse + select(prob > 0, glass_->multiple(facets_, wi, above) * abs(wi.z), black());
    }
    Eval lobe = {parts.glossy, parts.out.pdf_solid_angle};
    glass_->add(facets_, prob_[kGlass], wi, lobe);
    replace(is_solid_, diffuse, lobe, parts);
  }

  struct Draft {
    Sample s;
    M is_valid{};
  };
  /// Samples a lobe beyond kDiffuse in the lanes of `rest`, unless it is kSpecular: sets its lanes.
  /// left: of u_lobe.
  [[gnu::noinline]] Draft sample_rest(M rest, F left, Vec2Of<F> u, Draft to,
                                      M& specular) const noexcept {
    for (int i = kDiffuse + 1; i < kLobes; ++i) {
      const auto lobe = static_cast<Lobe>(i);
      const F prob = prob_[lobe];
      const M on = rest & (lobe == kGlass ? prob > 0 : left < prob);
      if (lobe == kSpecular) {
        specular = on;
      } else if (has(lobe) && any(on)) {
        to = sample_other(lobe, on, left, u, to);
      }
      rest = rest & opposite(on);
      left = left - prob;
    }
    return to;
  }
  Draft sample_specular(M on, Vec2Of<F> u, Draft to) const noexcept {
    const M is_delta = on & facets_.is_smooth;
    const V wi = facets_.sample_reflected(u);
    to.s.wi_local = select(on, wi, to.s.wi_local);
    to.s.is_delta = to.s.is_delta | is_delta;
    to.is_valid = to.is_valid | (on & (wi.z > 0));
    if (any(is_delta)) {
      Color mirrored = specular_->fresnel(facets_.wo.z);
      if (wall_) {
        mirrored = with_far_face(mirrored);
      }
      to.s.weight = select(is_delta, mirrored * (delta_share() / prob_[kSpecular]), to.s.weight);
    }
    return to;
  }
  /// Returns the reflectance of a smooth wall from that of its near face.
  [[gnu::noinline]] Color with_far_face(Color near) const noexcept {
    return near + wall_->faces(interface_, facets_.wo.z).reflected;
  }
  /// Samples any other lobe in the lanes of `on`. left: of u_lobe, before the lobe.
  [[gnu::noinline]] Draft sample_other(Lobe lobe, M on, F left, Vec2Of<F> u,
                                       Draft to) const noexcept {
    const F prob = prob_[lobe];
    M is_below{};
    M is_delta{};
    Color weight = black();
    V wi;
    switch (lobe) {
      case kDiffuseTransmission:
        wi = -spread_.sample(u);
        is_below = on;
        if (glass_) {
          to.s.eta = select(on, glass_->eta(), to.s.eta);
        }
        break;
      case kSheen:
        wi = SheenLobeOf<F>::sample(u);
        break;
      case kRoughCoat:
        wi = top_->coat.sample(u);
        break;
      case kSmoothCoat:
        wi = top_->coat.sample(u);
        is_delta = on;
        weight = Color(top_->mirrored() / prob);
        break;
      case kThin:
        wi = Wall::sample(facets_, u);
        is_below = on;
        is_delta = on & facets_.is_smooth;
        to.s.is_null = to.s.is_null | is_delta;
        if (any(is_delta)) {
          weight = wall_->faces(interface_, facets_.wo.z).transmitted * (delta_share() / prob);
        }
        break;
      case kGlass: {
        const F u_lobe = max(min(left / prob, F(kOneMinusEpsilon)), F(0));
        const auto g = glass_->sample(facets_, prob, delta_share(), u_lobe, u);
        const M is_refracted = on & g.is_refracted;
        wi = g.wi;
        weight = g.weight;
        is_below = is_refracted;
        is_delta = on & g.is_delta;
        to.s.is_glass = on;
        to.s.is_null = to.s.is_null | (is_refracted & glass_->is_index_matched());
        to.s.eta = select(is_refracted, glass_->eta(), to.s.eta);
        break;
      }
      default:
        return to;
    }
    to.s.wi_local = select(on, wi, to.s.wi_local);
    to.s.weight = select(is_delta, weight, to.s.weight);
    to.s.is_delta = to.s.is_delta | is_delta;
    to.is_valid = to.is_valid | (on & (select(is_below, -wi.z, wi.z) > 0));
    return to;
  }
};

}  // namespace core
