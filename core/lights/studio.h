/// Studios: procedural lighting for products.
///
/// A preset is a room of constant or graded grey with lights in front of it: rectangles tangent to
/// the sphere of directions, with soft edges. The front is +z, as in glTF models. Every preset has
/// the power of a white environment: its mean radiance is 1.
#pragma once

#include "core/color/rgb.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

class Studio {
 public:
  explicit Studio(EnvironmentPreset preset);
  /// Returns the radiance from a direction (unit, y up).
  Rgb radiance(Vec3 direction) const { return Rgb(unscaled(direction) * scale_); }
  /// Returns the exposure in stops at which no diffuse surface that faces a camera in the direction
  /// to_camera (unit) becomes brighter than its albedo: an incident light reading at the brightest
  /// orientation n with dot(n, to_camera) >= 0, log2(pi / irradiance).
  float exposure_stops(Vec3 to_camera) const;

 private:
  float unscaled(Vec3 direction) const;

  EnvironmentPreset preset_;
  float scale_ = 1;
};

/// Returns Studio::exposure_stops() of the preset turned by rotation_degrees, counter-clockwise
/// seen from above. to_camera: unit, world.
float studio_exposure_stops(EnvironmentPreset preset, float rotation_degrees, Vec3 to_camera);

}  // namespace core
