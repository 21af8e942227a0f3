/// Bsdf in lanes: Lambert, and glTF's metallic-roughness surface with anisotropy, solid glass, thin
/// walls, diffuse transmission, clearcoat and sheen; films on opaque surfaces.
///
/// Its lobes are those of core/bsdf/bsdf.h, with the same order and use of random numbers. Each
/// lane is either Lambert or not; if all are Lambert, nothing else is computed. Films are evaluated
/// lane by lane, by the lobes of single paths.
#pragma once

#include <array>
#include <bit>
#include <optional>

#include "core/bsdf/anisotropic_albedo.h"
#include "core/bsdf/facets.h"
#include "core/bsdf/glass_lobe.h"
#include "core/bsdf/interface.h"
#include "core/bsdf/specular_lobe.h"
#include "core/bsdf/thin_lobe.h"
#include "core/bsdf/top_layers.h"
#include "core/sampling/warp.h"

namespace core {

/// The result of shading: Shading and BsdfParameters of N points.
template <std::size_t N>
struct SurfaceLanes {
  Vec3s<N> normal_geometric;  ///< on the viewer's side, like the next two
  Vec3s<N> normal;
  Vec3s<N> horizon;
  Vec3s<N> origin;
  Floats<N> error_m;  ///< SurfacePoint::error_m
  Vec3s<N> base_color;
  Floats<N> metallic, roughness;
  Floats<N> alpha;  ///< alpha_y
  Vec3s<N> f0;
  Floats<N> f90;
};

/// The members of BsdfLayers that lanes have; 0 where a surface has no such layer.
template <std::size_t N>
struct LayerLanes {
  Floats<N> clearcoat;
  Floats<N> clearcoat_roughness;
  Vec3s<N> clearcoat_normal;
  Vec3s<N> sheen_color;
  Floats<N> sheen_roughness;

  Mask<N> exist() const { return (clearcoat > 0) | (max_component(sheen_color) > 0); }
};

/// The members of BsdfParameters of the boundaries of solids.
template <std::size_t N>
struct SolidLanes {
  Floats<N> transmission;  ///< 0 where there is no solid
  Vec3s<N> specular_color;
  Floats<N> ior;
  Mask<N> inside;
};

/// The members of BsdfParameters and BsdfLayers of surfaces that transmit without a solid; 0
/// elsewhere.
template <std::size_t N>
struct WallLanes {
  Floats<N> transmission;
  Floats<N> diffuse;  ///< diffuse_transmission
  Vec3s<N> diffuse_color;

  Mask<N> exist() const { return (transmission > 0) | (diffuse > 0); }
};

/// Brushed surfaces.
template <std::size_t N>
struct BrushLanes {
  Floats<N> alpha_x;  ///< elsewhere that of SurfaceLanes
  Vec3s<N> along;     ///< Frame::s of the shading frame, world; unspecified elsewhere
};

/// Films; only those of `on` are valid.
template <std::size_t N>
struct FilmLanes {
  unsigned on;
  Floats<N> weight, ior, thickness_nm;
  Vec3s<N> wavelengths_nm;

  ThinFilm lane(std::size_t k) const {
    const Vec3 nm = wavelengths_nm.lane(k);
    return {weight.v[k], ior.v[k], thickness_nm.v[k], {nm.x, nm.y, nm.z}};
  }
};

/// What some lanes have beyond SurfaceLanes; null if no lane has any.
template <std::size_t N>
struct ExtraLanes {
  const LayerLanes<N>* layers = nullptr;
  const SolidLanes<N>* solids = nullptr;
  const WallLanes<N>* walls = nullptr;
  const BrushLanes<N>* brush = nullptr;
  const FilmLanes<N>* films = nullptr;
};

template <std::size_t N>
class BsdfLanes {
 public:
  using F = Floats<N>;
  using Extra = ExtraLanes<N>;
  /// wo: local, z > 0. ng: local geometric normal, which defines the horizon.
  BsdfLanes(const SurfaceLanes<N>& s, Vec3s<N> wo, Vec3s<N> ng, const Extra& extra = {})
      : ng_(ng),
        is_flat_(is_flat(ng.z)),
        is_lambert_((s.f90 == F(0)) & (s.metallic == F(0)) & ~is_not_black(s.f0)),
        base_color_(s.base_color) {
    if (extra.layers != nullptr) {
      is_lambert_ = is_lambert_ & ~extra.layers->exist();
    }
    if (extra.solids != nullptr) {
      is_lambert_ = is_lambert_ & ~(extra.solids->transmission > 0);
    }
    if (extra.walls != nullptr) {
      is_lambert_ = is_lambert_ & ~extra.walls->exist();
    }
    if (extra.films != nullptr) {
      is_lambert_ = is_lambert_ & ~Mask<N>::of(extra.films->on);
    }
    is_lambert_all_ = is_lambert_.all();
    is_flat_all_ = is_flat_.all();
    albedo_ = base_color_;
    has_spread_ = is_not_black(base_color_);
    if (!is_lambert_all_) {
      set_lobes(s, wo, extra);
    }
  }

  struct Eval {
    Vec3s<N> value_cos;
    F pdf_solid_angle;
  };
  struct Sample {
    Vec3s<N> wi;
    Vec3s<N> weight;  ///< black: no direction was sampled
    F pdf_solid_angle;
    Mask<N> is_delta;
    Mask<N> is_null;  ///< as in BsdfSample; of valid lanes
  };

  Eval evaluate(Vec3s<N> wi) const {
    if (is_flat_all_) {
      return evaluate_unfolded(wi);
    }
    const F side = dot(wi, ng_);
    const Vec3s<N> mirrored = wi - ng_ * (2 * side);
    const Eval a = evaluate_unfolded(wi);
    const Eval b = evaluate_unfolded(mirrored);
    const Mask<N> keep_a = is_flat_ | (side * wi.z > 0);
    const Mask<N> keep_b = ~is_flat_ & (side * mirrored.z > 0);
    return {select(keep_a, a.value_cos, black()) + select(keep_b, b.value_cos, black()),
            select(keep_a, a.pdf_solid_angle, F(0)) + select(keep_b, b.pdf_solid_angle, F(0))};
  }

  /// As evaluate(); lanes outside of `on` are unspecified.
  Eval evaluate_where(Mask<N> on, Vec3s<N> wi) const {
    return on.any() ? evaluate(wi) : Eval{black(), F(0)};
  }

  Sample sample(F u_lobe, Vec2s<N> u) const {
    Sample s;
    s.wi = cosine_hemisphere(u);
    s.is_delta = Mask<N>::of(0);
    s.is_null = s.is_delta;
    Mask<N> valid = s.wi.z > 0;
    Mask<N> specular = s.is_delta;
    std::optional<GlassSample> glass;
    if (!is_lambert_all_) {
      specular = ~is_lambert_ & ~(u_lobe < prob_diffuse_);
      if (glass_) {
        s.wi = select(is_even_, uniform_hemisphere(u), s.wi);
      }
      if (specular.any()) {
        F left = u_lobe - prob_diffuse_;
        Mask<N> below = s.is_delta;
        if (has_below_) {
          below = specular & (left < prob_below_);
          left = left - prob_below_;
          specular = specular & ~below;
        }
        if (top_) {
          const TopSample top = sample_top(specular, u, left, s.wi);
          s.wi = top.wi;
          s.is_delta = top.is_delta;
          specular = top.specular;
          left = top.left;
        }
        s.is_delta = s.is_delta | (specular & facets_.is_smooth);
        const Vec3s<N> diffuse = s.wi;
        s.wi = select(specular, facets_.sample_reflected(u), s.wi);
        valid = (s.wi.z > 0) & (~specular | (left < prob_specular_));
        if (wall_) {
          const Mask<N> thin =
              specular & ~(left < prob_specular_) & (left - prob_specular_ < prob_thin_);
          s.is_null = thin & facets_.is_smooth;
          s.wi.z = select(thin, -s.wi.z, s.wi.z);
          valid = valid | (thin & (s.wi.z < 0));
        }
        if (has_below_) {
          s.wi = select(below, -diffuse, s.wi);
          valid = (below & (s.wi.z < 0)) | (~below & valid);
        }
        if (glass_) {
          glass.emplace(sample_glass(specular & ~(left < prob_specular_), left, u));
          s.wi = select(glass->on, glass->of_lobe.wi, s.wi);
          valid = (glass->on & glass->of_lobe.is_valid) | (~glass->on & valid);
        }
      }
    }
    if (!is_flat_all_) {
      const F side = dot(s.wi, ng_);
      s.wi = select(~is_flat_ & (side * s.wi.z < 0), s.wi - ng_ * (2 * side), s.wi);
    }
    const Eval f = evaluate_where(valid & ~s.is_delta, s.wi);
    const Mask<N> plain = is_lambert_ & is_flat_;
    valid = valid & (plain | s.is_delta | (f.pdf_solid_angle > 0));
    s.weight = select(plain, base_color_, f.value_cos * (1 / f.pdf_solid_angle));
    s.pdf_solid_angle = f.pdf_solid_angle;
    if (s.is_delta.any()) {
      s.weight = select(s.is_delta, delta_weight(specular), s.weight);
      s.pdf_solid_angle = select(s.is_delta, F(0), s.pdf_solid_angle);
      if (glass) {
        s.weight = select(s.is_delta & glass->on, glass->of_lobe.weight, s.weight);
      }
      if (wall_) {
        s.weight = select(s.is_delta & specular & is_wall_, wall_delta_weight(s.is_null), s.weight);
      }
    }
    s.weight = select(valid, s.weight, black());
    return s;
  }

  Mask<N> has_spread() const { return has_spread_; }
  /// If true, sample() does not use u_lobe.
  bool has_one_lobe() const { return is_lambert_all_; }
  Vec3s<N> albedo() const { return albedo_; }
  Mask<N> transmits() const {
    Mask<N> out = has_below_ ? prob_below_ > 0 : Mask<N>::of(0);
    if (glass_) {
      out = out | (prob_glass_ > 0);
    }
    if (wall_) {
      out = out | (prob_thin_ > 0);
    }
    return out;
  }
  /// Returns where light may pass without deflection.
  Mask<N> is_clear() const { return wall_ ? facets_.is_smooth & (prob_thin_ > 0) : Mask<N>::of(0); }

 private:
  using Glass = GlassLobeOf<F, NoFilm>;
  using Wall = ThinLobeOf<F>;
  static Vec3s<N> black() { return Vec3s<N>(F(0)); }

  /// Returns the weight of the specular lobe where it is smooth, and of a smooth coat elsewhere.
  Vec3s<N> delta_weight(Mask<N> specular) const {
    const Vec3s<N> fresnel = specular_fresnel(facets_.wo.z);
    if (!top_) {
      return fresnel * (1 / prob_specular_);
    }
    return select(specular, fresnel * (top_->open / prob_specular_),
                  Vec3s<N>(top_->mirrored() / prob_coat_));
  }

  /// As delta_weight(), of smooth walls. straight: lanes that pass.
  [[gnu::noinline]] Vec3s<N> wall_delta_weight(Mask<N> straight) const {
    const auto faces = wall_->faces(interface_, facets_.wo.z);
    const F open = top_ ? top_->open : F(1);
    return select(straight, faces.transmitted * (open / prob_thin_),
                  (specular_.fresnel(facets_.wo.z) + faces.reflected) * (open / prob_specular_));
  }

  struct TopSample {
    Vec3s<N> wi;
    Mask<N> is_delta;
    Mask<N> specular;  ///< lanes for the specular lobe
    F left;            ///< of u_lobe
  };
  /// Samples the layers in the lanes of `beyond` the diffuse lobe, with what is left of u_lobe. wi:
  /// of the other lanes.
  [[gnu::noinline]] TopSample sample_top(Mask<N> beyond, Vec2s<N> u, F left, Vec3s<N> wi) const {
    const Mask<N> sheen = beyond & (left < prob_sheen_);
    left = left - prob_sheen_;
    const F rough = top_->rough(prob_coat_);
    const Mask<N> rough_coat = beyond & ~sheen & (left < rough);
    left = left - rough;
    const Mask<N> rest = beyond & ~sheen & ~rough_coat;
    F after = left - prob_specular_;
    Mask<N> before = left < prob_specular_;
    if (wall_) {
      before = before | (after < prob_thin_);
      after = after - prob_thin_;
    }
    const Mask<N> smooth_coat = rest & ~before & (after < prob_coat_ - rough);
    wi = select(sheen, SheenLobeOf<F>::sample(u), wi);
    wi = select(rough_coat | smooth_coat, top_->coat.sample(u), wi);
    return {wi, smooth_coat, rest & ~smooth_coat, left};
  }

  struct GlassSample {
    Mask<N> on;
    typename Glass::Sample of_lobe;
  };
  /// Samples the boundary of the solid in the lanes of `on` that have one. left: of u_lobe, before
  /// the specular lobe.
  [[gnu::noinline]] GlassSample sample_glass(Mask<N> on, F left, Vec2s<N> u) const {
    F before = prob_specular_;
    F open(1);
    if (top_) {
      before = before + prob_coat_ - top_->rough(prob_coat_);
      open = top_->open;
    }
    const F u_lobe = max(min((left - before) / prob_glass_, F(kOneMinusEpsilon)), F(0));
    return {on & (prob_glass_ > 0), glass_->sample(facets_, prob_glass_, open, u_lobe, u)};
  }

  /// As Bsdf's constructor.
  void set_lobes(const SurfaceLanes<N>& s, Vec3s<N> wo, const Extra& extra) {
    const auto [layers, solids, walls, brush, films] = extra;
    const F metal = s.metallic;
    const F dielectric = 1 - metal;
    F cover = dielectric;
    F lambert = dielectric;
    if (solids != nullptr) {
      cover = dielectric - dielectric * solids->transmission;
      lambert = dielectric * (1 - solids->transmission);
    }
    if (walls != nullptr) {
      lambert = lambert * (1 - walls->transmission);
    }
    F alpha_x = s.alpha;
    F roughness = s.roughness;
    if (brush != nullptr) {
      alpha_x = brush->alpha_x;
      roughness = select(alpha_x == s.alpha, roughness, mean_roughness(alpha_x, s.alpha));
    }
    facets_ = {wo, {alpha_x, s.alpha}, roughness, max(alpha_x, s.alpha) < kSmoothAlpha};
    const AlbedoOf<F> e = albedo_of(facets_, wo);
    const AlbedoOf<F> average = albedo_average(facets_);
    const Mask<N> has_interface = (cover > 0) & ((max_component(s.f0) > 0) | (s.f90 > 0));
    interface_ = {select(has_interface, s.f0, black()), select(has_interface, s.f90, F(0)),
                  average};
    interface_.set_coupling(interface_.albedo(e), interface_.albedo(average));
    specular_ = {s, metal, cover, facets_, e, average};
    diffuse_ = s.base_color * lambert;
    if (walls != nullptr) {
      diffuse_ = diffuse_ * (1 - walls->diffuse);
    }

    Vec3s<N> specular = specular_.albedo(facets_, e);
    if (films != nullptr) {
      add_films(*films, s, {metal, cover, has_interface}, e, average, specular);
    }
    const Vec3s<N> multiple = specular_.multiple_albedo(facets_, e);
    const Vec3s<N> substrate = diffuse_ * interface_.open_wo;
    prob_diffuse_ = luminance(substrate) + luminance(multiple);
    prob_specular_ = luminance(specular);
    albedo_ = select(is_lambert_, albedo_, substrate + multiple + specular);
    has_below_ = solids != nullptr || walls != nullptr;
    if (has_below_) {
      prob_below_ = F(0);
    }
    if (solids != nullptr) {
      add_solid(s, *solids, dielectric, (metal > 0) | has_interface);
    }
    if (walls != nullptr) {
      add_wall(s, *walls, {dielectric, lambert}, e, average);
    }
    if (layers != nullptr) {
      add_top(*layers);
    }
    set_probabilities();
  }

  /// As Bsdf::set_probabilities().
  [[gnu::always_inline]] void set_probabilities() {
    F sum = prob_diffuse_ + prob_specular_;
    if (top_) {
      sum = prob_diffuse_ + prob_specular_ + prob_coat_ + prob_sheen_;
    }
    if (has_below_) {
      sum = sum + prob_below_;
    }
    if (glass_) {
      sum = sum + prob_glass_;
    }
    if (wall_) {
      sum = sum + prob_thin_;
    }
    const F scale = select(sum > 0, sum, F(1));
    prob_diffuse_ = prob_diffuse_ / scale;
    prob_specular_ = prob_specular_ / scale;
    Mask<N> spread = (prob_diffuse_ > 0) | (~facets_.is_smooth & (sum > 0));
    if (has_below_) {
      prob_below_ = prob_below_ / scale;
      spread = spread | (prob_below_ > 0);
    }
    if (glass_) {
      prob_glass_ = prob_glass_ / scale;
      is_even_ = is_even_ & (prob_glass_ > 0) & ~is_not_black(diffuse_);
    }
    if (wall_) {
      prob_thin_ = prob_thin_ / scale;
    }
    if (top_) {
      prob_coat_ = prob_coat_ / scale;
      prob_sheen_ = prob_sheen_ / scale;
      spread = spread | (prob_sheen_ > 0) | (top_->rough(prob_coat_) > 0);
    }
    has_spread_ = (is_lambert_ & has_spread_) | (~is_lambert_ & spread);
  }

  /// The surfaces with films.
  struct Films {
    unsigned on;
    std::array<Interface, N> interface;
    std::array<SpecularLobe, N> specular;
  };
  struct Base {
    F metal, cover;
    Mask<N> has_interface;
  };
  /// Adds films. specular: albedo of the specular lobe. Changes nothing where there are none.
  [[gnu::noinline]] void add_films(const FilmLanes<N>& films, const SurfaceLanes<N>& s,
                                   const Base& base, AlbedoOf<F> e, AlbedoOf<F> average,
                                   Vec3s<N>& specular) {
    films_.emplace().on = films.on;
    const auto color = [](Vec3 c) { return Rgb{c.x, c.y, c.z}; };
    for (unsigned rest = films.on; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      const ThinFilm film = films.lane(k);
      BsdfParameters p;
      p.base_color = color(s.base_color.lane(k));
      p.f0 = color(s.f0.lane(k));
      p.f90 = s.f90.v[k];
      Facets facets;
      facets.wo = facets_.wo.lane(k);
      facets.is_smooth = (facets_.is_smooth.bits() >> k & 1U) != 0;
      const SpecularAlbedo at_wo = {e.e.v[k], e.e5.v[k]};
      const SpecularAlbedo mean = {average.e.v[k], average.e5.v[k]};
      Interface& interface = films_->interface[k];
      if ((base.has_interface.bits() >> k & 1U) != 0) {
        interface = Interface(p, film, facets_.roughness.v[k], facets.wo.z, at_wo, mean);
      }
      interface_.open_wo.v[k] = interface.open_wo;
      interface_.norm.v[k] = interface.norm;
      SpecularLobe& lobe = films_->specular[k];
      lobe = SpecularLobe(p, base.metal.v[k], base.cover.v[k], facets, film, at_wo, mean);
      const Rgb seen = lobe.albedo(facets, at_wo);
      specular.set(k, {seen.r, seen.g, seen.b});
    }
  }
  /// Returns the reflectance of a facet by the specular lobe.
  Vec3s<N> specular_fresnel(F cos_oh) const {
    Vec3s<N> out = specular_.fresnel(cos_oh);
    if (films_) {
      set_fresnel(cos_oh, out);
    }
    return out;
  }
  [[gnu::noinline]] void set_fresnel(F cos_oh, Vec3s<N>& out) const {
    for (unsigned rest = films_->on; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      const Rgb f = films_->specular[k].fresnel(cos_oh.v[k]);
      out.set(k, {f.r, f.g, f.b});
    }
  }
  /// Returns the albedo of the interface at cosine mu, where that with F = 1 is e.
  F interface_albedo(F mu, AlbedoOf<F> e) const {
    F out = interface_.albedo(e);
    if (films_) {
      set_interface_albedo(mu, e, out);
    }
    return out;
  }
  [[gnu::noinline]] void set_interface_albedo(F mu, AlbedoOf<F> e, F& out) const {
    for (unsigned rest = films_->on; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      out.v[k] = films_->interface[k].albedo(mu.v[k], {e.e.v[k], e.e5.v[k]});
    }
  }

  /// As Bsdf::add_solid(). Changes nothing where there is none.
  [[gnu::noinline]] void add_solid(const SurfaceLanes<N>& s, const SolidLanes<N>& solids,
                                   F dielectric, Mask<N> has_specular) {
    const F weight = dielectric * solids.transmission;
    const Vec3s<N> white(F(1));
    const Glass& glass =
        glass_.emplace(GlassParametersOf<F>{s.base_color, white, solids.specular_color, s.f90,
                                            solids.ior, solids.inside},
                       facets_, weight, NoFilm{});
    is_solid_ = weight > 0;
    is_even_ = is_solid_ & ~has_specular;
    prob_diffuse_ = prob_diffuse_ + select(is_solid_, glass.diffuse_above(), F(0));
    prob_below_ = select(is_solid_, glass.diffuse_below(), F(0));
    prob_glass_ =
        select(is_solid_, glass.single() * (weight * max(luminance(s.base_color), F(0.05F))), F(0));
    albedo_ = albedo_ + s.base_color * select(is_solid_, weight, F(0));
  }

  struct Weights {
    F dielectric, lambert;
  };
  /// Adds a thin wall and diffuse transmission. Changes nothing where there are none.
  [[gnu::noinline]] void add_wall(const SurfaceLanes<N>& s, const WallLanes<N>& walls,
                                  Weights weights, AlbedoOf<F> e, AlbedoOf<F> average) {
    is_wall_ = walls.exist();
    const F weight = weights.dielectric * walls.transmission;
    Wall& wall = wall_.emplace(Wall{s.base_color, weight, black()});
    const auto seen = wall.prepare(facets_, interface_, e, average);
    below_ = walls.diffuse_color * (weights.lambert * walls.diffuse);
    interface_.open_wo = select(facets_.is_smooth & (walls.transmission > 0),
                                1 - interface_.fresnel(facets_.wo.z), interface_.open_wo);
    const Vec3s<N> under = below_ * interface_.open_wo;
    prob_specular_ = prob_specular_ + luminance(seen.single.reflected);
    prob_thin_ = wall.prob(seen);
    prob_below_ = prob_below_ + luminance(under) + luminance(seen.multiple);
    albedo_ = albedo_ + seen.single.reflected + seen.single.transmitted + seen.multiple + under;
  }

  /// As Bsdf::add_top(). Changes nothing where there are no layers.
  [[gnu::noinline]] void add_top(const LayerLanes<N>& layers) {
    top_.emplace(layers, facets_.wo);
    if (top_->has_coat) {
      interface_.norm = interface_.norm * top_->coat.diffuse_scale(interface_, facets_.roughness);
    }
    prob_diffuse_ = prob_diffuse_ * top_->open;
    prob_specular_ = prob_specular_ * top_->open;
    prob_coat_ = top_->coat_albedo;
    prob_sheen_ = luminance(top_->sheen.albedo());
    if (has_below_) {
      prob_below_ = prob_below_ * top_->open;
    }
    if (glass_) {
      prob_glass_ = prob_glass_ * top_->open;
    }
    if (wall_) {
      prob_thin_ = prob_thin_ * top_->open;
    }
    albedo_ = albedo_ * top_->open + Vec3s<N>(top_->coat_albedo) + top_->sheen.albedo();
    has_top_ = layers.exist();
  }

  /// Never inlined: inlined copies could round differently, and a lane must not depend on the code
  /// path that its neighbours need.
  [[gnu::noinline]] Eval evaluate_unfolded(Vec3s<N> wi) const {
    Mask<N> seen = wi.z > 0;
    const F cos_pi = wi.z * kInvPi;
    Eval out = {base_color_ * cos_pi, cos_pi};
    if (!is_lambert_all_) {
      const Eval layered = evaluate_layered(wi, cos_pi);
      out.value_cos = select(is_lambert_, out.value_cos, layered.value_cos);
      out.pdf_solid_angle = select(is_lambert_, cos_pi, layered.pdf_solid_angle);
      if (glass_) {
        seen = seen | (is_solid_ & (wi.z < 0));
      }
      if (wall_) {
        seen = seen | (is_wall_ & (wi.z < 0));
      }
    }
    return {select(seen, out.value_cos, black()), select(seen, out.pdf_solid_angle, F(0))};
  }

  Eval evaluate_layered(Vec3s<N> wi, F cos_pi) const {
    const AlbedoOf<F> e = albedo_of(facets_, wi);
    const F under = interface_.coupling(interface_albedo(wi.z, e)) * kInvPi;
    const Vec3s<N> f = diffuse_ * under + specular_.multiple(e);
    const Vec3s<N> h = facets_.half(wi);
    const auto reflection = facets_.reflection(prob_specular_, wi, h);
    Vec3s<N> diffuse = select(prob_diffuse_ > 0, f * wi.z, black());
    Vec3s<N> glossy = specular_fresnel(dot(facets_.wo, h)) * reflection.value_cos;
    Eval out = {diffuse + glossy, prob_diffuse_ * cos_pi + reflection.pdf_solid_angle};
    if (glass_) {
      add_glass(wi, diffuse, glossy, out);
    }
    if (wall_) {
      const Vec3s<N> below = below_ * under + wall_->multiple * (1 - e.e);
      add_wall_to(wi, below * abs(wi.z), diffuse, glossy, out);
    }
    if (top_) {
      const Vec3s<N> bare = out.value_cos;
      top_->add(wi, diffuse, glossy, {prob_sheen_, top_->rough(prob_coat_)}, out);
      out.value_cos = select(has_top_, out.value_cos, bare);
    }
    return out;
  }

  /// Adds solid glass and its multiple scattering. diffuse, glossy: their parts of the value.
  [[gnu::noinline]] void add_glass(Vec3s<N> wi, Vec3s<N>& diffuse, Vec3s<N>& glossy,
                                   Eval& out) const {
    const Mask<N> above = wi.z > 0;
    const F mu = abs(wi.z);
    const F prob = select(above, prob_diffuse_, prob_below_);
    Vec3s<N> spread = select(above, diffuse, black());
    if (glass_->has_multiple()) {
      spread = spread + select(prob > 0, glass_->multiple(facets_, wi, above) * mu, black());
    }
    const F bare = select(above, out.pdf_solid_angle, prob_below_ * (mu * kInvPi));
    Eval lobe = {select(above, glossy, black()), select(is_even_, prob * (0.5F * kInvPi), bare)};
    glass_->add(facets_, prob_glass_, wi, lobe);
    diffuse = select(is_solid_, spread, diffuse);
    glossy = select(is_solid_, lobe.value_cos, glossy);
    out.value_cos = select(is_solid_, spread + lobe.value_cos, out.value_cos);
    out.pdf_solid_angle = select(is_solid_, lobe.pdf_solid_angle, out.pdf_solid_angle);
  }

  /// As add_glass(), of walls. below: value of diffuse transmission.
  [[gnu::noinline]] void add_wall_to(Vec3s<N> wi, Vec3s<N> below, Vec3s<N>& diffuse,
                                     Vec3s<N>& glossy, Eval& out) const {
    const Mask<N> above = wi.z > 0;
    const F pdf = select(above, out.pdf_solid_angle, prob_below_ * (abs(wi.z) * kInvPi));
    Eval lobe = {select(above, glossy, black()), pdf};
    wall_->add(facets_, interface_, prob_thin_, wi, lobe);
    below = select(prob_below_ > 0, below, black());
    diffuse = select(is_wall_, select(above, diffuse, below), diffuse);
    glossy = select(is_wall_, lobe.value_cos, glossy);
    out.value_cos = select(is_wall_, diffuse + glossy, out.value_cos);
    out.pdf_solid_angle = select(is_wall_, lobe.pdf_solid_angle, out.pdf_solid_angle);
  }

  Vec3s<N> ng_;
  Mask<N> is_flat_;
  Mask<N> is_lambert_;
  bool is_flat_all_;
  bool is_lambert_all_;
  Vec3s<N> base_color_;
  Vec3s<N> albedo_;
  Mask<N> has_spread_;
  // For lanes that are not Lambert.
  FacetsOf<F> facets_;
  InterfaceOf<F> interface_;
  PlainSpecularOf<F> specular_;
  Vec3s<N> diffuse_;
  F prob_diffuse_, prob_specular_;
  // For lanes with films, and of them only.
  std::optional<Films> films_;
  // For lanes on the boundaries of solids.
  std::optional<Glass> glass_;
  Mask<N> is_solid_;
  Mask<N> is_even_;  ///< as DiffuseLobe::is_even
  F prob_glass_;
  // For lanes with walls.
  std::optional<Wall> wall_;
  Mask<N> is_wall_;
  Vec3s<N> below_;  ///< weighted colour of diffuse transmission
  F prob_thin_;
  // For lanes with either.
  bool has_below_ = false;  ///< diffuse light may leave below
  F prob_below_;
  // For lanes with layers.
  std::optional<TopLayersOf<F>> top_;
  Mask<N> has_top_;
  F prob_coat_, prob_sheen_;
};

}  // namespace core
