/// Light of an environment outdoors, for comparison with a room.
#pragma once

#include "core/lights/environment.h"

namespace core {

/// Returns the luminance of the irradiance that the environment, with its sun, gives an upward
/// surface under the open sky: lux for photometric units. Exact for texels of constant radiance,
/// over each of which the integral of cos theta is in closed form.
double horizontal_irradiance(const Environment& environment);

}  // namespace core
