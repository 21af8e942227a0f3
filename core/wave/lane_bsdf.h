/// Bsdf in lanes: Lambert, and glTF's metallic-roughness surface without further layers.
///
/// Formulas, order of lobes and use of random numbers are those of core/bsdf/bsdf.h. Each lane is
/// either Lambert or not; if all are Lambert, nothing else is computed.
#pragma once

#include "core/bsdf/albedo_tables.h"
#include "core/math/lane_math.h"

namespace core {

/// True for NaN. Colours are Vec3s of red, green and blue.
template <std::size_t N>
Mask<N> is_not_black(Vec3s<N> c) {
  const Floats<N> zero(0);
  return ~((c.x == zero) & (c.y == zero) & (c.z == zero));
}
template <std::size_t N>
Floats<N> luminance(Vec3s<N> c) {
  return Floats<N>(0.2126F) * c.x + Floats<N>(0.7152F) * c.y + Floats<N>(0.0722F) * c.z;
}

/// The result of shading: Shading and BsdfParameters of N points.
template <std::size_t N>
struct SurfaceLanes {
  Vec3s<N> normal_geometric;  ///< on the viewer's side, like the next two
  Vec3s<N> normal;
  Vec3s<N> horizon;
  Vec3s<N> origin;
  Floats<N> error_m;  ///< SurfacePoint::error_m
  Vec3s<N> base_color;
  Floats<N> metallic, roughness, alpha;
  Vec3s<N> f0;
  Floats<N> f90;
};

/// SpecularAlbedo
template <std::size_t N>
struct AlbedoLanes {
  Floats<N> e, e5;
};

/// The tables of core/bsdf/albedo_tables.h, with the nodes of one lookup stored together.
class LaneAlbedoTables {
 public:
  LaneAlbedoTables() {
    for (int j = 0; j < kAlbedoNodes; ++j) {
      average_[j] = {kAlbedoTables.e_average[j], kAlbedoTables.e5_average[j]};
      for (int i = 0; i < kAlbedoNodes; ++i) {
        single_[j * kAlbedoNodes + i] = {kAlbedoTables.e[j][i], kAlbedoTables.e5[j][i]};
      }
    }
  }

  template <std::size_t N>
  AlbedoLanes<N> at(Floats<N> mu, Floats<N> roughness) const {
    const Floats<N> last(kAlbedoNodes - 1);
    return between<N>(sqrt(clamp01(mu)) * last, clamp01(roughness) * last);
  }
  template <std::size_t N>
  AlbedoLanes<N> average(Floats<N> roughness) const {
    const Floats<N> y = clamp01(roughness) * Floats<N>(kAlbedoNodes - 1);
    const Ints<N> j = node(y);
    alignas(32) std::int32_t nodes[N];
    store(nodes, j);
    const float* rows[N];
    for (std::size_t k = 0; k < N; ++k) {
      rows[k] = &average_[nodes[k]].e;
    }
    Floats<N> c[4];
    transpose(rows, c);
    const Floats<N> b = y - to_floats(j);
    return {c[0] + (c[2] - c[0]) * b, c[1] + (c[3] - c[1]) * b};
  }

 private:
  struct Node {
    float e, e5;
  };
  template <std::size_t N>
  static Ints<N> node(Floats<N> x) {
    return truncated(min(x, Floats<N>(kAlbedoNodes - 2)));
  }
  template <std::size_t N>
  AlbedoLanes<N> between(Floats<N> x, Floats<N> y) const {
    const Ints<N> i = node(x);
    const Ints<N> j = node(y);
    alignas(32) std::int32_t nodes[N];
    store(nodes, j * Ints<N>(kAlbedoNodes) + i);
    const float* low_rows[N];
    const float* high_rows[N];
    for (std::size_t k = 0; k < N; ++k) {
      low_rows[k] = &single_[nodes[k]].e;
      high_rows[k] = &single_[nodes[k] + kAlbedoNodes].e;
    }
    Floats<N> low[4];
    Floats<N> high[4];
    transpose(low_rows, low);
    transpose(high_rows, high);
    const Floats<N> a = x - to_floats(i);
    const Floats<N> b = y - to_floats(j);
    const auto at = [&](std::size_t k) {
      const Floats<N> below = low[k] + (low[k + 2] - low[k]) * a;
      const Floats<N> above = high[k] + (high[k + 2] - high[k]) * a;
      return below + (above - below) * b;
    };
    return {at(0), at(1)};
  }

  Node single_[kAlbedoNodes * kAlbedoNodes];  ///< [roughness][mu]
  Node average_[kAlbedoNodes];
};

/// (1 - cos)^5
template <std::size_t N>
Floats<N> schlick_weight(Floats<N> cosine) {
  const Floats<N> m = clamp01(Floats<N>(1) - cosine);
  const Floats<N> m2 = m * m;
  return m2 * m2 * m;
}

template <std::size_t N>
class BsdfLanes {
 public:
  /// wo: local, z > 0. ng: local geometric normal, which defines the horizon.
  BsdfLanes(const SurfaceLanes<N>& s, Vec3s<N> wo, Vec3s<N> ng, const LaneAlbedoTables& tables)
      : tables_(tables),
        wo_(wo),
        ng_(ng),
        is_flat_(ng.z > Floats<N>(0.9999995F)),
        is_lambert_((s.f90 == zero()) & (s.metallic == zero()) & ~is_not_black(s.f0)),
        base_color_(s.base_color) {
    is_lambert_all_ = is_lambert_.all();
    is_flat_all_ = is_flat_.all();
    albedo_ = base_color_;
    has_spread_ = is_not_black(base_color_);
    if (!is_lambert_all_) {
      set_specular(s);
    }
  }

  struct Eval {
    Vec3s<N> value_cos;
    Floats<N> pdf_solid_angle;
  };
  struct Sample {
    Vec3s<N> wi;
    Vec3s<N> weight;  ///< black: no direction was sampled
    Floats<N> pdf_solid_angle;
    Mask<N> is_delta;
  };

  Eval evaluate(Vec3s<N> wi) const {
    if (is_flat_all_) {
      return evaluate_unfolded(wi);
    }
    const Floats<N> side = dot(wi, ng_);
    const Vec3s<N> mirrored = wi - ng_ * (Floats<N>(2) * side);
    const Eval a = evaluate_unfolded(wi);
    const Eval b = evaluate_unfolded(mirrored);
    const Mask<N> keep_a = is_flat_ | (side * wi.z > zero());
    const Mask<N> keep_b = ~is_flat_ & (side * mirrored.z > zero());
    return {select(keep_a, a.value_cos, black()) + select(keep_b, b.value_cos, black()),
            select(keep_a, a.pdf_solid_angle, zero()) + select(keep_b, b.pdf_solid_angle, zero())};
  }

  Sample sample(Floats<N> u_lobe, Vec2s<N> u) const {
    Sample s;
    s.wi = cosine_hemisphere(u);
    s.is_delta = Mask<N>::of(0);
    Mask<N> valid = s.wi.z > zero();
    if (!is_lambert_all_) {
      const Mask<N> specular = ~is_lambert_ & ~(u_lobe < prob_diffuse_);
      if (specular.any()) {
        s.is_delta = specular & is_smooth_;
        s.wi = select(specular, reflected(u), s.wi);
        valid = (s.wi.z > zero()) & (~specular | (u_lobe - prob_diffuse_ < prob_specular_));
      }
    }
    if (!is_flat_all_) {
      const Floats<N> side = dot(s.wi, ng_);
      s.wi = select(~is_flat_ & (side * s.wi.z < zero()), s.wi - ng_ * (Floats<N>(2) * side), s.wi);
    }
    const Eval f = evaluate(s.wi);
    const Mask<N> plain = is_lambert_ & is_flat_;
    valid = valid & (plain | s.is_delta | (f.pdf_solid_angle > zero()));
    s.weight = select(plain, base_color_, f.value_cos * (Floats<N>(1) / f.pdf_solid_angle));
    s.pdf_solid_angle = f.pdf_solid_angle;
    if (s.is_delta.any()) {
      s.weight = select(s.is_delta, fresnel(wo_.z) * (Floats<N>(1) / prob_specular_), s.weight);
      s.pdf_solid_angle = select(s.is_delta, zero(), s.pdf_solid_angle);
    }
    s.weight = select(valid, s.weight, black());
    return s;
  }

  Mask<N> has_spread() const { return has_spread_; }
  /// If true, sample() does not use u_lobe.
  bool has_one_lobe() const { return is_lambert_all_; }
  Vec3s<N> albedo() const { return albedo_; }

 private:
  static Floats<N> zero() { return Floats<N>(0); }
  static Vec3s<N> black() { return {zero(), zero(), zero()}; }
  static Vec3s<N> grey(Floats<N> x) { return {x, x, x}; }

  /// As in core/bsdf/cover.h.
  static Floats<N> multiple_scattering(Floats<N> f0, Floats<N> f90, Floats<N> e) {
    const Floats<N> f = f0 + (f90 - f0) * Floats<N>(1.0F / 21.0F);
    return f * f * e / (Floats<N>(1) - f * (Floats<N>(1) - e));
  }
  static Vec3s<N> multiple_scattering(Vec3s<N> f0, Floats<N> f90, Floats<N> e) {
    return {multiple_scattering(f0.x, f90, e), multiple_scattering(f0.y, f90, e),
            multiple_scattering(f0.z, f90, e)};
  }
  Floats<N> cover_albedo(AlbedoLanes<N> e) const {
    return cover_f0_ * (e.e - e.e5) + cover_f90_ * e.e5 + cover_multiple_ * (Floats<N>(1) - e.e);
  }
  Vec3s<N> fresnel(Floats<N> cosine) const {
    const Floats<N> w = schlick_weight(cosine);
    return f0_ * (Floats<N>(1) - w) + grey(f90_ * w);
  }

  /// Precomputes the terms of Bsdf's constructor, Cover and SpecularLobe.
  void set_specular(const SurfaceLanes<N>& s) {
    const Floats<N> one(1);
    const Floats<N> metal = s.metallic;
    const Floats<N> cover = one - metal;
    roughness_ = s.roughness;
    alpha_ = s.alpha;
    is_smooth_ = alpha_ < Floats<N>(5e-4F);
    const AlbedoLanes<N> e = tables_.at(wo_.z, roughness_);
    const AlbedoLanes<N> average = tables_.average(roughness_);
    const Mask<N> has_cover =
        (cover > zero()) & ((max_component(s.f0) > zero()) | (s.f90 > zero()));
    cover_f0_ = select(has_cover, max_component(s.f0), zero());
    cover_f90_ = select(has_cover, s.f90, zero());
    cover_multiple_ = multiple_scattering(cover_f0_, cover_f90_, average.e);
    const Floats<N> open_wo = one - cover_albedo(e);
    const Floats<N> norm = one / max(one - cover_albedo(average), Floats<N>(1e-4F));
    coupling_ = open_wo * norm;

    f0_ = s.base_color * metal + s.f0 * cover;
    f90_ = metal + s.f90 * cover;
    multiple_scale_ =
        select(is_smooth_, zero(),
               (one - e.e) * Floats<N>(kInvPi) / max(one - average.e, Floats<N>(1e-4F)));
    multiple_color_ = multiple_scattering(s.f0, s.f90, average.e) * cover +
                      multiple_scattering(s.base_color, one, average.e) * metal;
    diffuse_ = s.base_color * cover;

    const Vec3s<N> specular =
        select(is_smooth_, fresnel(wo_.z), f0_ * (e.e - e.e5) + grey(f90_ * e.e5));
    const Vec3s<N> multiple = select(is_smooth_, black(), multiple_color_ * (one - e.e));
    const Vec3s<N> substrate = diffuse_ * open_wo;
    prob_diffuse_ = luminance(substrate) + luminance(multiple);
    prob_specular_ = luminance(specular);
    const Floats<N> sum = prob_diffuse_ + prob_specular_;
    const Floats<N> scale = select(sum > zero(), sum, one);
    prob_diffuse_ = prob_diffuse_ / scale;
    prob_specular_ = prob_specular_ / scale;
    albedo_ = select(is_lambert_, albedo_, substrate + multiple + specular);
    const Mask<N> spread = (prob_diffuse_ > zero()) | (~is_smooth_ & (sum > zero()));
    has_spread_ = (is_lambert_ & has_spread_) | (~is_lambert_ & spread);
    lambda_o_ = lambda(wo_);
  }

  /// Never inlined: inlined copies could round differently, and a lane must not depend on the code
  /// path that its neighbours need.
  [[gnu::noinline]] Eval evaluate_unfolded(Vec3s<N> wi) const {
    const Mask<N> above = wi.z > zero();
    const Floats<N> cos_pi = wi.z * Floats<N>(kInvPi);
    Eval out = {base_color_ * cos_pi, cos_pi};
    if (!is_lambert_all_) {
      const Eval layered = evaluate_layered(wi, cos_pi);
      out.value_cos = select(is_lambert_, out.value_cos, layered.value_cos);
      out.pdf_solid_angle = select(is_lambert_, cos_pi, layered.pdf_solid_angle);
    }
    return {select(above, out.value_cos, black()), select(above, out.pdf_solid_angle, zero())};
  }

  Eval evaluate_layered(Vec3s<N> wi, Floats<N> cos_pi) const {
    const Floats<N> one(1);
    const AlbedoLanes<N> e = tables_.at(wi.z, roughness_);
    const Mask<N> has_diffuse = prob_diffuse_ > zero();
    const Vec3s<N> f = diffuse_ * (coupling_ * (one - cover_albedo(e)) * Floats<N>(kInvPi)) +
                       multiple_color_ * (multiple_scale_ * (one - e.e));
    const Vec3s<N> h = normalize_or(wo_ + wi, Vec3s<N>(zero(), zero(), one));
    const Floats<N> common = select(is_smooth_, zero(), density(h) / (Floats<N>(4) * wo_.z));
    const Floats<N> g2 = one / (one + lambda_o_ + lambda(wi));
    return {select(has_diffuse, f * wi.z, black()) + fresnel(dot(wo_, h)) * (common * g2),
            prob_diffuse_ * cos_pi + prob_specular_ * common / (one + lambda_o_)};
  }

  /// As in core/bsdf/ggx.h, for isotropic lobes.
  Floats<N> density(Vec3s<N> h) const {
    const Floats<N> x = h.x / alpha_;
    const Floats<N> y = h.y / alpha_;
    const Floats<N> k = x * x + y * y + h.z * h.z;
    return Floats<N>(1) / (Floats<N>(kPi) * alpha_ * alpha_ * k * k);
  }
  Floats<N> lambda(Vec3s<N> w) const {
    const Floats<N> z2 = w.z * w.z;
    const Floats<N> x = alpha_ * w.x;
    const Floats<N> y = alpha_ * w.y;
    return select(z2 > zero(),
                  Floats<N>(0.5F) * (sqrt(Floats<N>(1) + (x * x + y * y) / z2) - Floats<N>(1)),
                  Floats<N>(1e18F));
  }
  /// Reflects wo at a sampled visible normal; for smooth surfaces at the shading normal.
  Vec3s<N> reflected(Vec2s<N> u) const {
    const Floats<N> one(1);
    const Vec3s<N> scaled = {wo_.x * alpha_, wo_.y * alpha_, wo_.z};
    const Vec3s<N> stretched = scaled * (one / length(scaled));
    Floats<N> sine;
    Floats<N> cosine;
    sincos(Floats<N>(kTwoPi) * u.x, sine, cosine);
    const Floats<N> z = (one - u.y) * (one + stretched.z) - stretched.z;
    const Floats<N> r = safe_sqrt(one - z * z);
    const Vec3s<N> half = Vec3s<N>(r * cosine, r * sine, z) + stretched;
    const Vec3s<N> up = {zero(), zero(), one};
    const Vec3s<N> facet = normalize_or(Vec3s<N>(half.x * alpha_, half.y * alpha_, half.z), up);
    const Vec3s<N> h = select(is_smooth_, up, facet);
    return h * (Floats<N>(2) * dot(wo_, h)) - wo_;
  }

  const LaneAlbedoTables& tables_;
  Vec3s<N> wo_;
  Vec3s<N> ng_;
  Mask<N> is_flat_;
  Mask<N> is_lambert_;
  bool is_flat_all_;
  bool is_lambert_all_;
  Vec3s<N> base_color_;
  Vec3s<N> albedo_;
  Mask<N> has_spread_;
  // For lanes that are not Lambert.
  Mask<N> is_smooth_;
  Floats<N> roughness_, alpha_, lambda_o_;
  Floats<N> cover_f0_, cover_f90_, cover_multiple_, coupling_;
  Vec3s<N> f0_, multiple_color_, diffuse_;
  Floats<N> f90_, multiple_scale_;
  Floats<N> prob_diffuse_, prob_specular_;
};

}  // namespace core
