/// Surface scattering in both transport modes: radiance along camera paths, and power along light
/// paths (the adjoint).
///
/// K(v; l) is Bsdf::evaluate for viewing direction v: the surface is shaded for v, with normals
/// facing v. Radiance towards v is the integral of K(v; l) L(l) over l. Power that arrives along wo
/// leaves along wi by the adjoint, K(wi; wo) |ng . wi| / |ng . wo|, with ng the geometric normal:
/// the surface is shaded again for wi. This holds for any normals and has no factor 1 / eta^2.
/// Source: Veach 1997, ch. 5 (5.3 for shading normals, 5.2 for refraction).
///
/// Not covered: smooth lobes where the shading normal sends light below the horizon, which camera
/// paths mirror there; and Shading::origin, which lies above the facet that a particle hits.
#pragma once

#include <cstdint>

#include "core/materials/shade.h"

namespace core {

enum class TransportMode : std::uint8_t {
  kRadiance,    ///< from the camera, against the light
  kImportance,  ///< from a light, along the light
};

/// A point to scatter at. The surrounding medium belongs to the path, which passes the relative
/// index of refraction and the weights, as in BsdfParameters.
struct ScatterPoint {
  const Material& material;
  const SurfacePoint& point;
  Footprint footprint;
  float ior = 0;  ///< of the solid over its surroundings; 0: that of the material
  Rgb reflection_weight = {1, 1, 1};
  Rgb refraction_weight = {1, 1, 1};
};

/// The surface shaded for one viewing direction.
class SeenSurface {
 public:
  /// wo_world: unit, away from the surface.
  SeenSurface(const ScatterPoint& at, Vec3 wo_world) noexcept;
  SeenSurface(const SeenSurface&) = delete;  // the Bsdf refers to the layers
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

/// Evaluates scattering between wo, towards the previous vertex, and wi, towards the next: pbrt's f
/// times the cosine, and PDF. Delta lobes are left out.
struct ScatterEval {
  Rgb value_cos;              ///< radiance: K(wo; wi); importance: the adjoint [1/sr]
  float pdf_solid_angle = 0;  ///< density of wi in sample_scatter() from wo in the same mode
  float pdf_reverse = 0;      ///< density of wo in sample_scatter() from wi in the other mode
};
ScatterEval evaluate_scatter(const SeenSurface& from_wo, const SeenSurface& from_wi,
                             TransportMode mode) noexcept;

struct ScatterSample {
  Vec3 wi_world;
  Rgb weight;                 ///< value_cos / pdf_solid_angle; black if absorbed
  float pdf_solid_angle = 0;  ///< 0 if is_delta
  float pdf_reverse = 0;
  bool is_delta = false;
  bool is_null = false;  ///< without deflection
  float eta = 1;         ///< n(wi) / n(wo)
};
/// Samples a direction; u_lobe, u_dir in [0,1). In importance mode with bent shading normals, a
/// fraction of the samples is drawn differently, to cover viewing directions below the horizon of
/// the shading normal.
ScatterSample sample_scatter(const ScatterPoint& at, const SeenSurface& from_wo, float u_lobe,
                             Vec2 u_dir, TransportMode mode) noexcept;

}  // namespace core
