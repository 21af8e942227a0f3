/// label(): what the ray through the centre of a pixel shows.
#pragma once

#include <cstdint>
#include <span>

#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/labels/motion.h"
#include "core/scene/scene_data.h"
#include "core/transport/path_state.h"

namespace core {

/// What a ray from the camera meets first: surfaces of any material, glass too, that cover half of
/// the point or more (MASK: that are there). motion: null: not asked for. rays: counts those
/// traced.
LabelPixel label(const SceneData& scene, Ray ray, const Motion* motion,
                 std::uint64_t& rays) noexcept;

/// Of all pixels of a tile that has room for labels.
void put_labels(TileState& state, const SceneData& scene, const Camera& camera,
                const Motion* motion) noexcept;

/// Adds to the mattes of a pixel, one for each kind, what the path from the camera meets first.
/// half: of the picture, 0 or 1.
void count_matte(const SceneData& scene, PathState& path, MatteKinds kinds, int half,
                 std::span<MattePixel> pixel) noexcept;

}  // namespace core
