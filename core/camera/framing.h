/// Orbits whose camera stands as near as the model allows.
#pragma once

#include "core/camera/orbit.h"

namespace core {

/// Returns the least distance from the box's centre, metres, at which no corner of the box is
/// nearer to a side of the image than `margin` times its width or height. Other arguments as for
/// placed_on_orbit(); the orbit's own radius and target do not count. Pre: the box is not empty.
float framing_distance_m(const CameraSettings& camera, const CameraOrbit& orbit,
                         const Bounds& bounds, int width, int height, float margin);

/// Returns the greatest framing_distance_m() of all theta: from there, the model keeps its size and
/// the margin while it turns. Pre: also that the camera has no up direction of its own.
float turning_distance_m(const CameraSettings& camera, const CameraOrbit& orbit,
                         const Bounds& bounds, int width, int height, float margin);

}  // namespace core
