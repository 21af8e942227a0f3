/// Boxes of what a scene shows: in the world, and in a picture as if nothing hid anything.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "core/camera/camera.h"
#include "core/math/bounds.h"
#include "core/math/vec.h"
#include "core/scene/scene.h"

namespace core {

/// In pixels of the full film: x to the right, y down, pixel i from i to i + 1.
struct PixelBox {
  Vec2 min;
  Vec2 max;
};

struct ObjectBox {
  Bounds bounds;                    ///< world, metres
  std::optional<PixelBox> in_view;  ///< of what lies within the film, hidden or not; empty: nothing
};

struct ObjectBoxes {
  std::map<std::uint32_t, ObjectBox> objects;    ///< by id
  std::map<std::uint32_t, ObjectBox> instances;  ///< of those asked for
};

/// Of the triangles, whatever their holes. camera: without a lens. Takes as long as all triangles,
/// as placed, take to be read once.
ObjectBoxes object_boxes(const Scene& scene, const Camera& camera, int width, int height,
                         const std::set<std::uint32_t>& instances);

}  // namespace core
