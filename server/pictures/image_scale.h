/// Downscales images by averaging areas, in linear light.
#pragma once

#include "core/image_io/image_rows.h"

namespace server {

/// Returns the image with its longer side at most `side_max`; unchanged if it already is. Every
/// pixel is the mean of the area it covers, excluding non-finite values.
core::ImageRows scaled_down(core::ImageRows image, int side_max);

}  // namespace server
