/// The error of an image by its definition, in plain loops, for images with known expected values.
#pragma once

#include <span>
#include <vector>

#include "core/film/film.h"

namespace test_support {

/// Expected values of the pixels of an image, row by row.
struct Truth {
  int width = 0;
  int height = 0;
  std::vector<core::Rgb> mu;
  std::vector<char> is_opaque;
};
Truth truth_of(const core::FilmSnapshot& reference);

/// Mean over the pixels of sum_c |I - mu| / sum_c (max(I, mu) + F), F = 0.05 (mean of the roots of
/// the luminance of mu)^2.
double defined_error(std::span<const core::Rgb> image, const Truth& truth);
double defined_error(const core::FilmSnapshot& seen, const Truth& truth);

/// The error of each film against the mean of the others, whose noise adds 1 / (2 (films - 1)).
std::vector<double> errors_of(const std::vector<core::FilmSnapshot>& films);
/// The same for other images made from the films.
std::vector<double> errors_of(const std::vector<core::FilmSnapshot>& films,
                              const std::vector<std::vector<core::Rgb>>& images);

std::vector<core::Rgb> image_of(const core::FilmSnapshot& film);

/// The planted fault of estimates: a share of half A is part of half B.
void share_half(core::FilmSnapshot& film, float share);

}  // namespace test_support
