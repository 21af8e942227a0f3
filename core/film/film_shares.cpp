#include <algorithm>

#include "core/film/film.h"

namespace core {

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
