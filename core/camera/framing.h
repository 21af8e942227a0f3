/// Orbits whose camera stands as near as the model allows.
#pragma once

#include <vector>

#include "core/camera/orbit.h"

namespace core {

struct Framing {
  float distance_m = 0;  ///< from the target to the camera
  Vec3 target;           ///< The model is in the middle of the image.
};

/// Returns the nearest framing of a model at which no point is nearer to a side of the image than
/// `margin` times its width or height. points: whose hull is the model's, metres. Other arguments
/// as for placed_on_orbit(); the orbit's own radius and target do not count. Pre: there is a point.
Framing nearest_framing(const CameraSettings& camera, const CameraOrbit& orbit,
                        const std::vector<Vec3>& points, int width, int height, float margin);

/// Returns the nearest framing of all that the model can be turned to about the vertical axis
/// through the middle of its box: from there, it keeps its size and the margin while it turns. Pre:
/// also that the camera has no up direction of its own.
Framing turning_framing(const CameraSettings& camera, const CameraOrbit& orbit,
                        const std::vector<Vec3>& points, int width, int height, float margin);

}  // namespace core
