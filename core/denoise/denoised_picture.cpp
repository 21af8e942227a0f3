#include "core/denoise/denoised_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/base/check.h"
#include "core/denoise/energy_sums.h"
#include "core/error/pixel_error.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

/// Mixing weights are pooled over this many pixels on each side, excluding the nearest kWeightGap:
/// three tiles of 32 without the middle one.
constexpr int kWeightWindow = 48;
constexpr int kWeightGap = 16;

struct Halves {
  ColorPlanes a;
  ColorPlanes b;
};

/// Returns the terms of pixel i of the image with the fraction w of the plain one, without
/// variances. distance: squared distance from the plain image.
PixelEnergy terms_of(const Halves& plain, const Halves& filtered, std::size_t i, float w,
                     double* distance = nullptr) {
  PixelEnergy out;
  double squares = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto a = static_cast<double>(plain.a[c][i]);
    const auto b = static_cast<double>(plain.b[c][i]);
    const auto share = static_cast<double>(w);
    const double xa = std::lerp(static_cast<double>(filtered.a[c][i]), a, share);
    const double xb = std::lerp(static_cast<double>(filtered.b[c][i]), b, share);
    out.energy += 0.5 * ((xa - b) * (xa - b) + (xb - a) * (xb - a) - (a - b) * (a - b)) -
                  0.25 * (xa - xb) * (xa - xb);
    out.noise += 0.25 * (a - b) * (a - b);
    out.together += 0.25 * (xa - xb) * (a - b);
    out.apart_a += (a - xa) * (a - xa);
    out.apart_b += (b - xb) * (b - xb);
    squares += 0.25 * (xa + xb - a - b) * (xa + xb - a - b);
  }
  if (distance != nullptr) {
    *distance = squares;
  }
  return out;
}

/// Calls body(i, x, y) for each pixel.
template <typename Body>
void for_pixels(const PixelRect& rect, const Body& body) {
  std::size_t i = 0;
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x, ++i) {
      body(i, x, y);
    }
  }
}

/// Returns the pooled sum of A B over the channels plus the floor of a pixel, which errors are
/// divided by. The window is the gap of the weights, so that a pixel does not affect its own
/// weight.
std::vector<double> scales_of(const PixelRect& rect, const Halves& plain, double floor) {
  SummedArea signal(rect.width, rect.height);
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    double product = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      product += static_cast<double>(plain.a[c][i]) * static_cast<double>(plain.b[c][i]);
    }
    signal.set(x, y, product);
  });
  std::vector<double> out(plain.a[0].size());
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kWeightGap, rect.width, rect.height);
    const double mean = signal.sum(window) / (window.width * window.height);
    out[i] = std::max(mean, 0.0) + std::max(floor, 1e-30);
  });
  return out;
}

Plane mixing_weights(const PixelRect& rect, const Halves& plain, const Halves& filtered,
                     double floor) {
  const std::vector<double> scales = scales_of(rect, plain, floor);
  SummedArea gain(rect.width, rect.height);  // m - v
  SummedArea distance(rect.width, rect.height);
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    double apart = 0;
    const PixelEnergy t = terms_of(plain, filtered, i, 0, &apart);
    gain.set(x, y, (t.energy - t.noise) / scales[i]);
    distance.set(x, y, apart / scales[i]);
  });
  Plane out(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kWeightWindow, rect.width, rect.height);
    const PixelRect gap = window_around(x, y, kWeightGap, rect.width, rect.height);
    const double apart = distance.sum(window) - distance.sum(gap);
    // Without pixels to judge by, keep the plain image.
    const bool is_known = window.width * window.height > gap.width * gap.height;
    const double best = apart > 0 ? 0.5 + (gain.sum(window) - gain.sum(gap)) / (2 * apart) : 0.0;
    out[i] = is_known ? static_cast<float>(std::clamp(best, 0.0, 1.0)) : 1.0F;
  });
  return out;
}

/// Sums of one image by tile, and its error by pixel.
struct Errors {
  std::vector<TileEnergy> tiles;
  Plane plane;
};

Errors errors_of(const FilmSnapshot& film, std::span<const HalfPicture> halves, const Halves& plain,
                 const Halves& filtered, const Plane* weights) {
  const PixelRect& rect = film.rect;
  SummedArea energy(rect.width, rect.height);
  SummedArea signal(rect.width, rect.height);
  std::vector<PixelEnergy> terms(film.pixel_count());
  Light light;
  light.add(film);
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    terms[i] = terms_of(plain, filtered, i, weights != nullptr ? (*weights)[i] : 0);
    terms[i].variance_a = static_cast<double>(halves[0].variance[i]);
    terms[i].variance_b = static_cast<double>(halves[1].variance[i]);
    energy.set(x, y, terms[i].energy);
    double product = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      product += static_cast<double>(plain.a[c][i]) * static_cast<double>(plain.b[c][i]);
    }
    signal.set(x, y, product);
  });
  Errors out;
  out.plane.resize(film.pixel_count());
  const double floor = 3 * error_floor(light.mean());
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kDenoisedWindow, rect.width, rect.height);
    const double scale = std::max(signal.sum(window), 0.0) + floor * window.width * window.height;
    const double sum = std::max(energy.sum(window), 0.0);
    out.plane[i] = sum > 0 && scale > 0 ? static_cast<float>(std::sqrt(sum / scale)) : 0;
  });
  for (const PixelRect& tile : tile_rects(rect)) {
    EnergySums sums;
    for (int y = tile.y - rect.y; y < tile.y - rect.y + tile.height; ++y) {
      for (int x = tile.x - rect.x; x < tile.x - rect.x + tile.width; ++x) {
        sums.add(terms[static_cast<std::size_t>(y) * static_cast<std::size_t>(rect.width) +
                       static_cast<std::size_t>(x)]);
      }
    }
    out.tiles.push_back(sums.result());
  }
  return out;
}

/// Fills F - I, pooled around each pixel, and its standard error, estimated from the halves: half
/// of the difference between FA - A and FB - B, whose square is pooled once more.
void fill_bias(const Halves& plain, const Halves& filtered, DenoisedPicture& out) {
  const PixelRect& rect = out.rect;
  for (std::size_t c = 0; c < 3; ++c) {
    SummedArea mean(rect.width, rect.height);
    SummedArea apart(rect.width, rect.height);
    for_pixels(rect, [&](std::size_t i, int x, int y) {
      const double a = static_cast<double>(filtered.a[c][i]) - static_cast<double>(plain.a[c][i]);
      const double b = static_cast<double>(filtered.b[c][i]) - static_cast<double>(plain.b[c][i]);
      mean.set(x, y, 0.5 * (a + b));
      apart.set(x, y, 0.5 * (a - b));
    });
    SummedArea squares(rect.width, rect.height);
    out.bias[c].resize(plain.a[c].size());
    out.bias_error[c].resize(plain.a[c].size());
    for_pixels(rect, [&](std::size_t i, int x, int y) {
      const PixelRect window = window_around(x, y, kBiasWindow, rect.width, rect.height);
      const double area = window.width * window.height;
      out.bias[c][i] = static_cast<float>(mean.sum(window) / area);
      const double d = apart.sum(window) / area;
      squares.set(x, y, d * d);
    });
    for_pixels(rect, [&](std::size_t i, int x, int y) {
      const PixelRect window = window_around(x, y, kDenoisedWindow, rect.width, rect.height);
      const double sum = std::max(squares.sum(window), 0.0);
      out.bias_error[c][i] = static_cast<float>(std::sqrt(sum / (window.width * window.height)));
    });
  }
}

std::vector<TileSums> plain_sums(const FilmSnapshot& film) {
  std::vector<TileSums> out;
  const auto r = static_cast<std::size_t>(film.replicates);
  for (const PixelRect& tile : tile_rects(film.rect)) {
    std::vector<ReplicatePixel> pixels;
    for (int y = tile.y - film.rect.y; y < tile.y - film.rect.y + tile.height; ++y) {
      const auto first = (static_cast<std::size_t>(y) * static_cast<std::size_t>(film.rect.width) +
                          static_cast<std::size_t>(tile.x - film.rect.x)) *
                         r;
      const auto begin = film.pixels.begin() + static_cast<std::ptrdiff_t>(first);
      pixels.insert(pixels.end(), begin,
                    begin + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(tile.width) * r));
    }
    out.push_back(half_sums(tile, pixels, film.replicates, film.errors_over_white));
  }
  return out;
}

/// Returns the features without colour, to denoise coverage, which has none.
FeaturePicture colorless(const FeaturePicture& features) {
  FeaturePicture out = features;
  for (Plane& plane : out.albedo) {
    std::fill(plane.begin(), plane.end(), 1.0F);
  }
  for (Plane& plane : out.emission) {
    std::fill(plane.begin(), plane.end(), 0.0F);
  }
  std::fill(out.albedo_variance.begin(), out.albedo_variance.end(), 0.0F);
  std::fill(out.emission_variance.begin(), out.emission_variance.end(), 0.0F);
  return out;
}

/// Keeps the original values where a filter's neighbourhood is entirely empty or entirely covered,
/// so that rounding of the denoiser does not show in composites.
void keep_even_places(const FilmSnapshot& film, std::span<const HalfPicture> light,
                      std::span<const HalfPicture> alpha, std::span<ColorPlanes> light_out,
                      std::span<ColorPlanes> alpha_out) {
  SummedArea covered(film.rect.width, film.rect.height);
  SummedArea open(film.rect.width, film.rect.height);
  SummedArea lit(film.rect.width, film.rect.height);
  for_pixels(film.rect, [&](std::size_t i, int x, int y) {
    const float both = alpha[0].mean[0][i] + alpha[1].mean[0][i];
    bool is_lit = false;
    for (std::size_t c = 0; c < 3; ++c) {
      is_lit = is_lit || light[0].mean[c][i] != 0 || light[1].mean[c][i] != 0;
    }
    covered.set(x, y, both > 0 ? 1 : 0);
    open.set(x, y, both < 2 ? 1 : 0);
    lit.set(x, y, is_lit ? 1 : 0);
  });
  for_pixels(film.rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kWeightGap, film.rect.width, film.rect.height);
    const bool is_empty = covered.sum(window) == 0;
    const bool is_full = open.sum(window) == 0;
    const bool is_black = lit.sum(window) == 0;
    for (std::size_t h = 0; h < 2; ++h) {
      for (std::size_t c = 0; c < 3; ++c) {
        alpha_out[h][c][i] = is_empty || is_full ? alpha[h].mean[c][i] : alpha_out[h][c][i];
        light_out[h][c][i] = is_empty && is_black ? 0 : light_out[h][c][i];
      }
    }
  });
}

Result<MadeDenoised> denoise_over_white(const FilmSnapshot& film, const FeaturePicture* features,
                                        const Denoiser& denoiser, const ParallelFor& parallel,
                                        std::span<const HalfPicture> light,
                                        FilteredHalves light_out) {
  const std::array alpha = {half_picture(film, 0, HalfPart::kAlpha),
                            half_picture(film, 1, HalfPart::kAlpha)};
  const auto surfaces =
      features != nullptr ? std::make_unique<FeaturePicture>(colorless(*features)) : nullptr;
  auto alpha_out = denoiser.denoise(alpha, surfaces.get(), parallel);
  if (!alpha_out) {
    return alpha_out.error();
  }
  keep_even_places(film, light, alpha, light_out.planes, alpha_out->planes);
  const std::array halves = {half_picture(film, 0, HalfPart::kOverWhite),
                             half_picture(film, 1, HalfPart::kOverWhite)};
  for (std::size_t h = 0; h < 2; ++h) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        light_out.planes[h][c][i] += 1 - alpha_out->planes[h][c][i];
      }
    }
  }
  MadeDenoised made = {
      denoised_picture(film, halves, light_out.planes), std::move(light_out.by), {}};
  DenoisedPicture& out = made.picture;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const float full = 0.5F * (alpha_out->planes[0][0][i] + alpha_out->planes[1][0][i]);
    const float plain = 0.5F * (alpha[0].mean[0][i] + alpha[1].mean[0][i]);
    out.full_alpha.push_back(full);
    out.mixed_alpha.push_back(full + out.weight[i] * (plain - full));
    for (std::size_t c = 0; c < 3; ++c) {
      out.full[c][i] -= 1 - out.full_alpha[i];
      out.mixed[c][i] -= 1 - out.mixed_alpha[i];
    }
  }
  return made;
}

}  // namespace

int samples_of_halves(const FilmSnapshot& film) {
  auto least = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    for (const int half : {0, 1}) {
      least = std::min(least, static_cast<int>(half_value(film, i, half).count));
    }
  }
  return least;
}

ErrorInterval DenoisedPicture::interval(DenoiseMode mode, double confidence) const {
  ErrorInterval out = denoised_error(plain_tiles, tiles(mode), confidence);
  if (!has_intervals) {
    out.low = out.high = std::numeric_limits<double>::quiet_NaN();
    if (!(out.relative_rmse > 0)) {  // too small to measure, and no interval shows that
      out.relative_rmse = out.low;
    }
  }
  return out;
}

double DenoisedPicture::bound(DenoiseMode mode, double alpha) const {
  return has_intervals ? denoised_bound(plain_tiles, tiles(mode), alpha)
                       : std::numeric_limits<double>::infinity();
}

std::size_t DenoisedPicture::bytes() const noexcept {
  constexpr std::size_t kPlanes = 17;
  return full[0].size() * kPlanes * sizeof(float) +
         plain_tiles.size() * (sizeof(TileSums) + 2 * sizeof(TileEnergy));
}

DenoisedPicture denoised_picture(const FilmSnapshot& film, std::span<const HalfPicture> halves,
                                 std::span<const ColorPlanes> filtered) {
  CHECK(halves.size() == 2 && filtered.size() == 2);
  DenoisedPicture out;
  out.rect = film.rect;
  out.revision = film.revision;
  out.has_intervals = !film.has_splats && film.errors == PixelErrors::kIndependent;
  const Halves plain = {halves[0].mean, halves[1].mean};
  const Halves clean = {filtered[0], filtered[1]};
  Light light;
  light.add(film);
  out.weight = mixing_weights(film.rect, plain, clean, 3 * error_floor(light.mean()));
  for (std::size_t c = 0; c < 3; ++c) {
    out.full[c].resize(film.pixel_count());
    out.mixed[c].resize(film.pixel_count());
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      const float f = 0.5F * (clean.a[c][i] + clean.b[c][i]);
      const float mean = 0.5F * (plain.a[c][i] + plain.b[c][i]);
      out.full[c][i] = f;
      out.mixed[c][i] = f + out.weight[i] * (mean - f);
    }
  }
  out.plain_tiles = plain_sums(film);
  Errors full = errors_of(film, halves, plain, clean, nullptr);
  out.full_tiles = std::move(full.tiles);
  out.full_error = std::move(full.plane);
  Errors mixed = errors_of(film, halves, plain, clean, &out.weight);
  out.mixed_tiles = std::move(mixed.tiles);
  out.mixed_error = std::move(mixed.plane);
  fill_bias(plain, clean, out);
  return out;
}

Result<MadeDenoised> denoise(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel) {
  const std::array halves = {half_picture(film, 0), half_picture(film, 1)};
  auto filtered = denoiser.denoise(halves, features, parallel);
  if (!filtered) {
    return filtered.error();
  }
  if (film.errors_over_white) {
    return denoise_over_white(film, features, denoiser, parallel, halves, *std::move(filtered));
  }
  return MadeDenoised{
      denoised_picture(film, halves, filtered->planes), std::move(filtered->by), {}};
}

std::uint64_t denoising_bytes(std::uint64_t pixels) {
  // Planes of the halves and their denoised versions, summed-area tables, terms and the result.
  constexpr std::uint64_t kPlaneBytes = 80 * sizeof(float);
  constexpr std::uint64_t kSumBytes = 10 * sizeof(double);
  return pixels * (kPlaneBytes + kSumBytes);
}

}  // namespace core
