/// Smaller pictures by averaging areas, in linear light.
#pragma once

#include "core/image_io/image_rows.h"

namespace server {

/// The image with its longer side at most `side_max`; unchanged when it already is. Every pixel of
/// the result is the mean of the area it covers; values that are not finite count for nothing.
core::ImageRows scaled_down(core::ImageRows image, int side_max);

}  // namespace server
