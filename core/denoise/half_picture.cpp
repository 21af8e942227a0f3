#include <algorithm>
#include <vector>

#include "core/base/statistics.h"
#include "core/denoise/denoiser.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

/// Pixels on each side over which sample variances are pooled.
constexpr int kSpreadWindow = 2;
/// The neighbours' pooled variance counts as this many samples of the pixel: few samples determine
/// their variance poorly, many well. A variance with eight degrees of freedom has a relative error
/// of sqrt(2 / 8), one half, about that of the neighbours as a prior. Source: Gelman et al.,
/// Bayesian Data Analysis, 2.6 (scaled inverse chi^2).
constexpr double kPrior = 8;
/// Side of the blocks in which the noise between neighbouring pixels is measured.
constexpr int kBlock = 8;
/// Noise is measured in the smoothest quarter of the blocks.
constexpr double kSmoothShare = 0.25;

std::size_t at(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

/// Variance of one sample of a pixel, from the replicates of one half.
struct Spread {
  double squares = 0;
  double degrees = 0;
};
Spread spread_of(const FilmSnapshot& film, std::size_t pixel, int half) {
  const auto r = static_cast<std::size_t>(film.replicates);
  Spread out;
  for (auto k = static_cast<std::size_t>(half); k < r; k += 2) {
    const ReplicatePixel& p = film.pixels[pixel * r + k];
    if (p.count > 1) {
      out.squares += std::max(static_cast<double>(p.m2_luminance), 0.0);
      out.degrees += static_cast<double>(p.count) - 1;
    }
  }
  return out;
}

/// Returns the squared response of a mask that ignores planes (smooth light), divided by its
/// expected value for noise of variance 1. Source: Immerkaer 1996.
double rough_noise(const std::vector<double>& y, int width, int px, int py) {
  double sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const double weight = (dx == 0 ? -2 : 1) * (dy == 0 ? -2 : 1);
      sum += weight * y[at(width, px + dx, py + dy)];
    }
  }
  return sum * sum / 36;
}

/// Returns the noise between neighbours divided by the noise expected from the sample variance:
/// below 1 for stratified samples. Blocks without sample variance, and those that are not entirely
/// `inside`, are left out.
double noise_scale(const std::vector<double>& y, const std::vector<double>& variance, int width,
                   int height, const std::vector<bool>& inside) {
  std::vector<double> ratios;
  for (int by = 1; by + kBlock < height; by += kBlock) {
    for (int bx = 1; bx + kBlock < width; bx += kBlock) {
      double noise = 0;
      double expected = 0;
      bool is_inside = true;
      for (int py = by; py < by + kBlock; ++py) {
        for (int px = bx; px < bx + kBlock; ++px) {
          is_inside = is_inside && inside[at(width, px, py)];
          noise += rough_noise(y, width, px, py);
          expected += variance[at(width, px, py)];
        }
      }
      if (is_inside && expected > 0 && noise > 0) {
        ratios.push_back(noise / expected);
      }
    }
  }
  if (ratios.empty()) {
    return 1;
  }
  const auto nth = ratios.begin() +
                   static_cast<std::ptrdiff_t>(kSmoothShare * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), nth, ratios.end());
  // Divide by this quantile for a block of pure noise: the mask's values have 1 / 3.78 of the
  // degrees of freedom of independent ones (sum of the squares of its autocorrelation).
  const double degrees = kBlock * kBlock / 3.78;
  return *nth * degrees / chi2_quantile(kSmoothShare, degrees);
}

/// Scales the variances of surfaces to their noise between neighbours. Samples of a backdrop differ
/// by its texture alone, so it says nothing of that noise.
void scale_to_noise(const std::vector<double>& y, std::vector<double>& variance, int width,
                    int height, const FeaturePicture* features) {
  std::vector<bool> inside(y.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    inside[i] = features == nullptr || !features->is_backdrop(i);
  }
  const double scale = noise_scale(y, variance, width, height, inside);
  for (std::size_t i = 0; i < y.size(); ++i) {
    variance[i] *= inside[i] ? scale : 1;
  }
}

/// Adds the variance of splats: sample variances cover only camera paths. Splats are counts, whose
/// variance is proportional to the light.
void add_splat_noise(const std::vector<double>& y, std::vector<double>& variance, int width,
                     int height) {
  SummedArea sums(width, height);
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      sums.set(px, py, y[at(width, px, py)]);
    }
  }
  std::vector<double> light(y.size());
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      const PixelRect window = window_around(px, py, kSpreadWindow, width, height);
      light[at(width, px, py)] = std::max(sums.sum(window), 0.0) / (window.width * window.height);
    }
  }
  const double scale = noise_scale(y, light, width, height, std::vector<bool>(y.size(), true));
  for (std::size_t i = 0; i < variance.size(); ++i) {
    variance[i] = std::max(variance[i], scale * light[i]);
  }
}

/// Returns the variance of the mean luminance from differences between neighbours, for halves
/// without two samples in any pixel.
std::vector<double> variance_of_neighbours(const std::vector<double>& y, int width, int height) {
  SummedArea sums(width, height);
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      const bool is_inside = px > 0 && py > 0 && px < width - 1 && py < height - 1;
      sums.set(px, py, is_inside ? rough_noise(y, width, px, py) : 0);
    }
  }
  std::vector<double> out(y.size());
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      const PixelRect window = window_around(px, py, kBlock, width, height);
      out[at(width, px, py)] = std::max(sums.sum(window), 0.0) / (window.width * window.height);
    }
  }
  return out;
}

Rgb shown(const HalfValue& value, HalfPart part) {
  switch (part) {
    case HalfPart::kLight:
      break;
    case HalfPart::kAlpha:
      return Rgb(value.alpha);
    case HalfPart::kOverWhite:
      return value.mean + Rgb(1 - value.alpha);
  }
  return value.mean;
}

}  // namespace

HalfPicture half_picture(const FilmSnapshot& film, int half, HalfPart part,
                         std::span<const float> factors, const FeaturePicture* features) {
  HalfPicture out;
  const int width = out.width = film.rect.width;
  const int height = out.height = film.rect.height;
  for (Plane& plane : out.mean) {
    plane.resize(film.pixel_count());
  }
  std::vector<double> y(film.pixel_count());
  std::vector<double> counts(film.pixel_count());
  std::array<SummedArea, 3> color = {SummedArea(width, height), SummedArea(width, height),
                                     SummedArea(width, height)};
  SummedArea squares(width, height);
  SummedArea degrees(width, height);
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      const std::size_t i = at(width, px, py);
      HalfValue value = half_value(film, i, half);
      value.mean *= factors.empty() ? 1.0F : factors[i];
      const Rgb mean = shown(value, part);
      for (int c = 0; c < 3; ++c) {
        out.mean[static_cast<std::size_t>(c)][i] = mean[c];
        color[static_cast<std::size_t>(c)].set(px, py, static_cast<double>(mean[c]));
      }
      y[i] = static_cast<double>(luminance(mean));
      counts[i] = value.count;
      const Spread spread = spread_of(film, i, half);
      squares.set(px, py, spread.squares);
      degrees.set(px, py, spread.degrees);
    }
  }
  const PixelRect whole = {0, 0, width, height};
  std::vector<double> variance(film.pixel_count());
  if (degrees.sum(whole) > 0 && part == HalfPart::kLight) {  // the film has its sample variance
    const double everywhere = squares.sum(whole) / degrees.sum(whole);
    for (int py = 0; py < height; ++py) {
      for (int px = 0; px < width; ++px) {
        const std::size_t i = at(width, px, py);
        const PixelRect window = window_around(px, py, kSpreadWindow, width, height);
        const double known = degrees.sum(window);
        const double pooled = known > 0 ? std::max(squares.sum(window), 0.0) / known : everywhere;
        const Spread own = spread_of(film, i, half);
        variance[i] = (own.squares + kPrior * pooled) / (own.degrees + kPrior) / counts[i];
      }
    }
    if (film.has_splats) {
      add_splat_noise(y, variance, width, height);
    } else {
      scale_to_noise(y, variance, width, height, features);
    }
  } else {
    variance = variance_of_neighbours(y, width, height);
  }
  // Variances are those of the luminance; noise has the colour of the light nearby.
  out.variance.resize(film.pixel_count());
  for (int py = 0; py < height; ++py) {
    for (int px = 0; px < width; ++px) {
      const PixelRect window = window_around(px, py, kSpreadWindow, width, height);
      const double r = color[0].sum(window);
      const double g = color[1].sum(window);
      const double b = color[2].sum(window);
      const Rgb sum = {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)};
      const auto light = static_cast<double>(luminance(sum));
      const double share = light > 0 ? (r * r + g * g + b * b) / (light * light) : 3.0;
      const std::size_t i = at(width, px, py);
      out.variance[i] = static_cast<float>(variance[i] * share);
    }
  }
  return out;
}

FeaturePicture FeaturePicture::blank(int width, int height) {
  FeaturePicture out;
  out.width = width;
  out.height = height;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (ColorPlanes* planes : {&out.albedo, &out.normal, &out.emission}) {
    planes->fill(Plane(count));
  }
  for (Plane* plane : {&out.depth_m, &out.albedo_variance, &out.normal_variance,
                       &out.depth_variance, &out.emission_variance}) {
    plane->resize(count);
  }
  return out;
}

}  // namespace core
