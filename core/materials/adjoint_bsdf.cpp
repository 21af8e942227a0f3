#include "core/materials/adjoint_bsdf.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {
namespace {

/// If the shading normal is bent, viewers between its horizon and the geometric one see a normal
/// that is rotated towards them (shade()). They see light from directions that Bsdf::sample() for
/// that light never samples: a lune on either side of the surface. A fraction of the samples
/// compensates: half of them over the lune, half as an unbent surface scatters, which suits narrow
/// lobes.
class BentNormal {
 public:
  explicit BentNormal(const SeenSurface& seen) noexcept
      : ng_(seen.shading().normal_geometric),
        n_(seen.shading().frame.n),
        cosine_(dot(ng_, n_)),
        both_sides_(seen.bsdf().transmits()) {
    if (cosine_ < kSameNormal) {
      share_ = 0.5F * (1 - cosine_);
      frame_ = frame_from_normal_tangent(ng_, n_ - ng_ * cosine_);
      const Shading& s = seen.shading();
      const Vec3 wo = frame_.to_local(seen.wo_world());
      if (wo.z > 0) {
        unbent_.emplace(s.bsdf, wo, Vec3{0, 0, 1}, s.has_layers ? &s.layers : nullptr);
      }
    }
  }

  /// Returns the lune's fraction of directions, cosine-weighted about ng.
  float share() const noexcept { return share_; }

  /// Samples wi with density pdf_solid_angle(). Zero: no sample.
  Vec3 sample(float u_lobe, Vec2 u) const noexcept {
    if (u_lobe < 0.5F) {
      return sample_lune(u);
    }
    if (!unbent_) {
      return {};
    }
    const BsdfSample s = unbent_->sample(std::min(2 * u_lobe - 1, kOneMinusEpsilon), u);
    return s.is_delta ? Vec3{} : frame_.to_world(s.wi_local);
  }
  float pdf_solid_angle(Vec3 wi) const noexcept {
    const float side = dot(ng_, wi);
    const bool in_lune = side * dot(n_, wi) < 0 && (side > 0 || both_sides_);
    const float lune =
        in_lune ? std::fabs(side) * kInvPi / (share_ * (both_sides_ ? 2.0F : 1.0F)) : 0.0F;
    const float unbent = unbent_ ? unbent_->evaluate(frame_.to_local(wi)).pdf_solid_angle : 0.0F;
    return 0.5F * (lune + unbent);
  }

 private:
  /// Cosine-weighted about ng. Projected to the disk, where that is uniform, the lune lies between
  /// the horizon and half an ellipse whose short axis is the cosine between the normals: chords of
  /// the disk along that axis are shortened into it.
  Vec3 sample_lune(Vec2 u) const noexcept {
    bool above = true;
    if (both_sides_) {
      above = u.x < 0.5F;
      u.x = 2 * u.x - (above ? 0.0F : 1.0F);
    }
    const Vec2 d = concentric_disk(u);
    const float half_chord = safe_sqrt(1 - d.y * d.y);
    const float x = -0.5F * ((1 + cosine_) * half_chord + (1 - cosine_) * d.x);
    const Vec3 wi = frame_.to_world({x, d.y, safe_sqrt(1 - x * x - d.y * d.y)});
    return above ? wi : -wi;  // half a turn about the line where both planes intersect
  }

  Vec3 ng_;  ///< on the side of wo
  Vec3 n_;
  float cosine_ = 1;
  bool both_sides_ = false;
  float share_ = 0;
  Frame frame_;  ///< about ng
  std::optional<Bsdf> unbent_;
};

/// Fills `out` and returns wo in its frame.
Vec3 shade_at(const ScatterPoint& at, Vec3 wo_world, Shading& out) noexcept {
  shade(at.material, at.point, wo_world, at.footprint, out);
  if (at.ior > 0) {
    out.bsdf.ior = at.ior;
  }
  out.bsdf.reflection_weight = at.reflection_weight;
  out.bsdf.refraction_weight = at.refraction_weight;
  return out.frame.to_local(wo_world);
}

/// Returns the density of wi in sample_scatter() from `from`; bsdf_pdf: that of Bsdf::sample()
/// there.
float pdf_in_mode(const SeenSurface& from, Vec3 wi, float bsdf_pdf, TransportMode mode) noexcept {
  if (mode == TransportMode::kRadiance) {
    return bsdf_pdf;
  }
  const BentNormal bent(from);
  const float share = bent.share();
  return share > 0 ? (1 - share) * bsdf_pdf + share * bent.pdf_solid_angle(wi) : bsdf_pdf;
}

TransportMode other(TransportMode mode) noexcept {
  return mode == TransportMode::kRadiance ? TransportMode::kImportance : TransportMode::kRadiance;
}

/// |ng . wi| / |ng . wo|
float cosine_ratio(const SeenSurface& from_wo, Vec3 wi) noexcept {
  const Vec3 ng = from_wo.shading().normal_geometric;
  const float out = std::fabs(dot(ng, from_wo.wo_world()));
  return out > 0 ? std::fabs(dot(ng, wi)) / out : 0.0F;
}

/// Converts a delta lobe's weight from radiance to importance.
Rgb delta_importance(const SeenSurface& from_wo, const SeenSurface& from_wi,
                     const BsdfSample& s) noexcept {
  const Vec3 wi = from_wi.wo_world();
  const Vec3 n = from_wo.shading().frame.n;
  const bool crosses = dot(from_wo.shading().normal_geometric, wi) < 0;
  // Viewers at wi look along wo only if nothing was mirrored and they see the same normal.
  if (s.is_mirrored || crosses != s.transmitted ||
      !(std::fabs(dot(n, from_wi.shading().frame.n)) > 0.999999F)) {
    return {};
  }
  const float open = from_wo.bsdf().delta_share();
  float factor = open > 0 ? cosine_ratio(from_wo, wi) * from_wi.bsdf().delta_share() / open : 0.0F;
  if (s.eta != 1) {  // solid angles on both sides of a smooth boundary are proportional to 1 / (n^2
                     // cos)
    factor *= s.eta * s.eta * std::fabs(dot(n, from_wo.wo_world()) / dot(n, wi));
  }
  return s.weight * factor;
}

}  // namespace

SeenSurface::SeenSurface(const ScatterPoint& at, Vec3 wo_world) noexcept
    : wo_world_(wo_world),
      wo_local_(shade_at(at, wo_world, shading_)),
      bsdf_(shading_.bsdf, wo_local_, shading_.frame.to_local(shading_.horizon),
            shading_.has_layers ? &shading_.layers : nullptr) {}

ScatterEval evaluate_scatter(const SeenSurface& from_wo, const SeenSurface& from_wi,
                             TransportMode mode) noexcept {
  const Vec3 wo = from_wo.wo_world();
  const Vec3 wi = from_wi.wo_world();
  const BsdfEval forward = from_wo.bsdf().evaluate(from_wo.shading().frame.to_local(wi));
  const BsdfEval reverse = from_wi.bsdf().evaluate(from_wi.shading().frame.to_local(wo));
  return {mode == TransportMode::kRadiance ? forward.value_cos
                                           : reverse.value_cos * cosine_ratio(from_wo, wi),
          pdf_in_mode(from_wo, wi, forward.pdf_solid_angle, mode),
          pdf_in_mode(from_wi, wo, reverse.pdf_solid_angle, other(mode))};
}

ScatterSample sample_scatter(const ScatterPoint& at, const SeenSurface& from_wo, float u_lobe,
                             Vec2 u_dir, TransportMode mode) noexcept {
  const BentNormal bent(from_wo);
  const float share = mode == TransportMode::kImportance ? bent.share() : 0.0F;
  ScatterSample out;
  BsdfSample s;
  if (u_lobe < share) {
    out.wi_world = bent.sample(u_lobe / share, u_dir);
    if (out.wi_world == Vec3{}) {
      return {};
    }
  } else {
    s = from_wo.bsdf().sample(std::min((u_lobe - share) / (1 - share), kOneMinusEpsilon), u_dir);
    if (is_black(s.weight)) {
      return {};
    }
    out.wi_world = from_wo.shading().frame.to_world(s.wi_local);
    out.is_delta = s.is_delta;
    out.is_null = s.is_null;
    out.eta = s.eta;
  }
  const SeenSurface from_wi(at, out.wi_world);
  if (s.is_delta) {
    out.weight = mode == TransportMode::kRadiance
                     ? s.weight
                     : delta_importance(from_wo, from_wi, s) * (1 / (1 - share));
    return out;
  }
  const ScatterEval eval = evaluate_scatter(from_wo, from_wi, mode);
  out.pdf_solid_angle = eval.pdf_solid_angle;
  out.pdf_reverse = eval.pdf_reverse;
  out.weight = eval.pdf_solid_angle > 0 ? eval.value_cos / eval.pdf_solid_angle : Rgb{};
  return out;
}

}  // namespace core
