/// surface_event: prepares a hit point for scattering.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Widens the ray cone over the segment to `vertex` and returns the material of the solid around
/// the segment; null if it is in none.
const Material* segment_solid(PathState& path, const PathVertex& vertex) noexcept;

/// As above, for absorbing media: returns the transmittance of the segment per channel
/// (Beer-Lambert).
Rgb segment_transmittance(PathState& path, const PathVertex& vertex) noexcept;

/// Fills vertex.shading: material, normal map, layers. At the boundary of a solid the relative
/// index of refraction follows from the media on both sides; the first dispersive boundary draws
/// the path's hero wavelength. If the path comes from outside, its reflection keeps all
/// wavelengths: each channel is then weighted by the reflectance at its own mean index (the mean of
/// 1 / wavelength^2, in which the index is linear) over the reflectance at the drawn wavelength,
/// which decides between reflection and refraction.
void surface_event(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

/// The solids on both sides of a boundary, seen from the front of its triangle; null outside of
/// all.
struct BoundaryMedia {
  const Solid* within;  ///< behind it
  const Solid* around;  ///< before it
  /// A path passes from `media` to `beyond`. front: it comes from the front.
  BoundaryMedia(const MediumStack& media, const MediumStack& beyond, bool front) noexcept
      : within((front ? beyond : media).top()), around((front ? media : beyond).top()) {}
};

/// Returns the index of refraction behind a boundary over that before it.
float relative_ior(const PathState& path, const BoundaryMedia& at) noexcept;

/// Returns the factor of a straight way through a hole, from `media` to `beyond`: radiance over the
/// square of the index of refraction stays the same, as at a face, so that holes make and destroy
/// no light (Veach 1997, 5.2).
float hole_factor(const PathState& path, const MediumStack& media,
                  const MediumStack& beyond) noexcept;

}  // namespace core
