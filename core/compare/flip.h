/// FLIP: the difference that a viewer perceives when flipping between two images.
///
/// Source: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, FLIP: A Difference
/// Evaluator for Alternating Images, HPG 2020; all constants are the paper's. LDR form: values are
/// clipped to [0,1] and treated as sRGB colours.
#pragma once

#include <span>
#include <vector>

#include "core/color/rgb.h"

namespace core {

/// At 0.7 m from a screen 0.7 m wide with 3840 pixels.
inline constexpr double kFlipPixelsPerDegree = 67;

/// Returns the difference per pixel, row by row, from 0 (none) to 1. Symmetric in a and b, which
/// both have width * height linear values.
std::vector<float> flip_map(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                            double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace core
