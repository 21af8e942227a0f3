/// Images of data (depths, normals, counts): the values mapped to black and white.
#pragma once

#include "api/requests.h"
#include "core/image_io/image_rows.h"

namespace server {

struct ValueRange {
  float low = 0;
  float high = 1;
};

/// Returns the requested range. Automatic: from the least to the greatest finite value of the
/// image, excluding zeros (a depth of 0 means no hit); symmetric about 0 when there are negative
/// values. Always low < high.
ValueRange value_range(const core::ImageRows& image, const api::ImageRange& asked);

/// Maps low to 0 and high to 1; non-finite values become 0.
core::ImageRows rescaled(core::ImageRows image, ValueRange range);

}  // namespace server
