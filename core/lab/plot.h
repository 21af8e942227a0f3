/// A run as a picture: log-log plot of RMSE over n with the fitted and the expected slope, beside
/// it the points of a sampler where the experiment shows them, as SVG text; and as CSV.
#pragma once

#include <span>
#include <string>

#include "core/lab/run.h"

namespace core::lab {

/// A whole SVG document, readable on light and dark ground. points: in any order of n.
std::string plot_svg(const Setup& setup, std::span<const Point> points, const Outcome& outcome);

/// Header and one row for each point; numbers with 17 digits.
std::string points_csv(std::span<const Point> points);

}  // namespace core::lab
