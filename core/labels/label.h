/// label(): what the ray through the centre of a pixel shows.
#pragma once

#include <cstdint>

#include "core/film/label_pixel.h"
#include "core/scene/scene_data.h"

namespace core {

/// What a ray from the camera meets first: surfaces of any material, glass too, that cover half of
/// the point or more (MASK: that are there). rays: counts those traced.
LabelPixel label(const SceneData& scene, Ray ray, std::uint64_t& rays) noexcept;

}  // namespace core
