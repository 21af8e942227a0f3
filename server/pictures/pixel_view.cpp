#include "server/pictures/pixel_view.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "core/error/pixel_error.h"
#include "core/integrators/registry.h"
#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"

namespace server {
namespace {

std::vector<double> triple(core::Rgb value) {
  return {static_cast<double>(value.r), static_cast<double>(value.g), static_cast<double>(value.b)};
}

std::vector<double> unknown(std::size_t count) {
  return std::vector<double>(count, std::numeric_limits<double>::quiet_NaN());
}

/// Returns a layer that is a mean over the samples, without its own error estimate.
api::PixelLayer plain_layer(const core::FilmSnapshot& snapshot, std::size_t index,
                            const core::LayerEntry& row) {
  const std::size_t channels = row.channels.size();
  std::vector<float> plane(snapshot.pixel_count() * channels);
  row.fill(snapshot, plane);
  const std::size_t shown = std::min<std::size_t>(channels, 3);  // alpha is a separate layer
  const float* first = &plane[index * channels];
  return api::PixelLayer{.name = std::string(row.name),
                         .mean = std::vector<double>(first, first + shown),
                         .standard_error = unknown(shown),
                         .low = unknown(shown),
                         .high = unknown(shown),
                         .halves = {}};
}

void add_error(api::PixelLayer& beauty, const core::FilmSnapshot& snapshot, std::size_t index,
               const core::PixelError& error, bool has_interval) {
  beauty.standard_error = triple(error.standard_error);
  if (has_interval) {
    beauty.low = triple(error.low);
    beauty.high = triple(error.high);
  }
  for (int half = 0; half < 2; ++half) {
    const core::HalfValue part = core::half_value(snapshot, index, half);
    beauty.halves.push_back(part.count > 0 ? triple(part.mean) : unknown(3));
  }
}

struct PixelPlace {
  int x = 0;
  int y = 0;
};

/// Returns a light share; snapshot: with the share in place of the picture.
api::PixelLayer share_layer(const core::FilmSnapshot& snapshot, const std::string& layer,
                            std::size_t index, PixelPlace at, bool has_interval) {
  api::PixelLayer out{.name = layer,
                      .mean = triple(core::pixel_value(snapshot, index).mean),
                      .standard_error = {},
                      .low = unknown(3),
                      .high = unknown(3),
                      .halves = {}};
  add_error(out, snapshot, index, core::pixel_error(snapshot, at.x, at.y), has_interval);
  return out;
}

}  // namespace

api::PixelView pixel_view(const core::FilmSnapshot& snapshot, const api::JobSpec& spec, int x,
                          int y) {
  const std::size_t index = static_cast<std::size_t>(y - snapshot.rect.y) *
                                static_cast<std::size_t>(snapshot.rect.width) +
                            static_cast<std::size_t>(x - snapshot.rect.x);
  api::PixelView pixel;
  pixel.x = x;
  pixel.y = y;
  pixel.samples = core::pixel_value(snapshot, index).count;
  for (const core::LayerEntry& row : core::layers()) {
    if (!row.has_value || !core::has_layer(snapshot, spec.render.film, row)) {
      continue;
    }
    pixel.layers.push_back(plain_layer(snapshot, index, row));
    if (row.name == core::kBeauty) {
      add_error(pixel.layers.back(), snapshot, index, core::pixel_error(snapshot, x, y),
                core::halves_show_error(spec.render));
    }
  }
  for (const std::string& layer : snapshot.share_layers) {
    pixel.layers.push_back(share_layer(*core::share_of(snapshot, layer), layer, index, {x, y},
                                       core::halves_show_error(spec.render)));
  }
  return pixel;
}

}  // namespace server
