#include "core/transport/intersect.h"

#include "core/math/offset_ray.h"

namespace core {

bool intersect(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept {
  RawHit hit;
  Ray ray = path.ray;
  float travelled = 0;
  path.passed_hole = false;
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    if (path.met != nullptr) {
      hit = *path.met;
      path.met = nullptr;
    } else {
      ++path.rays;
      if (!scene.accel->intersect(ray, hit)) {
        return false;
      }
    }
    if (scene.has_alpha) {
      const float coverage = scene.coverage(hit, ray);
      if (coverage < 1 &&
          !(coverage > 0 && path.sampler.extra_1d(path.depth, path.alpha_tests++) < coverage)) {
        const SurfacePoint hole = scene.surface_point(hit, ray);
        const float side = dot(hole.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
        travelled += length(hole.position - ray.origin);
        path.passed_hole = true;
        ray.origin = offset_ray(hole.position, hole.normal_geometric * side, hole.error_m);
        continue;
      }
    }
    vertex.point = scene.surface_point(hit, ray);
    vertex.wo_world = -ray.direction;
    vertex.distance_m = travelled + length(vertex.point.position - ray.origin);
    return true;
  }
  return false;
}

}  // namespace core
