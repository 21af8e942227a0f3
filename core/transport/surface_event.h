/// surface_event: prepares a hit point for scattering.
#pragma once

#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"
#include "core/transport/vertex.h"

namespace core {

/// Widens the ray cone over the segment to `vertex`, enters the solid when the segment turns out to
/// lie inside one that was never entered (the eye is inside, or the way led through a hole), and
/// returns what fills the solid around the segment; null: it is in none.
const Medium* segment_medium(const SceneData& scene, PathState& path,
                             const PathVertex& vertex) noexcept;

/// The same for media that absorb only: returns the transmittance of the segment (Beer and
/// Lambert), per channel.
Rgb segment_transmittance(const SceneData& scene, PathState& path,
                          const PathVertex& vertex) noexcept;

/// Fills vertex.shading: material, normal map, layers. At the boundary of a solid the relative
/// index of refraction follows from the media around; the first dispersive boundary draws the
/// path's hero wavelength. Met from outside, what is reflected keeps all wavelengths: each channel
/// then counts with the reflectance at its own mean index (of 1 / wavelength^2, in which the index
/// is linear), over that at the wavelength drawn, which decides.
void surface_event(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept;

/// Index of refraction of a solid over that of its surroundings, for a path inside `media`.
/// front: the boundary is seen from outside.
float relative_ior(const PathState& path, const MediumStack& media, const Material& material,
                   bool front) noexcept;

}  // namespace core
