/// Shading: from a hit point and its material to its frame, BSDF and emission.
///
/// Terminator. Light leaves a surface that interpolated normals make look round from the round
/// surface, not from the facet: at `origin`, SurfacePoint::bulge_m above the hit point, over the
/// `horizon` of the interpolated normal. So the edges of facets cast no shadow on the side away
/// from an emitter (Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II, 2021, moves points
/// likewise). Hollow and flat places, and whatever transmits, keep the hit point and the facet's
/// horizon. Directions that the normal map sends below the horizon are mirrored at it (see Bsdf).
/// The rule is the same for camera paths, shadow rays and density queries, and both steps are
/// lossless.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/geometry/surface_point.h"
#include "core/materials/material.h"
#include "core/math/frame.h"

namespace core {

struct Shading {
  Frame frame;            ///< n on the viewer's side
  Vec3 normal_geometric;  ///< unit, world, on the viewer's side
  Vec3 horizon;  ///< unit, world, on the viewer's side: normal of the plane that parts both sides
  Vec3 origin;   ///< where rays leave, world [m]
  bool front = true;  ///< wo is on the front (counter-clockwise) side
  BsdfParameters bsdf;
  bool has_layers = false;  ///< then `layers` holds
  BsdfLayers layers;
};

/// Footprint of a ray cone on a surface.
struct Footprint {
  float width_m = 0;      ///< across the ray
  bool is_sharp = false;  ///< textures are worth several reads along a slanted footprint
};

/// Fills `out` (in place: it is large, and most surfaces need little of it). wo_world: unit, to the
/// viewer. footprint: of the ray's cone at the point, for mip levels. material: the point's own.
void shade(const Material& material, const SurfacePoint& point, Vec3 wo_world, Footprint footprint,
           Shading& out) noexcept;

/// What fills a solid of the material (KHR_materials_volume and its scattering extensions).
Medium medium_within(const MaterialDescription& factors) noexcept;
/// The same with other colours: of attenuation, and of multiple scattering.
Medium medium_within(const MaterialDescription& factors, Rgb attenuation, Rgb deep) noexcept;

/// Result of shade() for materials with neither textures nor vertex colours.
BsdfParameters plain_parameters(const MaterialDescription& factors, bool is_volume) noexcept;

/// Radiance that the material emits at the point towards wo [W/(m^2 sr)]; zero behind a
/// single-sided one.
Rgb emitted(const Material& material, const SurfacePoint& point, Vec3 wo_world) noexcept;

/// Colour of an unlit material: radiance towards any direction [W/(m^2 sr)]. Paths end there,
/// whether they come from the camera or from other surfaces, so mirrors and glass show what the
/// camera would see, and diffuse surfaces receive its light. (KHR_materials_unlit says what is seen
/// and nothing about light; a picture of the surface alone is that of any viewer.)
Rgb unlit_color(const Material& material, const SurfacePoint& point, Vec3 wo_world,
                Footprint footprint) noexcept;

}  // namespace core
