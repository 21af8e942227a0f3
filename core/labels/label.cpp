#include "core/labels/label.h"

#include "core/math/offset_ray.h"
#include "core/transport/path_state.h"

namespace core {

LabelPixel label(const SceneData& scene, Ray ray, std::uint64_t& rays) noexcept {
  RawHit hit;
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    ++rays;
    if (!scene.accel->intersect(ray, hit)) {
      break;
    }
    const SurfacePoint point = scene.surface_point(hit, ray);
    if (scene.has_alpha && scene.coverage(hit, ray) < 0.5F) {
      const float side = dot(point.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
      ray.origin = offset_ray(point.position, point.normal_geometric * side);
      continue;
    }
    const PlacedMesh& placed = scene.placed[point.placed];
    return {.object = placed.object,
            .instance = placed.instance,
            .material = point.material + 1,
            .primitive = scene.meshes[placed.mesh].primitive,
            .position = point.position,
            .uv = scene.uv(hit, ray)};
  }
  return {};
}

}  // namespace core
