#include <algorithm>
#include <array>

#include "core/film/film.h"
#include "core/math/numbers.h"

namespace core {

FilmSnapshot Film::snapshot(PixelRect rect) const {
  FilmSnapshot out;
  out.rect = rect;
  const std::size_t pixels = out.pixel_count();
  out.replicates = replicates_;
  out.has_aux = has_aux_;
  out.has_splats = has_splats_;
  out.errors = errors_;
  out.errors_over_white = over_white_;
  const auto r = static_cast<std::size_t>(replicates_);
  out.pixels.resize(pixels * r);
  if (has_aux_) {
    out.aux.resize(pixels);
  }
  const std::size_t k = shares_.size();
  out.shares.resize(out.pixels.size() * k);
  for (const LightShare& share : shares_) {
    out.share_layers.push_back(share.layer);
  }
  const std::size_t kinds = matte_kinds_.count();
  out.has_labels = has_labels_;
  out.matte_kinds = matte_kinds_;
  out.labels.resize(has_labels_ ? pixels : 0);
  out.mattes.resize(pixels * kinds);
  MutexLock lock(mutex_);
  out.revision = revision_;
  for (const Slot& slot : tiles_) {
    const PixelRect& t = slot.state.rect;
    const int x0 = std::max(t.x, rect.x);
    const int x1 = std::min(t.x + t.width, rect.x + rect.width);
    const int y0 = std::max(t.y, rect.y);
    const int y1 = std::min(t.y + t.height, rect.y + rect.height);
    if (x0 >= x1 || slot.state.pixels.empty()) {
      continue;
    }
    for (int y = y0; y < y1; ++y) {
      const auto from = static_cast<std::size_t>(y - t.y) * static_cast<std::size_t>(t.width) +
                        static_cast<std::size_t>(x0 - t.x);
      const auto to = static_cast<std::size_t>(y - rect.y) * static_cast<std::size_t>(rect.width) +
                      static_cast<std::size_t>(x0 - rect.x);
      const auto n = static_cast<std::size_t>(x1 - x0);
      std::copy_n(&slot.state.pixels[from * r], n * r, &out.pixels[to * r]);
      const auto tile = static_cast<std::size_t>(&slot - tiles_.data());
      for (std::size_t i = 0; has_splats_ && !splats_.tiles[tile].empty() && i < n * r; ++i) {
        const std::vector<SplatPixel>& splats = splats_.tiles[tile];
        fold_splats(out.pixels[to * r + i], splats[from * r + i], paths_per_pixel(i % r));
      }
      if (has_aux_) {
        std::copy_n(&slot.state.aux[from], n, &out.aux[to]);
      }
      if (k > 0) {
        std::copy_n(&slot.state.shares[from * r * k], n * r * k, &out.shares[to * r * k]);
        add_splatted_shares(tile, {from, to, n}, out);
      }
      if (has_labels_) {
        std::copy_n(&slot.state.labels[from], n, &out.labels[to]);
      }
      if (kinds > 0) {
        std::copy_n(&slot.state.mattes[from * kinds], n * kinds, &out.mattes[to * kinds]);
      }
    }
  }
  return out;
}

HalfValue half_value(const FilmSnapshot& film, std::size_t pixel, int half) {
  const auto r = static_cast<std::size_t>(film.replicates);
  return half_value(std::span(film.pixels).subspan(pixel * r, r), half);
}

HalfValue pixel_value(const FilmSnapshot& film, std::size_t pixel) {
  const HalfValue a = half_value(film, pixel, 0);
  const HalfValue b = half_value(film, pixel, 1);
  HalfValue out;
  out.count = a.count + b.count;
  if (out.count == 0) {
    return out;
  }
  const float w = b.count == 0 ? 0.0F : a.count == 0 ? 1.0F : 0.5F;
  out.mean = lerp(a.mean, b.mean, w);
  out.alpha = lerp(a.alpha, b.alpha, w);
  return out;
}

std::array<HalfValue, 2> error_halves(const FilmSnapshot& film, std::size_t pixel) {
  std::array<HalfValue, 2> halves = {half_value(film, pixel, 0), half_value(film, pixel, 1)};
  if (film.errors_over_white) {
    put_over_white(halves[0], halves[1]);
  }
  return halves;
}

SampleVariance sample_variance(const FilmSnapshot& film, std::size_t pixel) {
  const auto r = static_cast<std::size_t>(film.replicates);
  double squares = 0;
  std::array<double, 2> counts{};
  SampleVariance out;
  for (std::size_t k = 0; k < r; ++k) {
    const ReplicatePixel& p = film.pixels[pixel * r + k];
    if (p.count > 0) {
      squares += static_cast<double>(p.m2_luminance);
      counts[k % 2] += static_cast<double>(p.count);
      out.degrees += static_cast<double>(p.count) - 1;
    }
  }
  if (out.degrees > 0) {
    const double of_sample = std::max(squares, 0.0) / out.degrees;
    const bool has_both = counts[0] > 0 && counts[1] > 0;
    out.of_mean = has_both ? 0.25 * of_sample * (1 / counts[0] + 1 / counts[1])
                           : of_sample / (counts[0] + counts[1]);
  }
  return out;
}

}  // namespace core
