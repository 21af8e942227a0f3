/// FirstSurfaces: what a camera sees at first, for the extent of particles.
#pragma once

#include "core/camera/camera.h"
#include "core/scene/scene_data.h"
#include "core/settings/settings.h"

namespace core {

struct FirstSurfaces {
  Vec3 eye;              ///< mean origin of the camera's rays
  float distance_m = 0;  ///< median along the rays; 0: none was hit
  float pixel_m = 0;     ///< median width of a pixel there
};

/// Traces a grid of 16 x 16 camera rays.
FirstSurfaces first_surfaces(const SceneData& scene, const Camera& camera,
                             const FilmSettings& film);

}  // namespace core
