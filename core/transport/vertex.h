/// PathVertex: a surface hit of a path.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/film/film.h"
#include "core/geometry/surface_point.h"
#include "core/materials/shade.h"
#include "core/media/medium_stack.h"

namespace core {

struct PathVertex {
  SurfacePoint point;
  Vec3 wo_world;                 ///< unit, back along the path
  float distance_m = 0;          ///< from path.ray.origin, including passed holes
  float passed_m = 0;            ///< before, up to holes in solids
  SolidFace face;                ///< if it bounds a solid; a hole: intersect() only
  MediumStack beyond;            ///< the solids on the other side of `face`
  Shading shading;               ///< filled by surface_event()
  Vec3 light_normal;             ///< for the light sampler; zero if light may come from behind
  bool drew_wavelength = false;  ///< at this vertex, with a reflection that keeps all wavelengths
};

/// Returns the BSDF at a shaded point for viewing direction wo. `shading` must outlive it.
inline Bsdf make_bsdf(const Shading& shading, Vec3 wo_world) noexcept {
  return Bsdf(shading.bsdf, shading.frame.to_local(wo_world),
              shading.frame.to_local(shading.horizon),
              shading.has_layers ? &shading.layers : nullptr);
}

/// Rough surfaces up to this roughness are clear. Source: Cycles' default for transparent glass
/// (Film, Roughness Threshold).
inline constexpr float kClearRoughness = 0.1F;

/// Returns whether light that arrives from wi_world passes a clear rough surface, all of whose
/// transmission is that of its glass. Smooth surfaces are clear too.
inline bool passes_clear(const PathVertex& vertex, Vec3 wi_world) noexcept {
  const Shading& s = vertex.shading;
  return dot(wi_world, s.horizon) < 0 && s.bsdf.roughness <= kClearRoughness &&
         !(s.has_layers && s.layers.diffuse_transmission > 0);
}

/// Records albedo, normal and depth of the first surface for the auxiliary layers.
inline void record_first_surface(PathSample& out, const PathVertex& vertex, Rgb albedo) noexcept {
  out.hit = true;
  out.albedo = albedo;
  out.normal_world = vertex.shading.frame.n;
  out.depth_m = vertex.passed_m + vertex.distance_m;
}

}  // namespace core
