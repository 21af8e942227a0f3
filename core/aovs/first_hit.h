/// The first surface along a ray: under the centre of a pixel, and that of a camera path.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/accel/accel.h"
#include "core/aovs/motion.h"
#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"

namespace core {

/// A hit, and the last piece of the ray that found it.
struct FirstHit {
  RawHit hit;
  Ray ray;
  SurfacePoint point;
};
/// Returns the first surface along a camera ray, of any material including glass, with coverage of
/// at least one half (MASK: present). rays: adds the rays traced.
std::optional<FirstHit> first_hit(const SceneData& scene, Ray ray, std::uint64_t& rays) noexcept;

/// Returns the record of first_hit(). motion: null if not needed. rays: adds the rays traced.
/// seen: receives the hit, from the scene's origin, if there is one; null if not needed.
FirstHitPixel first_hit_pixel(const SceneData& scene, Ray ray, const Motion* motion,
                              std::uint64_t& rays, Vec3* seen = nullptr) noexcept;

/// Writes the first hits and depths of all pixels of a tile, as far as it has room for them.
void put_first_hits(TileState& state, const SceneData& scene, const Camera& camera,
                    const Motion* motion) noexcept;

/// Adds the first surface of the camera path to the pixel's mattes, one per kind. half: of the
/// image, 0 or 1.
void count_matte(const SceneData& scene, PathState& path, MatteKinds kinds, int half,
                 std::span<MattePixel> pixel) noexcept;

}  // namespace core
