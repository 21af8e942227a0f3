/// Bounding boxes of the objects of a scene: in the world, and in the image ignoring occlusion.
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

/// In pixels of the full film: x to the right, y down; pixel i covers i to i + 1.
struct PixelBox {
  Vec2 min;
  Vec2 max;
};

struct ObjectBox {
  Bounds bounds;                    ///< world, metres
  std::optional<PixelBox> in_view;  ///< of the part within the film, occluded or not; empty: no
                                    ///< part
};

struct ObjectBoxes {
  std::map<std::uint32_t, ObjectBox> objects;    ///< by id
  std::map<std::uint32_t, ObjectBox> instances;  ///< those requested
};

/// Returns the bounding boxes of the triangles, including their holes. camera: without a lens.
/// Reads all triangles once per instance.
ObjectBoxes object_boxes(const Scene& scene, const Camera& camera, int width, int height,
                         const std::set<std::uint32_t>& instances);

}  // namespace core
