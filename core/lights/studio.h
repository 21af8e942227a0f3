/// Studios: light for products, made in code.
///
/// A preset is a room of even or graded grey and lights before it: rectangles of light that are
/// tangent to the sphere of directions, with soft edges. The front is +z, as glTF's models have it.
/// Every preset has the power of a white environment: the mean of its radiance is 1.
#pragma once

#include "core/color/rgb.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

class Studio {
 public:
  explicit Studio(EnvironmentPreset preset);
  /// From a direction (unit, y up).
  Rgb radiance(Vec3 direction) const { return Rgb(unscaled(direction) * scale_); }

 private:
  float unscaled(Vec3 direction) const;

  EnvironmentPreset preset_;
  float scale_ = 1;
};

}  // namespace core
