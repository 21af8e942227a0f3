/// Pictures of data (depths, normals, counts): which values become black and white.
#pragma once

#include "api/requests.h"
#include "core/image_io/image_rows.h"

namespace server {

struct ValueRange {
  float low = 0;
  float high = 1;
};

/// The range that was asked for. Automatic: from the least to the greatest finite value of the
/// image, zeros aside (a depth of 0 is no depth); with negative values as far to both sides of 0.
/// low < high always.
ValueRange value_range(const core::ImageRows& image, const api::ImageRange& asked);

/// The image with low moved to 0 and high to 1; values that are not finite become 0.
core::ImageRows rescaled(core::ImageRows image, ValueRange range);

}  // namespace server
