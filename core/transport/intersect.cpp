#include "core/transport/intersect.h"

#include <algorithm>

#include "core/transport/solid_faces.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

bool draws_hole(const SceneData& scene, PathState& path, const RawHit& hit,
                const Ray& ray) noexcept {
  return passes_hole(scene.coverage(hit, ray),
                     [&path] { return hole_number(path.sampler, path.depth, path.alpha_tests++); });
}

}  // namespace

bool intersect(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept {
  RawHit hit;
  Ray ray = path.ray;
  float travelled = 0;
  path.passed_hole = path.solid_holes > 0;
  vertex.face = {};
  bool is_known = path.met != nullptr;
  if (is_known) {
    hit = *path.met;
    path.met = nullptr;
  }
  const auto go_on = [&](const SurfacePoint& point) {
    const float passed_m = length(point.position - ray.origin);
    travelled += passed_m;
    ray = ray_behind(point, ray);
    ray.t_max -= passed_m;
  };
  const auto end_at = [&](const SurfacePoint& point) {
    vertex.point = point;
    vertex.wo_world = -ray.direction;
    vertex.distance_m = travelled + length(point.position - ray.origin);
    vertex.passed_m = path.passed_m;
    return true;
  };
  for (int pass = 0; pass < kNullScatteringMax; ++pass) {
    if (!is_known) {
      ++path.rays;
      if (!scene.accel->intersect(ray, hit)) {
        return false;
      }
    }
    is_known = false;
    float error_m = 0;  // of an interface of several faces
    const Solid* solid = scene.has_volumes ? scene.solid_of(hit) : nullptr;
    if (solid != nullptr) {
      SurfacePoint point = scene.surface_point(hit, ray);
      const FacesAt faces = faces_at(scene, hit, point, ray, path.media);
      enter_late(path.media, *solid, faces, point, ray);
      point.error_m = error_m = faces.error_m;
      if (faces.instead) {
        hit = *faces.instead;
      } else if (faces.beyond.top() == path.media.top()) {
        path.media = faces.beyond;
        go_on(point);
        continue;
      } else {
        vertex.face = {solid, scene.has_solid_holes && draws_hole(scene, path, hit, ray)};
        vertex.beyond = faces.beyond;
        return end_at(point);
      }
    }
    if (scene.has_alpha && draws_hole(scene, path, hit, ray)) {
      const SurfacePoint point = scene.surface_point(hit, ray);
      if (scene.has_volumes) {
        if (const auto behind = faces_at(scene, hit, point, ray, path.media).instead) {
          hit = *behind;
          is_known = true;
          continue;
        }
      }
      path.passed_hole = true;
      go_on(point);
      continue;
    }
    end_at(scene.surface_point(hit, ray));
    vertex.point.error_m = std::max(vertex.point.error_m, error_m);
    return true;
  }
  return false;
}

void pass_hole(PathState& path, const PathVertex& vertex) noexcept {
  path.ray = ray_behind(vertex.point, path.ray);
  path.ray.t_max -= vertex.distance_m;
  ++path.solid_holes;
  path.passed_m += vertex.distance_m;
  const float factor = hole_factor(path, path.media, vertex.beyond);
  path.beta *= factor;
  path.eta_scale *= path.is_from_light ? 1 : 1 / factor;
  path.media = vertex.beyond;
  path.media.begin_segment(vertex.face);
}

bool reach(const SceneData& scene, PathState& path, PathVertex& vertex) noexcept {
  for (int pass = 0; pass < kNullScatteringMax && intersect(scene, path, vertex); ++pass) {
    path.beta *= segment_transmittance(path, vertex);
    if (!vertex.face.is_hole) {
      return true;
    }
    pass_hole(path, vertex);
  }
  return false;
}

}  // namespace core
