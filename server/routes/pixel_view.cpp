#include "server/routes/pixel_view.h"

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "core/error/pixel_error.h"
#include "core/settings/registry.h"

namespace server {
namespace {

std::vector<double> triple(core::Rgb value) {
  return {static_cast<double>(value.r), static_cast<double>(value.g), static_cast<double>(value.b)};
}

/// Layers that are means over the samples, without an error of their own.
api::PixelLayer plain_layer(std::string name, std::vector<double> mean) {
  const std::vector<double> unknown(mean.size(), std::numeric_limits<double>::quiet_NaN());
  return api::PixelLayer{.name = std::move(name),
                         .mean = std::move(mean),
                         .standard_error = unknown,
                         .low = unknown,
                         .high = unknown,
                         .halves = {}};
}

}  // namespace

api::PixelView pixel_view(const core::FilmSnapshot& snapshot, const api::JobSpec& spec, int x,
                          int y) {
  const std::size_t index = static_cast<std::size_t>(y - snapshot.rect.y) *
                                static_cast<std::size_t>(snapshot.rect.width) +
                            static_cast<std::size_t>(x - snapshot.rect.x);
  const core::HalfValue value = core::pixel_value(snapshot, index);
  api::PixelView pixel;
  pixel.x = x;
  pixel.y = y;
  pixel.samples = value.count;
  api::PixelLayer beauty = plain_layer("beauty", triple(value.mean));
  const core::PixelError error = core::pixel_error(snapshot, x, y);
  beauty.standard_error = triple(error.standard_error);
  if (core::errors_are_valid(spec.render)) {
    beauty.low = triple(error.low);
    beauty.high = triple(error.high);
  }
  for (int half = 0; half < 2; ++half) {
    const core::HalfValue part = core::half_value(snapshot, index, half);
    beauty.halves.push_back(part.count > 0
                                ? triple(part.mean)
                                : std::vector<double>(3, std::numeric_limits<double>::quiet_NaN()));
  }
  pixel.layers.push_back(std::move(beauty));
  pixel.layers.push_back(plain_layer("alpha", {static_cast<double>(value.alpha)}));
  if (snapshot.has_aux) {
    const core::AuxPixel& aux = snapshot.aux[index];
    if (spec.render.film.albedo) {
      pixel.layers.push_back(plain_layer("albedo", triple(aux.albedo)));
    }
    if (spec.render.film.normal) {
      pixel.layers.push_back(plain_layer(
          "normal", triple({aux.normal_world.x, aux.normal_world.y, aux.normal_world.z})));
    }
    if (spec.render.film.depth) {
      pixel.layers.push_back(plain_layer("depth", {static_cast<double>(aux.depth_m)}));
    }
  }
  return pixel;
}

}  // namespace server
