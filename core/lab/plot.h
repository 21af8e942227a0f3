/// Shows a run as SVG text: a log-log plot of RMSE over n with fitted and theoretical slopes, and
/// the sample points if the experiment shows them; or as CSV.
#pragma once

#include <span>
#include <string>

#include "core/lab/run.h"

namespace core::lab {

/// Returns an SVG document, readable on light and dark backgrounds. points: in any order of n.
std::string plot_svg(const Setup& setup, std::span<const Point> points, const Outcome& outcome);

/// Returns a header and one row per point; numbers have 17 digits.
std::string points_csv(std::span<const Point> points);

}  // namespace core::lab
