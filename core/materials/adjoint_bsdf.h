/// Scattering at a surface for light that is followed either way: viewers' paths, which carry
/// radiance, and particles, which carry importance's adjoint, power.
///
/// K(v; l) is Bsdf::evaluate for the viewer direction v: the surface is shaded for v, its normals
/// face v. Radiance towards v is the integral of K(v; l) L(l) over l. Power that arrives along wo
/// leaves along wi by the adjoint, K(wi; wo) |ng . wi| / |ng . wo|, ng the geometric normal: the
/// surface shaded anew for wi. That holds whatever the normals; there is no 1 / eta^2 in it.
/// Source: Veach 1997, ch. 5 (5.3 for shading normals, 5.2 for refraction).
///
/// Left out: smooth lobes where the shading normal sends light below the horizon, which viewers see
/// mirrored there; and Shading::origin, which lies above the facet that a particle meets.
#pragma once

#include <cstdint>

#include "core/materials/shade.h"

namespace core {

enum class TransportMode : std::uint8_t {
  kRadiance,    ///< from a viewer, against the light
  kImportance,  ///< from a light, with it
};

/// A point to scatter at. The medium around a solid is state of the path, which passes the relative
/// index of refraction and the weights, as in BsdfParameters.
struct ScatterPoint {
  const Material& material;
  const SurfacePoint& point;
  Footprint footprint;
  float ior = 0;  ///< of the solid over its surroundings; 0: the material's own
  Rgb reflection_weight = {1, 1, 1};
  Rgb refraction_weight = {1, 1, 1};
};

/// The surface as it is seen along one direction.
class SeenSurface {
 public:
  /// wo_world: unit, away from the surface.
  SeenSurface(const ScatterPoint& at, Vec3 wo_world) noexcept;
  SeenSurface(const SeenSurface&) = delete;  // the Bsdf borrows the layers
  SeenSurface& operator=(const SeenSurface&) = delete;

  const Shading& shading() const noexcept { return shading_; }
  const Bsdf& bsdf() const noexcept { return bsdf_; }
  Vec3 wo_world() const noexcept { return wo_world_; }

 private:
  Shading shading_;
  Vec3 wo_world_;
  Vec3 wo_local_;
  Bsdf bsdf_;
};

/// Scattering between wo, where the path comes from, and wi, where it goes: pbrt's f and PDF times
/// the cosine. Delta lobes are left out.
struct ScatterEval {
  Rgb value_cos;              ///< radiance: K(wo; wi); importance: its adjoint [1/sr]
  float pdf_solid_angle = 0;  ///< of wi, by sample_scatter() from wo in the same mode
  float pdf_reverse = 0;      ///< of wo, by sample_scatter() from wi in the other mode
};
ScatterEval evaluate_scatter(const SeenSurface& from_wo, const SeenSurface& from_wi,
                             TransportMode mode) noexcept;

struct ScatterSample {
  Vec3 wi_world;
  Rgb weight;                 ///< value_cos / pdf_solid_angle; black: absorbed
  float pdf_solid_angle = 0;  ///< 0 when is_delta
  float pdf_reverse = 0;
  bool is_delta = false;
  bool is_straight = false;  ///< as through a hole
  float eta = 1;             ///< n(wi) / n(wo)
};
/// u_lobe, u_dir in [0,1). In importance mode, where normals are bent, a share of the samples goes
/// by other means, for the sake of viewers below the shading normal's horizon.
ScatterSample sample_scatter(const ScatterPoint& at, const SeenSurface& from_wo, float u_lobe,
                             Vec2 u_dir, TransportMode mode) noexcept;

}  // namespace core
