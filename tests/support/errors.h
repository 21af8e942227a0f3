/// The error of an image by its definition, in plain loops, for films with known expected values.
#pragma once

#include <vector>

#include "core/film/film.h"

namespace test_support {

/// The true values of a pixel.
struct PixelTruth {
  core::Rgb noise;       ///< variance of its value, or the squared error of an image
  core::Rgb signal;      ///< square of its expected value
  double luminance = 0;  ///< of its expected value
  bool is_opaque = true;
};

/// sqrt(sum over tiles of 32x32 of n / n_all N / (max(S, 0) + 3 n (0.05 L)^2)); row by row.
double defined_error(const std::vector<PixelTruth>& pixels, int width, int height);
/// The same for each tile, row by row.
std::vector<double> defined_tile_errors(const std::vector<PixelTruth>& pixels, int width,
                                        int height);

/// From the variance over images with different seeds.
std::vector<PixelTruth> truth_of(const std::vector<core::FilmSnapshot>& films);
/// The error of `seen` itself, relative to a film of many samples, minus the error of that film.
std::vector<PixelTruth> truth_of(const core::FilmSnapshot& seen,
                                 const core::FilmSnapshot& reference);

/// Sums of the tiles of a snapshot of a whole film.
std::vector<core::TileSums> tile_sums(const core::FilmSnapshot& film);

}  // namespace test_support
