/// Camera positions on a sphere around a point, for turntables and product views.
///
/// Angles as in model-viewer: theta is counter-clockwise about +y seen from above, and 0 in front
/// (+z); phi is measured from +y.
#pragma once

#include <optional>

#include "core/math/bounds.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

struct CameraOrbit {
  float theta_degrees = 0;
  float phi_degrees = 75;         ///< 0: from above, 180: from below
  std::optional<float> radius_m;  ///< empty: the bounding sphere just fits the view
  std::optional<Place> target;    ///< empty: the centre of the bounding box
  friend bool operator==(const CameraOrbit&, const CameraOrbit&) = default;
};

/// Returns `camera` with the orbit's position, target and, unless it has one, up direction. bounds:
/// of the scene, metres. width, height: of the film, pixels. All positions count from one origin.
CameraSettings placed_on_orbit(CameraSettings camera, const CameraOrbit& orbit,
                               const Bounds& bounds, int width, int height);

/// Returns the distance at which a sphere touches the edges of the view. half_view: tangents of
/// half its width and height.
float fitting_distance_m(float radius_m, Vec2 half_view);

}  // namespace core
