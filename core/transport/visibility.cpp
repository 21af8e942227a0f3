#include "core/transport/visibility.h"

#include "core/math/offset_ray.h"
#include "core/transport/intersect.h"
#include "core/transport/solid_faces.h"
#include "core/transport/surface_event.h"

namespace core {

namespace {

/// Distinct from the holes of the path, which the shadow ray must not depend on.
constexpr std::uint32_t kShadowDraws = 0x20000000U;

/// A shadow ray on its way.
template <typename Colors>
class ShadowRay {
 public:
  ShadowRay(const SceneData& scene, PathState& path, const Ray& ray, MediumStack& media,
            const Colors& colors)
      : scene_(scene),
        path_(path),
        ray_(ray),
        end_(ray.origin + ray.direction),
        from_(ray.origin),
        media_(media),
        colors_(colors) {}

  const Ray& ray() const noexcept { return ray_; }
  Rgb transmittance() const noexcept { return open_; }
  /// Passes holes that are not of solids.
  void pass_holes(const Passage& passage) noexcept {
    open_ *= passage.open;
    path_.rays += passage.holes;
  }
  bool is_far() const noexcept { return ray_.t_max > 1; }

  /// Reaches the end. Solids end before infinity; if one does not, its mesh has a hole.
  void finish() noexcept {
    if (!is_far()) {
      absorb(ray_.origin + ray_.direction, {});
    } else if (media_.empty() && path_.fog != nullptr) {
      const float depth_m = path_.fog->depth(from_, ray_.direction, kFar);
      pass(path_.fog->medium(), depth_m);
    }
  }
  /// Passes a surface that is not of a solid, and transmits this.
  void pass_surface(const SurfacePoint& point, Rgb transmitted) noexcept {
    open_ *= transmitted;
    go_on(point);
  }
  /// Meets the surface of a solid. passes_clear: it may transmit without deflection.
  void meet_solid(const Solid& solid, const RawHit& hit, float coverage,
                  bool passes_clear) noexcept {
    SurfacePoint point = scene_.surface_point(hit, ray_);
    const FacesAt faces = faces_at(scene_, hit, point, ray_, media_);
    enter_late(media_, solid, faces, point, ray_);
    point.error_m = faces.error_m;
    if (faces.instead) {
      open_ = {};
      return;
    }
    if (faces.beyond.top() == media_.top()) {
      media_ = faces.beyond;
      go_on(point);
      return;
    }
    const Rgb straight = passes_clear && coverage > 0 ? clear(point, &faces.beyond) : Rgb{};
    // The two ways lead through different media: where both are open, one is chosen.
    const bool is_hole =
        coverage < 1 &&
        (is_black(straight) ||
         !(path_.sampler.extra_1d(path_.depth, kShadowDraws + path_.alpha_tests++) < coverage));
    const SolidFace face = {&solid, is_hole};
    absorb(point.position, face);
    open_ *= !is_hole ? straight
                      : Rgb(hole_factor(path_, media_, faces.beyond) *
                            (is_black(straight) ? 1 - coverage : 1));
    media_ = faces.beyond;
    media_.begin_segment(face);
    from_ = point.position;
    go_on(point);
  }
  /// What a surface transmits without deflection. beyond: of a solid; else null.
  Rgb clear(const SurfacePoint& point, const MediumStack* beyond) noexcept {
    const Vec3 wo = -normalize(ray_.direction);
    Shading shading;
    shade(scene_.materials[point.material], point, wo, path_.footprint(), shading);
    if constexpr (Colors::is_spectral) {
      colors_.shade(shading);
    }
    if (beyond != nullptr) {
      const BoundaryMedia at(media_, *beyond, shading.front);
      shading.bsdf.ior = relative_ior(path_, at);
      if constexpr (Colors::is_spectral) {
        const Rgb ior = colors_.relative_ior(at);
        if (!(ior == Rgb(ior.r))) {
          return {};  // not clear at more than one wavelength
        }
      }
    }
    return make_bsdf(shading, wo).null_transmittance();
  }

 private:
  void pass(const Medium& medium, float depth_m) noexcept {
    open_ *= core::transmittance(medium.sigma_t, depth_m);
    colors_.passed(medium, depth_m);
  }
  /// The medium from the last change of media to here.
  void absorb(Vec3 to, SolidFace face) noexcept {
    const Vec3 segment = to - from_;
    if (const Material* solid = media_.medium_to(face); solid != nullptr) {
      pass(colors_.medium(*solid), length(segment));
    } else if (path_.fog != nullptr && media_.empty()) {
      const float distance_m = length(segment);
      pass(path_.fog->medium(), path_.fog->depth(from_, segment * (1 / distance_m), distance_m));
    }
  }
  void go_on(const SurfacePoint& point) noexcept {
    ++path_.rays;
    const bool far = is_far();
    ray_ = ray_behind(point, ray_);
    if (!far) {
      ray_.direction = end_ - ray_.origin;
    }
  }

  const SceneData& scene_;
  PathState& path_;
  Ray ray_;
  Vec3 end_;
  Vec3 from_;  ///< the last change of media
  MediumStack& media_;
  const Colors& colors_;
  Rgb open_ = {1, 1, 1};
};

/// Returns the passage of a shadow ray where surfaces transmit by holes only.
Passage passage_of(const SceneData& scene, const Ray& ray) noexcept {
  if (!scene.has_alpha) {
    return {scene.accel->occluded(ray) ? 0.0F : 1.0F, 0};
  }
  struct Of {
    const SceneData& scene;
    const Ray& ray;
  } of{scene, ray};
  return scene.accel->pass_holes(
      ray,
      [](const void* at, const RawHit& hit, unsigned /*lane*/) {
        const auto& [in, by] = *static_cast<const Of*>(at);
        return in.coverage(hit, by);
      },
      &of);
}

}  // namespace

template <typename Colors>
Visibility visibility(const SceneData& scene, PathState& path, const Ray& towards,
                      MediumStack& media, ClearSurfaces clear, const Colors& colors) noexcept {
  Ray first = towards;
  first.time = path.ray.time;
  ++path.rays;
  ShadowRay<Colors> shadow(scene, path, first, media, colors);
  const bool passes_clear =
      clear == ClearSurfaces::kPass && (scene.has_clear || scene.has_shared_space);
  if (!passes_clear && !scene.has_shared_space && !(scene.has_alpha && scene.has_volumes)) {
    const Passage passage = passage_of(scene, first);
    if (passage.open == 0) {
      return {};
    }
    shadow.pass_holes(passage);
    shadow.finish();
    return {shadow.transmittance(), passage.holes == 0};
  }
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    RawHit hit;
    if (!scene.accel->intersect(shadow.ray(), hit)) {
      shadow.finish();
      return {shadow.transmittance(), pass == 0};
    }
    const float coverage = scene.coverage(hit, shadow.ray());
    const Solid* solid = scene.solid_of(hit);
    const Material& material = scene.materials[scene.meshes[scene.placed_mesh(hit).mesh].material];
    const bool is_clear =
        passes_clear && (material.is_clear || (solid != nullptr && solid->shares_space));
    if (solid != nullptr) {
      if (coverage >= 1 && !is_clear && !solid->shares_space) {
        return {};
      }
      shadow.meet_solid(*solid, hit, coverage, is_clear);
    } else {
      if (coverage >= 1 && !is_clear) {
        return {};
      }
      const SurfacePoint point = scene.surface_point(hit, shadow.ray());
      if (scene.has_volumes) {
        if (const auto on_hole = faces_at(scene, hit, point, shadow.ray(), media).instead) {
          shadow.meet_solid(*scene.solid_of(*on_hole), *on_hole,
                            scene.coverage(*on_hole, shadow.ray()), passes_clear);
          if (is_black(shadow.transmittance())) {
            return {};
          }
          continue;
        }
      }
      Rgb transmitted(1 - coverage);
      if (is_clear && coverage > 0) {
        transmitted += shadow.clear(point, nullptr) * coverage;
      }
      shadow.pass_surface(point, transmitted);
    }
    if (is_black(shadow.transmittance())) {
      return {};
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
  MediumStack media = side < 0 && vertex.face.solid != nullptr ? vertex.beyond : path.media;
  media.begin_segment(vertex.face);
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
