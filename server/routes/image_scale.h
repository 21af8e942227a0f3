/// Smaller pictures by averaging areas, in linear light.
#pragma once

#include "core/image_io/image.h"

namespace server {

/// The image with its longer side at most `side_max`; unchanged when it already is. Every pixel of
/// the result is the mean of the area it covers; values that are not finite count for nothing.
core::FloatImage scaled_down(core::FloatImage image, int side_max);

}  // namespace server
