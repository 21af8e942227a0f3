#include "core/render/picture/filtered_splats.h"

#include <algorithm>
#include <cmath>

namespace core {

void FilteredSplats::add_to_plane(Vec2 film_px, int plane, Rgb value) noexcept {
  const Rgb each = value / (static_cast<float>(film_.width) * static_cast<float>(film_.height));
  // Pixel i has its centre at i + 1/2.
  const auto first = [this](float at) {
    return std::max(0, static_cast<int>(std::ceil(at - 0.5F - filter_.radius_px())));
  };
  const auto end = [this](float at, int size) {
    return std::min(size, static_cast<int>(std::floor(at - 0.5F + filter_.radius_px())) + 1);
  };
  const int right = end(film_px.x, film_.width);
  const int bottom = end(film_px.y, film_.height);
  for (int y = first(film_px.y); y < bottom; ++y) {
    const float weight_y = filter_.density(film_px.y - 0.5F - static_cast<float>(y));
    for (int x = first(film_px.x); x < right; ++x) {
      const float weight = weight_y * filter_.density(film_px.x - 0.5F - static_cast<float>(x));
      to_.add(replicate_, {x, y, each * weight, plane});
    }
  }
}

}  // namespace core
