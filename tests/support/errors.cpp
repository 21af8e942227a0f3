#include "tests/support/errors.h"

#include <algorithm>
#include <cmath>

namespace test_support {

std::vector<core::Rgb> image_of(const core::FilmSnapshot& film) {
  std::vector<core::Rgb> out;
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    out.push_back(core::pixel_value(film, p).mean);
  }
  return out;
}

Truth truth_of(const core::FilmSnapshot& reference) {
  Truth out = {reference.rect.width, reference.rect.height, image_of(reference), {}};
  for (std::size_t p = 0; p < reference.pixel_count(); ++p) {
    const bool is_empty =
        core::is_empty(core::half_value(reference, p, 0), core::half_value(reference, p, 1));
    out.is_opaque.push_back(is_empty ? 0 : 1);
  }
  return out;
}

double defined_error(std::span<const core::Rgb> image, const Truth& truth) {
  double roots = 0;
  double pixels = 0;
  for (std::size_t p = 0; p < image.size(); ++p) {
    if (truth.is_opaque[p] != 0) {
      roots += std::sqrt(std::max(static_cast<double>(luminance(truth.mu[p])), 0.0));
      pixels += 1;
    }
  }
  const double floor = pixels > 0 ? 0.05 * (roots / pixels) * (roots / pixels) : 0;
  double sum = 0;
  for (std::size_t p = 0; p < image.size(); ++p) {
    double apart = 0;
    double scale = 0;
    for (int c = 0; c < 3; ++c) {
      const auto seen = static_cast<double>(image[p][c]);
      const auto mu = static_cast<double>(truth.mu[p][c]);
      apart += std::abs(seen - mu);
      scale += std::max(seen, mu) + floor;
    }
    sum += truth.is_opaque[p] != 0 && apart > 0 ? apart / scale : 0;
  }
  return pixels > 0 ? sum / pixels : 0;
}

double defined_error(const core::FilmSnapshot& seen, const Truth& truth) {
  return defined_error(image_of(seen), truth);
}

std::vector<double> errors_of(const std::vector<core::FilmSnapshot>& films) {
  std::vector<std::vector<core::Rgb>> images;
  for (const core::FilmSnapshot& film : films) {
    images.push_back(image_of(film));
  }
  return errors_of(films, images);
}

std::vector<double> errors_of(const std::vector<core::FilmSnapshot>& films,
                              const std::vector<std::vector<core::Rgb>>& images) {
  Truth others = truth_of(films.front());
  std::vector<core::Rgb> sum(others.mu.size());
  for (const core::FilmSnapshot& film : films) {
    const std::vector<core::Rgb> image = image_of(film);
    for (std::size_t p = 0; p < sum.size(); ++p) {
      sum[p] += image[p];
    }
  }
  std::vector<double> out;
  for (std::size_t i = 0; i < films.size(); ++i) {
    const std::vector<core::Rgb> own = image_of(films[i]);
    for (std::size_t p = 0; p < sum.size(); ++p) {
      others.mu[p] = (sum[p] - own[p]) * (1 / static_cast<float>(films.size() - 1));
    }
    out.push_back(defined_error(images[i], others));
  }
  return out;
}

void share_half(core::FilmSnapshot& film, float share) {
  const auto replicates = static_cast<std::size_t>(film.replicates);
  for (std::size_t i = 0; i < film.pixels.size(); i += replicates) {
    for (std::size_t k = 1; k < replicates; k += 2) {
      const core::ReplicatePixel& a = film.pixels[i + k - 1];
      core::ReplicatePixel& b = film.pixels[i + k];
      b.mean_r += share * (a.mean_r - b.mean_r);
      b.mean_g += share * (a.mean_g - b.mean_g);
      b.mean_b += share * (a.mean_b - b.mean_b);
    }
  }
}

}  // namespace test_support
