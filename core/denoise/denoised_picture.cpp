#include "core/denoise/denoised_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "core/base/check.h"
#include "core/base/statistics.h"
#include "core/denoise/series_mean.h"
#include "core/error/pixel_error.h"
#include "core/error/squared_error.h"
#include "core/film/set_aside.h"
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

/// Returns the colour planes of the halves as errors are measured.
Halves raw_halves(const FilmSnapshot& film) {
  Halves out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.a[c].resize(film.pixel_count());
    out.b[c].resize(film.pixel_count());
  }
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const auto [a, b] = error_halves(film, i);
    for (std::size_t c = 0; c < 3; ++c) {
      out.a[c][i] = a.mean[static_cast<int>(c)];
      out.b[c][i] = b.mean[static_cast<int>(c)];
    }
  }
  return out;
}

ColorSum color_at(const ColorPlanes& planes, std::size_t i) {
  return {static_cast<double>(planes[0][i]), static_cast<double>(planes[1][i]),
          static_cast<double>(planes[2][i])};
}
ColorSum mix(const ColorSum& from, const ColorSum& to, double share) {
  return {std::lerp(from[0], to[0], share), std::lerp(from[1], to[1], share),
          std::lerp(from[2], to[2], share)};
}

/// What is measured against what: raw halves A and B, denoised ones FA and FB, and the halves that
/// the fraction of the plain image is taken from.
struct Compared {
  const Halves& raw;
  const Halves& filtered;
  const Halves& shown;
  double floor = 0;
};

/// Colours of one pixel.
struct Pixel {
  ColorSum a;
  ColorSum b;
  ColorSum filtered_a;
  ColorSum filtered_b;
  ColorSum shown_a;
  ColorSum shown_b;
};
Pixel pixel_at(const Compared& of, std::size_t i) {
  return {color_at(of.raw.a, i),      color_at(of.raw.b, i),   color_at(of.filtered.a, i),
          color_at(of.filtered.b, i), color_at(of.shown.a, i), color_at(of.shown.b, i)};
}

/// Returns s: the light of F and the floor.
ColorSum scale_of(const Pixel& p, double floor) {
  ColorSum out = mix(p.filtered_a, p.filtered_b, 0.5);
  for (double& channel : out) {
    channel = std::abs(channel) + floor;
  }
  return out;
}

/// m of the image with the fraction w of the plain one, and d^2 (core/error/squared_error.h) of its
/// two parts: its difference from the plain image as it is shown, since fireflies that are set
/// aside tell nothing of it; and its noise, half the difference of its halves, which is all of the
/// error where nothing was denoised.
struct Measured {
  double m = 0;
  std::array<double, 2> squares{};
};
Measured measure(const Pixel& p, double floor, double w) {
  const ColorSum xa = mix(p.filtered_a, p.shown_a, w);
  const ColorSum xb = mix(p.filtered_b, p.shown_b, w);
  const ColorSum x = mix(xa, xb, 0.5);
  const ColorSum scale = scale_of(p, floor);
  const double noise = relative_square(xa, x, scale);
  return {relative_product(xa, p.a, xb, p.b, scale) + noise,
          {relative_square(x, mix(p.shown_a, p.shown_b, 0.5), scale), noise}};
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

/// Minimises squares around each pixel.
Plane mixing_weights(const PixelRect& rect, const Compared& of) {
  SummedArea gain(rect.width, rect.height);  // (F - mu)(F - I)
  SummedArea distance(rect.width, rect.height);
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const Pixel p = pixel_at(of, i);
    const ColorSum plain = mix(p.shown_a, p.shown_b, 0.5);
    const ColorSum clean = mix(p.filtered_a, p.filtered_b, 0.5);
    const ColorSum scale = scale_of(p, of.floor);
    const auto product = [&](const ColorSum& fx, const ColorSum& u, const ColorSum& fy,
                             const ColorSum& v) { return relative_product(fx, u, fy, v, scale); };
    gain.set(x, y,
             0.25 * (product(p.filtered_a, p.b, p.filtered_a, p.shown_a) +
                     product(p.filtered_b, p.a, p.filtered_b, p.shown_b) +
                     2 * product(p.filtered_a, p.shown_a, p.filtered_b, p.shown_b)));
    distance.set(x, y, relative_square(plain, clean, scale));
  });
  Plane out(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kWeightWindow, rect.width, rect.height);
    const PixelRect gap = window_around(x, y, kWeightGap, rect.width, rect.height);
    const double apart = distance.sum(window) - distance.sum(gap);
    // Without pixels to judge by, keep the plain image.
    const bool is_known = window.width * window.height > gap.width * gap.height;
    const double best = apart > 0 ? (gain.sum(window) - gain.sum(gap)) / apart : 0.0;
    out[i] = is_known ? static_cast<float>(std::clamp(best, 0.0, 1.0)) : 1.0F;
  });
  return out;
}

/// Roots of one image by tile (error_of_roots()), and its error by pixel.
struct Errors {
  ErrorRoots roots;
  Plane plane;
};

Errors errors_of(const FilmSnapshot& film, const Compared& of, const Plane* weights) {
  const PixelRect& rect = film.rect;
  SquaredErrors squares(rect);
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const auto [a, b] = error_halves(film, i);
    const double w = weights != nullptr ? static_cast<double>((*weights)[i]) : 0;
    const Measured seen = measure(pixel_at(of, i), of.floor, w);
    squares.set(x, y, seen.m, seen.squares, !is_empty(a, b));
  });
  Errors out = {squares.roots(), Plane(film.pixel_count())};
  for_pixels(rect, [&](std::size_t i, int x, int y) {
    const PixelRect window = window_around(x, y, kDenoisedWindow, rect.width, rect.height);
    out.plane[i] = static_cast<float>(squares.error(window));
  });
  return out;
}

/// Fills the weights and the errors of the images. By the error of the whole image, the mixed image
/// is the denoised one if that is better, and the plain one unless that is worse with a confidence
/// of 95%: weights that are best by squares, and for other pixels, may be worse by the error. The
/// plain image is the safe choice, so the smaller one of its two estimates counts. Choosing by
/// errors of the whole image tells almost nothing about a pixel's own noise. Pre: out.plain_tiles.
void judge(const FilmSnapshot& film, const Compared& of, DenoisedPicture& out) {
  constexpr double kConfidence = 0.95;
  const auto size = [&](const Errors& errors) {
    return error_of_roots(out.plain_tiles, errors.roots, film.errors, kConfidence).relative;
  };
  Errors full = errors_of(film, of, nullptr);
  out.weight = mixing_weights(film.rect, of);
  Errors mixed = errors_of(film, of, &out.weight);
  if (size(full) < size(mixed)) {
    out.weight.assign(film.pixel_count(), 0);
    mixed = full;
  }
  Plane ones(film.pixel_count(), 1.0F);
  Errors plain = errors_of(film, of, &ones);
  const double by_halves = ErrorEstimate(out.plain_tiles, film.errors).image(kConfidence).relative;
  const double gain = std::min(size(plain), by_halves) - size(mixed);
  if (!(gain > reach_of_gain(plain.roots, mixed.roots, out.plain_tiles, kConfidence))) {
    out.weight = std::move(ones);
    out.is_plain = true;
    mixed = std::move(plain);
  }
  out.mixed_roots = std::move(mixed.roots);
  out.mixed_error = std::move(mixed.plane);
  out.full_roots = std::move(full.roots);
  out.full_error = std::move(full.plane);
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

/// Gives the backdrop the mean of its two estimates, the half's and the features', without its
/// neighbours, whose light differs by texture alone. Weights go with the square of the number of
/// samples, as the variance of stratified ones falls about so. They do not depend on the samples'
/// values: where thin parts hide from the features, the half must not count less for seeing them.
/// Source: Mitchell, Consequences of stratified sampling in graphics, 1996.
void average_backdrop(const FilmSnapshot& film, const FeaturePicture& features,
                      std::span<const HalfPicture> halves, std::span<ColorPlanes> filtered) {
  const float other = static_cast<float>(features.samples) * static_cast<float>(features.samples);
  for (std::size_t h = 0; h < halves.size(); ++h) {
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      if (!features.is_backdrop(i)) {
        continue;
      }
      const auto count = static_cast<float>(half_value(film, i, static_cast<int>(h)).count);
      const float share = count * count / (count * count + other);
      for (std::size_t c = 0; c < 3; ++c) {
        filtered[h][c][i] = std::lerp(features.emission[c][i], halves[h].mean[c][i], share);
      }
    }
  }
}

MadeDenoised composed_over_white(const FilmSnapshot& film, CleanFilm clean) {
  std::vector<ColorPlanes>& light_out = clean.light.clean;
  std::vector<ColorPlanes>& alpha_out = clean.alpha.clean;
  const std::vector<HalfPicture>& alpha = clean.alpha.plain;
  keep_even_places(film, clean.light.plain, alpha, light_out, alpha_out);
  const std::array halves = {half_picture(film, 0, HalfPart::kOverWhite, clean.calm[0]),
                             half_picture(film, 1, HalfPart::kOverWhite, clean.calm[1])};
  for (std::size_t h = 0; h < 2; ++h) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        light_out[h][c][i] += 1 - alpha_out[h][c][i];
      }
    }
  }
  MadeDenoised made = {denoised_picture(film, halves, light_out), std::move(clean.by), {}};
  DenoisedPicture& out = made.picture;
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const float full = 0.5F * (alpha_out[0][0][i] + alpha_out[1][0][i]);
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

double reach_of_gain(const ErrorRoots& from, const ErrorRoots& to, std::span<const TileSums> tiles,
                     double confidence) {
  double n = 0;
  double pixels = 0;
  double sum = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    n += tiles[t].pixels > 0 ? 1 : 0;
    pixels += tiles[t].pixels;
    sum += from.tiles[t] - to.tiles[t];
  }
  if (n < 2) {
    return std::numeric_limits<double>::infinity();
  }
  double squares = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const double apart = from.tiles[t] - to.tiles[t] - tiles[t].pixels * sum / pixels;
    squares += apart * apart;
  }
  return student_t_quantile(0.5 + 0.5 * confidence, n - 1) * std::sqrt(squares * n / (n - 1)) /
         pixels;
}

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
  if (mode == DenoiseMode::kMixed && is_plain) {
    return ErrorEstimate(plain_tiles, errors).image(confidence);
  }
  return error_of_roots(plain_tiles, roots(mode), errors, confidence);
}

double DenoisedPicture::tile_error(DenoiseMode mode, std::size_t tile) const {
  const std::span<const TileSums> plain(&plain_tiles[tile], 1);
  if (mode == DenoiseMode::kMixed && is_plain) {
    return ErrorEstimate(plain, errors).image(0.95).relative;
  }
  return error_of_roots(plain, {{roots(mode).tiles[tile]}, 0}, errors, 0.95).relative;
}

std::size_t DenoisedPicture::bytes() const noexcept {
  constexpr std::size_t kPlanes = 20;
  return full[0].size() * kPlanes * sizeof(float) +
         plain_tiles.size() * (sizeof(TileSums) + 2 * sizeof(double));
}

std::size_t CleanFilm::bytes() const noexcept {
  std::size_t floats = calm[0].size() + calm[1].size();
  for (const CleanHalves* halves : {&light, &alpha}) {
    for (const HalfPicture& half : halves->plain) {
      floats += 3 * half.mean[0].size() + half.variance.size();
    }
    for (const ColorPlanes& half : halves->clean) {
      floats += 3 * half[0].size();
    }
  }
  return floats * sizeof(float);
}

DenoisedPicture denoised_picture(const FilmSnapshot& film, std::span<const HalfPicture> halves,
                                 std::span<const ColorPlanes> filtered) {
  CHECK(halves.size() == 2 && filtered.size() == 2);
  DenoisedPicture out;
  out.rect = film.rect;
  out.revision = film.revision;
  out.errors = film.errors;
  const Halves raw = raw_halves(film);
  const Halves shown = {halves[0].mean, halves[1].mean};
  const Halves clean = {filtered[0], filtered[1]};
  const Compared of = {raw, clean, shown, floor_of(film)};
  out.plain_tiles = half_sums(film);
  judge(film, of, out);
  for (std::size_t c = 0; c < 3; ++c) {
    out.full[c].resize(film.pixel_count());
    out.mixed[c].resize(film.pixel_count());
    out.apart[c].resize(film.pixel_count());
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      const float f = 0.5F * (clean.a[c][i] + clean.b[c][i]);
      const float mean = 0.5F * (shown.a[c][i] + shown.b[c][i]);
      out.full[c][i] = f;
      out.mixed[c][i] = f + out.weight[i] * (mean - f);
      out.apart[c][i] = 0.5F * (clean.a[c][i] - clean.b[c][i]);
    }
  }
  fill_bias(raw, clean, out);
  return out;
}

Result<CleanFilm> clean_film(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel) {
  // Fireflies are set aside before a denoiser can spread them.
  CleanFilm out;
  out.calm = calm_factors(film);
  for (const int half : {0, 1}) {
    const std::vector<float>& factors = out.calm[static_cast<std::size_t>(half)];
    out.light.plain.push_back(half_picture(film, half, HalfPart::kLight, factors, features));
  }
  auto light = denoiser.denoise(out.light.plain, features, parallel);
  if (!light) {
    return light.error();
  }
  out.light.clean = std::move(light->planes);
  out.by = std::move(light->by);
  if (film.errors_over_white) {
    for (const int half : {0, 1}) {
      out.alpha.plain.push_back(half_picture(film, half, HalfPart::kAlpha));
    }
    const auto surfaces =
        features != nullptr ? std::make_unique<FeaturePicture>(colorless(*features)) : nullptr;
    auto alpha = denoiser.denoise(out.alpha.plain, surfaces.get(), parallel);
    if (!alpha) {
      return alpha.error();
    }
    out.alpha.clean = std::move(alpha->planes);
  }
  return out;
}

CleanFilm mean_in_series(CleanFilm own, const FeaturePicture* features,
                         std::span<const CleanNeighbour> others) {
  std::vector<SeriesFrame> light;
  for (const CleanNeighbour& other : others) {
    light.push_back({&other.film->light, other.features, other.match});
  }
  std::vector<ColorPlanes> mean = mean_of_frames(own.light, features, light);
  if (!own.alpha.clean.empty()) {
    // Coverage has no colour that its features would divide it by.
    std::vector<FeaturePicture> surfaces;
    surfaces.reserve(others.size());
    std::vector<SeriesFrame> alpha;
    for (const CleanNeighbour& other : others) {
      const bool has_features = other.features != nullptr;
      alpha.push_back({&other.film->alpha,
                       has_features ? &surfaces.emplace_back(colorless(*other.features)) : nullptr,
                       other.match});
    }
    const auto here =
        features != nullptr ? std::make_unique<FeaturePicture>(colorless(*features)) : nullptr;
    own.alpha.clean = mean_of_frames(own.alpha, here.get(), alpha);
  }
  own.light.clean = std::move(mean);
  own.by.frames = static_cast<int>(others.size());
  return own;
}

MadeDenoised denoised(const FilmSnapshot& film, const FeaturePicture* features, CleanFilm clean) {
  if (features != nullptr) {
    average_backdrop(film, *features, clean.light.plain, clean.light.clean);
  }
  const SetAside taken = taken_by(film, clean.calm);
  MadeDenoised made =
      film.errors_over_white
          ? composed_over_white(film, std::move(clean))
          : MadeDenoised{denoised_picture(film, clean.light.plain, clean.light.clean),
                         std::move(clean.by),
                         {}};
  made.picture.set_aside = taken;
  return made;
}

Result<MadeDenoised> denoise(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel) {
  auto clean = clean_film(film, features, denoiser, parallel);
  return clean ? Result<MadeDenoised>(denoised(film, features, *std::move(clean))) : clean.error();
}

std::uint64_t denoising_bytes(std::uint64_t pixels) {
  // Planes of the halves and their denoised versions, summed-area tables, terms and the result.
  constexpr std::uint64_t kPlaneBytes = 80 * sizeof(float);
  constexpr std::uint64_t kSumBytes = 10 * sizeof(double);
  return pixels * (kPlaneBytes + kSumBytes);
}

}  // namespace core
