#include "core/film/splats.h"

#include <cmath>

namespace core {

static_assert(sizeof(SplatPixel) == 48);

void LightBatch::add(int replicate, const Splat& splat) {
  if (is_black(splat.value)) {
    return;
  }
  const Rgb size = {std::fabs(splat.value.r), std::fabs(splat.value.g), std::fabs(splat.value.b)};
  if (!is_finite(splat.value) || !(max_component(size) < kSplatMax)) {
    ++rejected_samples;
    return;
  }
  splats[static_cast<std::size_t>(replicate)].push_back(splat);
}

std::string rejected_warning(std::uint64_t rejected) {
  return std::to_string(rejected) + std::string(kRejectedWords) +
         ", so the image lacks their light: they are not finite, or light paths bring 2^34 or more "
         "to a pixel; make all lights weaker, or choose an integrator without light paths";
}

void add_splat(SplatPixel& pixel, Rgb value) {
  const auto units = [](float v) {
    return static_cast<SplatSum>(std::nearbyint(static_cast<double>(v) / double{kSplatUnit}));
  };
  pixel.sum[0] += units(value.r);
  pixel.sum[1] += units(value.g);
  pixel.sum[2] += units(value.b);
}

void fold_splats(ReplicatePixel& pixel, const SplatPixel& splats, double paths_per_pixel) {
  if (pixel.count == 0 || !(paths_per_pixel > 0)) {
    return;
  }
  const double scale = double{kSplatUnit} / paths_per_pixel;
  const auto mean = [scale](SplatSum sum) {
    return static_cast<float>(static_cast<double>(sum) * scale);
  };
  pixel.mean_r += mean(splats.sum[0]);
  pixel.mean_g += mean(splats.sum[1]);
  pixel.mean_b += mean(splats.sum[2]);
}

}  // namespace core
