/// Shading: computes frame, BSDF and emission from a hit point and its material.
///
/// Shadow terminator: where interpolated normals imply a smooth convex surface, rays leave from
/// that surface instead of the facet: from `origin`, which is SurfacePoint::bulge_m above the hit
/// point, and over the `horizon` of the interpolated normal. The edges of facets therefore cast no
/// shadow on the side away from an emitter (Hanika, Hacking the Shadow Terminator, Ray Tracing Gems
/// II, 2021, moves points in a similar way). Concave and flat parts, and anything that transmits,
/// keep the hit point and the facet's horizon. Directions that the normal map sends below the
/// horizon are mirrored at it (see Bsdf). The rule is the same for camera paths, shadow rays and
/// density queries, and both steps are lossless.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/geometry/surface_point.h"
#include "core/materials/material.h"
#include "core/math/frame.h"

namespace core {

struct Shading {
  Frame frame;            ///< n is on the viewer's side
  Vec3 normal_geometric;  ///< unit, world, on the viewer's side
  Vec3 horizon;           ///< unit, world, on the viewer's side: normal of the plane that separates
                          ///< reflection from transmission
  Vec3 origin;            ///< ray origin, world [m]
  bool front = true;      ///< wo is on the front (counter-clockwise) side
  BsdfParameters bsdf;
  bool has_layers = false;  ///< if true, `layers` is valid
  BsdfLayers layers;
};

/// The footprint of a ray cone on a surface.
struct Footprint {
  float width_m = 0;      ///< across the ray
  bool is_sharp = false;  ///< textures are read several times along an oblique footprint
};

/// Fills `out` in place, because it is large and most surfaces use little of it. wo_world: unit, to
/// the viewer. footprint: of the ray cone at the point, for mip levels. material: that of the
/// point.
void shade(const Material& material, const SurfacePoint& point, Vec3 wo_world, Footprint footprint,
           Shading& out) noexcept;

/// Returns the interior medium of a material (KHR_materials_volume and its scattering extensions).
Medium medium_within(const MaterialDescription& factors) noexcept;
/// As above, with other colours for attenuation and multiple scattering.
Medium medium_within(const MaterialDescription& factors, Rgb attenuation, Rgb deep) noexcept;

/// Returns the result of shade() for materials without textures and vertex colours.
BsdfParameters plain_parameters(const MaterialDescription& factors, bool is_volume) noexcept;

/// Returns the radiance that the point emits towards wo unless it is a hole [W/(m^2 sr)]; zero on
/// the back of a single-sided material. A clearcoat lies on the emission and darkens it
/// (KHR_materials_clearcoat, Emission). Of unlit materials: the colour, to both sides. Textures are
/// read at the finest level, so that rays and light samples see the same emitter.
Rgb emitted(const Material& material, const SurfacePoint& point, Vec3 wo_world) noexcept;

/// Returns the colour of an unlit material as seen directly, in mirrors and through glass:
/// emitted() with filtered textures. (KHR_materials_unlit defines the appearance but not the
/// emission of light; here the surface emits what any viewer sees, so other surfaces receive its
/// light.)
Rgb unlit_color(const Material& material, const SurfacePoint& point, Vec3 wo_world,
                Footprint footprint) noexcept;

}  // namespace core
