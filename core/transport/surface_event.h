/// surface_event: prepares a hit point for scattering.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Widens the ray cone over the segment to `vertex` and returns the interior medium of the solid
/// around the segment; null if it is in none. Enters the solid if the segment lies inside one that
/// the path never entered (the camera is inside, or the path passed a hole).
const Medium* segment_medium(const SceneData& scene, PathState& path,
                             const PathVertex& vertex) noexcept;

/// As above, for absorbing media: returns the transmittance of the segment per channel
/// (Beer-Lambert).
Rgb segment_transmittance(const SceneData& scene, PathState& path,
                          const PathVertex& vertex) noexcept;

/// Fills vertex.shading: material, normal map, layers. At the boundary of a solid the relative
/// index of refraction follows from the media on both sides; the first dispersive boundary draws
/// the path's hero wavelength. If the path comes from outside, its reflection keeps all
/// wavelengths: each channel is then weighted by the reflectance at its own mean index (the mean of
/// 1 / wavelength^2, in which the index is linear) over the reflectance at the drawn wavelength,
/// which decides between reflection and refraction.
void surface_event(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

/// Returns the index of refraction of a solid over that of its surroundings, for a path inside
/// `media`. front: the path hits the boundary from outside.
float relative_ior(const PathState& path, const MediumStack& media, const Material& material,
                   bool front) noexcept;

}  // namespace core
