/// A camera's place on a sphere around a point: what turntables and product views are made of.
///
/// Angles as in model-viewer: theta turns counter-clockwise about +y, seen from above, and is 0 in
/// front (+z); phi counts from +y.
#pragma once

#include <optional>

#include "core/math/bounds.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

struct CameraOrbit {
  float theta_degrees = 0;
  float phi_degrees = 75;         ///< 0: from above, 180: from below
  std::optional<float> radius_m;  ///< empty: the sphere around the box just fits the view
  std::optional<Vec3> target;     ///< empty: the centre of the box
  friend bool operator==(const CameraOrbit&, const CameraOrbit&) = default;
};

/// `camera` with the position, target and (unless it has one) up direction of the orbit. bounds: of
/// the scene, metres, world. width, height: of the film, pixels.
CameraSettings placed_on_orbit(CameraSettings camera, const CameraOrbit& orbit,
                               const Bounds& bounds, int width, int height);

/// Distance at which a sphere of that radius touches the edges of the view.
float fitting_distance_m(float radius_m, float vertical_fov_rad, float aspect);

}  // namespace core
