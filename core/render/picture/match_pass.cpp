#include "core/render/picture/match_pass.h"

#include <cmath>
#include <cstdint>
#include <optional>

#include "core/accel/accel.h"
#include "core/aovs/first_hit.h"
#include "core/camera/moving_camera.h"

namespace core {
namespace {

constexpr Vec2 kMiddleOfLens = {0.5F, 0.5F};

/// A scene seen by its camera, and the film's part that is rendered.
struct Sight {
  const SceneData& scene;
  Camera camera;
  PixelRect crop;
};

Result<Sight> sight_of(const View& view) {
  auto camera = camera_of(view);
  if (!camera) {
    return camera.error();
  }
  return Sight{view.scene->data(), camera->first(), view.settings.film.area()};
}

struct PixelHit {
  FirstHit found;
  Camera::CameraRay from;
};
std::optional<PixelHit> hit_at(const Sight& sight, int x, int y) {
  const Vec2 centre_px = {static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F};
  const Camera::CameraRay from = sight.camera.ray(centre_px, kMiddleOfLens);
  std::uint64_t rays = 0;
  auto found = first_hit(sight.scene, from.ray, rays);
  return found ? std::optional(PixelHit{*found, from}) : std::nullopt;
}

/// Returns whether the other image's pixel shows this point of the same part.
bool shows(const Sight& there, const PixelHit& hit, Vec3 point, const PlacedMesh& part,
           std::uint32_t primitive) {
  const SurfacePoint& seen = hit.found.point;
  const PlacedMesh& placed = there.scene.placed[seen.placed];
  if (placed.object != part.object || placed.instance != part.instance ||
      there.scene.meshes[placed.mesh].primitive != primitive) {
    return false;
  }
  const float width_m =
      hit.from.width_m + hit.from.spread_rad * length(seen.position - hit.from.ray.origin);
  return std::fabs(dot(seen.normal_geometric, point - seen.position)) <= width_m;
}

struct Found {
  std::int32_t source = -1;
  float farther_m = 0;
};
Found follow(const Sight& here, const Sight& there, const MotionTarget* target, int x, int y) {
  const auto hit = hit_at(here, x, y);
  if (!hit) {
    return {};
  }
  const SurfacePoint& point = hit->found.point;
  const auto moved =
      target != nullptr
          ? target->position(here.scene, point,
                             here.scene.corner_weights(hit->found.hit, hit->found.ray))
          : std::optional(point.position);
  if (!moved) {
    return {};
  }
  const Vec3 to = (Place(*moved) + (here.scene.origin - there.scene.origin)).rounded();
  const auto film_px = there.camera.project(to, kMiddleOfLens);
  const PixelRect& crop = there.crop;
  if (!film_px || !(film_px->x >= static_cast<float>(crop.x)) ||
      !(film_px->y >= static_cast<float>(crop.y)) ||
      !(film_px->x < static_cast<float>(crop.x + crop.width)) ||
      !(film_px->y < static_cast<float>(crop.y + crop.height))) {
    return {};
  }
  const int px = static_cast<int>(film_px->x);
  const int py = static_cast<int>(film_px->y);
  const PlacedMesh& part = here.scene.placed[point.placed];
  const auto seen = hit_at(there, px, py);
  if (!seen || !shows(there, *seen, to, part, here.scene.meshes[part.mesh].primitive)) {
    return {};
  }
  return {(py - crop.y) * crop.width + px - crop.x,
          length(to - there.camera.eye()) - length(point.position - here.camera.eye())};
}

}  // namespace

Result<FrameMatch> match_pass(const View& view, const OtherFrame& other,
                              const ParallelFor& parallel) {
  const auto here = sight_of(view);
  if (!here) {
    return here.error();
  }
  const auto there = sight_of(*other.view);
  if (!there) {
    return there.error();
  }
  const PixelRect& crop = here->crop;
  const std::size_t count =
      static_cast<std::size_t>(crop.width) * static_cast<std::size_t>(crop.height);
  FrameMatch out = {std::vector<std::int32_t>(count, -1), std::vector<float>(count)};
  parallel(crop.height, [&](int row) {
    prepare_tracing_thread();
    for (int column = 0; column < crop.width; ++column) {
      const Found found = follow(*here, *there, other.target, crop.x + column, crop.y + row);
      const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(crop.width) +
                     static_cast<std::size_t>(column);
      out.source[i] = found.source;
      out.farther_m[i] = found.farther_m;
    }
  });
  return out;
}

}  // namespace core
