#include <algorithm>

#include "core/film/film.h"

namespace core {

void Film::add_splatted_shares(std::size_t tile, const Run& run, FilmSnapshot& out) const {
  if (!has_splats_ || splats_.tiles[tile].empty()) {
    return;
  }
  const auto r = static_cast<std::size_t>(replicates_);
  const std::size_t shares = shares_.size();
  const PixelRect& rect = rects_[tile];
  const std::size_t plane =
      static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height) * r;
  for (std::size_t i = 0; i < run.count * r; ++i) {
    const ReplicatePixel& counted = out.pixels[run.to * r + i];
    for (std::size_t k = 0; k < shares; ++k) {
      ReplicatePixel light;
      light.count = counted.count;
      fold_splats(light, splats_.tiles[tile][(k + 1) * plane + run.from * r + i],
                  paths_per_pixel(i % r));
      out.shares[(run.to * r + i) * shares + k] += {light.mean_r, light.mean_g, light.mean_b};
    }
  }
}

void add_shares(std::span<Rgb> means, std::span<const Rgb> sample, std::uint32_t count) {
  const float w = 1 / static_cast<float>(count);
  for (std::size_t i = 0; i < means.size(); ++i) {
    means[i] += (sample[i] - means[i]) * w;
  }
}

std::optional<FilmSnapshot> share_of(const FilmSnapshot& film, std::string_view layer) {
  const auto& layers = film.share_layers;
  const auto found = std::find(layers.begin(), layers.end(), layer);
  if (found == layers.end()) {
    return std::nullopt;
  }
  const auto share = static_cast<std::size_t>(found - layers.begin());
  FilmSnapshot out;
  out.rect = film.rect;
  out.replicates = film.replicates;
  out.errors = film.errors;
  out.revision = film.revision;
  out.pixels = film.pixels;
  for (std::size_t i = 0; i < out.pixels.size(); ++i) {
    const Rgb mean = film.shares[i * layers.size() + share];
    ReplicatePixel& p = out.pixels[i];
    p.mean_r = mean.r;
    p.mean_g = mean.g;
    p.mean_b = mean.b;
    p.m2_luminance = 0;
  }
  return out;
}

}  // namespace core
