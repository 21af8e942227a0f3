/// Waves compared with one path at a time, pixel by pixel.
#pragma once

#include <cstddef>

#include "core/render/picture/view.h"

namespace test_support {

/// Renders `waves` in waves of paths and `alone` one path at a time. Returns the number of pixels
/// that differ in value, alpha, albedo, normal, depth or a share of the light by more than 1e-3 (of
/// values above 1): those with a path that rounding sent elsewhere. A non-finite sample, or another
/// number of samples in a pixel, counts as all pixels.
std::size_t differing_pixels(const core::View& waves, int width, const core::View& alone,
                             int samples_per_pixel, int threads = 2);

}  // namespace test_support
