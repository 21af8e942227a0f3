#include "core/transport/visibility.h"

#include "core/math/offset_ray.h"
#include "core/transport/surface_event.h"

namespace core {

template <typename Colors>
Visibility visibility(const SceneData& scene, PathState& path, const Ray& towards,
                      MediumStack& media, ClearSurfaces clear, const Colors& colors) noexcept {
  Ray shadow = towards;
  shadow.time = path.ray.time;
  ++path.rays;
  Rgb open(1);
  const auto absorb = [&open, &media, &path, &colors](Vec3 from, Vec3 segment) {
    if (media.top() != nullptr) {
      const auto& medium = colors.medium(*media.top());
      const float distance_m = length(segment);
      open *= transmittance(medium.sigma_t, distance_m);
      colors.passed(medium, distance_m);
    } else if (path.fog != nullptr) {
      const float distance_m = length(segment);
      const float depth_m = path.fog->depth(from, segment * (1 / distance_m), distance_m);
      open *= transmittance(path.fog->medium().sigma_t, depth_m);
      colors.passed(path.fog->medium(), depth_m);
    }
  };
  // Solids end before infinity; if one does not, its mesh has a hole.
  const auto absorb_far = [&open, &media, &path, &colors](const Ray& ray) {
    if (media.top() == nullptr && path.fog != nullptr) {
      const float depth_m = path.fog->depth(ray.origin, ray.direction, kFar);
      open *= transmittance(path.fog->medium().sigma_t, depth_m);
      colors.passed(path.fog->medium(), depth_m);
    }
  };
  const bool passes_clear = clear == ClearSurfaces::kPass && scene.has_clear;
  if (!scene.has_alpha && !passes_clear) {
    if (scene.accel->occluded(shadow)) {
      return {};
    }
    if (shadow.t_max <= 1) {
      absorb(shadow.origin, shadow.direction);
    } else {
      absorb_far(shadow);
    }
    return {open, true};
  }
  Ray ray = shadow;
  const Vec3 end = shadow.origin + shadow.direction;
  const bool far = shadow.t_max > 1;
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    RawHit hit;
    if (!scene.accel->intersect(ray, hit)) {
      if (far) {
        absorb_far(ray);
      } else {
        absorb(ray.origin, ray.direction);
      }
      return {open, pass == 0};
    }
    const float coverage = scene.coverage(hit, ray);
    const Material& material = scene.materials[scene.meshes[scene.placed_mesh(hit).mesh].material];
    const bool is_clear = passes_clear && material.is_clear;
    if (coverage >= 1 && !is_clear) {
      return {};
    }
    const SurfacePoint hole = scene.surface_point(hit, ray);
    absorb(ray.origin, hole.position - ray.origin);
    Rgb transmitted(1 - coverage);
    if (is_clear && coverage > 0) {
      const Vec3 wo = -normalize(ray.direction);
      Shading shading;
      shade(scene.materials[hole.material], hole, wo, path.footprint(), shading);
      if constexpr (Colors::is_spectral) {
        colors.shade(shading);
      }
      if (material.is_volume) {
        shading.bsdf.ior = relative_ior(path, media, material, shading.front);
        if constexpr (Colors::is_spectral) {
          const Rgb ior = colors.relative_ior(media, material, shading.front);
          if (!(ior == Rgb(ior.r))) {
            return {};  // not clear at more than one wavelength
          }
        }
        media.cross(material, shading.front);
      }
      transmitted += make_bsdf(shading, wo).straight() * coverage;
    }
    open *= transmitted;
    if (is_black(open)) {
      return {};
    }
    ++path.rays;
    const float side = dot(hole.normal_geometric, ray.direction) >= 0 ? 1.0F : -1.0F;
    ray.origin = offset_ray(hole.position, hole.normal_geometric * side, hole.error_m);
    if (!far) {
      ray.direction = end - ray.origin;
    }
  }
  return {};
}

template <typename Colors>
Visibility visibility_from(const SceneData& scene, PathState& path, const PathVertex& vertex,
                           Vec3 wi_world, Vec3 target, bool is_far, ClearSurfaces clear,
                           const Colors& colors) noexcept {
  const float side = dot(vertex.shading.horizon, wi_world) >= 0 ? 1.0F : -1.0F;
  Ray shadow;
  shadow.origin = offset_ray(vertex.shading.origin, vertex.shading.normal_geometric * side,
                             vertex.point.error_m);
  shadow.direction = is_far ? wi_world : target - shadow.origin;
  shadow.t_max = is_far ? kFar : 1.0F;
  MediumStack media = path.media;
  const Material& material = scene.materials[vertex.point.material];
  if (side < 0 && material.is_volume) {
    media.cross(material, vertex.shading.front);
  }
  return visibility(scene, path, shadow, media, clear, colors);
}

template Visibility visibility(const SceneData&, PathState&, const Ray&, MediumStack&,
                               ClearSurfaces, const RgbColors&) noexcept;
template Visibility visibility(const SceneData&, PathState&, const Ray&, MediumStack&,
                               ClearSurfaces, const SpectralColors&) noexcept;
template Visibility visibility(const SceneData&, PathState&, const Ray&, MediumStack&,
                               ClearSurfaces, const FlightColors&) noexcept;
template Visibility visibility_from(const SceneData&, PathState&, const PathVertex&, Vec3, Vec3,
                                    bool, ClearSurfaces, const RgbColors&) noexcept;
template Visibility visibility_from(const SceneData&, PathState&, const PathVertex&, Vec3, Vec3,
                                    bool, ClearSurfaces, const FlightColors&) noexcept;
template Visibility visibility_from(const SceneData&, PathState&, const PathVertex&, Vec3, Vec3,
                                    bool, ClearSurfaces, const SpectralColors&) noexcept;

}  // namespace core
