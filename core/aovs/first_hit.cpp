#include "core/aovs/first_hit.h"

#include <algorithm>
#include <cstddef>

#include "core/math/offset_ray.h"
#include "core/transport/intersect.h"

namespace core {

std::optional<FirstHit> first_hit(const SceneData& scene, Ray ray, std::uint64_t& rays) noexcept {
  RawHit hit;
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    ++rays;
    if (!scene.accel->intersect(ray, hit)) {
      break;
    }
    const SurfacePoint point = scene.surface_point(hit, ray);
    if (scene.has_alpha && scene.coverage(hit, ray) < 0.5F) {
      const float side = dot(point.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
      ray.t_max -= length(point.position - ray.origin);
      ray.origin = offset_ray(point.position, point.normal_geometric * side, point.error_m);
      continue;
    }
    return FirstHit{hit, ray, point};
  }
  return std::nullopt;
}

FirstHitPixel first_hit_pixel(const SceneData& scene, Ray ray, const Motion* motion,
                              std::uint64_t& rays, Vec3* seen) noexcept {
  const auto found = first_hit(scene, ray, rays);
  if (!found) {
    return {};
  }
  const SurfacePoint& point = found->point;
  if (seen != nullptr) {
    *seen = point.position;
  }
  const PlacedMesh& placed = scene.placed[point.placed];
  return {.object = placed.object,
          .instance = placed.instance,
          .material = point.material + 1,
          .primitive = scene.meshes[placed.mesh].primitive,
          .position = (Place(point.position) + scene.origin).rounded(),
          .uv = scene.uv(found->hit, found->ray),
          .motion = motion != nullptr
                        ? motion->of(scene, point, scene.corner_weights(found->hit, found->ray))
                        : Vec2{}};
}

void put_first_hits(TileState& state, const SceneData& scene, const Camera& camera,
                    const Motion* motion) noexcept {
  const PixelRect& rect = state.rect;
  const std::size_t count = std::max(state.first_hits.size(), state.z_depths.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2 centre_px = {static_cast<float>(rect.x + static_cast<int>(i) % rect.width) + 0.5F,
                            static_cast<float>(rect.y + static_cast<int>(i) / rect.width) + 0.5F};
    Vec3 seen = camera.eye();
    const FirstHitPixel pixel =
        first_hit_pixel(scene, camera.ray(centre_px, {0.5F, 0.5F}).ray, motion, state.rays, &seen);
    if (!state.first_hits.empty()) {
      state.first_hits[i] = pixel;
    }
    if (!state.z_depths.empty()) {
      state.z_depths[i] = dot(seen - camera.eye(), camera.forward());
    }
  }
}

void count_matte(const SceneData& scene, PathState& path, MatteKinds kinds, int half,
                 std::span<MattePixel> pixel) noexcept {
  PathVertex vertex;
  if (!reach(scene, path, vertex)) {
    return;
  }
  MatteRank hit;
  hit.hits[static_cast<std::size_t>(half)] = 1;
  if (kinds.object) {
    hit.id = scene.object_mattes[scene.placed[vertex.point.placed].object];
    add_matte(pixel.front(), hit);
  }
  if (kinds.material) {
    hit.id = scene.material_mattes[vertex.point.material];
    add_matte(pixel.back(), hit);
  }
}

}  // namespace core
