/// From a hit point and its material to what light transport needs: frame, BSDF, emission.
#pragma once

#include "core/bsdf/bsdf.h"
#include "core/math/frame.h"
#include "core/scene/scene_data.h"

namespace core {

struct Shading {
  Frame frame;                ///< n on the viewer's side
  Vec3 normal_geometric;      ///< unit, world, on the viewer's side
  bool front = true;          ///< wo is on the front (counter-clockwise) side
  BsdfParameters bsdf;
  bool has_layers = false;    ///< then `layers` holds
  BsdfLayers layers;
};

/// Fills `out` (in place: it is large, and most surfaces need little of it). wo_world: unit, to the
/// viewer. footprint_m: width of the ray's cone at the point, for mip levels.
void shade(const SceneData& scene, const SurfacePoint& point, Vec3 wo_world, float footprint_m,
           Shading& out) noexcept;

/// What shade() finds wherever a material has neither textures nor vertex colours.
BsdfParameters plain_parameters(const MaterialDescription& factors, bool is_volume) noexcept;

/// Radiance that the material emits at the point towards wo [W/(m^2 sr)]; zero behind a single-sided one.
Rgb emitted(const SceneData& scene, const SurfacePoint& point, Vec3 wo_world) noexcept;

/// Colour of an unlit material.
Rgb unlit_color(const SceneData& scene, const SurfacePoint& point, float footprint_m) noexcept;

}  // namespace core
