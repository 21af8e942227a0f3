#include "core/integrators/first_surfaces.h"

#include <algorithm>
#include <vector>

#include "core/accel/accel.h"

namespace core {
namespace {

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

FirstSurfaces first_surfaces(const SceneData& scene, const Camera& camera,
                             const FilmSettings& film) {
  constexpr int kRays = 16;
  FirstSurfaces out;
  std::vector<float> distances_m;
  std::vector<float> widths_m;
  for (int i = 0; i < kRays * kRays; ++i) {
    const auto at = [](int k, int size) {
      return (static_cast<float>(k) + 0.5F) / kRays * static_cast<float>(size);
    };
    const Camera::CameraRay from =
        camera.ray({at(i % kRays, film.width), at(i / kRays, film.height)}, {0.5F, 0.5F});
    out.eye = out.eye + from.ray.origin * (1.0F / (kRays * kRays));
    RawHit hit;
    if (scene.accel->intersect(from.ray, hit)) {
      distances_m.push_back(length(scene.surface_point(hit, from.ray).position - from.ray.origin));
      widths_m.push_back(from.width_m + from.spread_rad * distances_m.back());
    }
  }
  if (!distances_m.empty()) {
    out.distance_m = median(distances_m);
    out.pixel_m = median(widths_m);
  }
  return out;
}

}  // namespace core
