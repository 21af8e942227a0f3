/// SceneMoment: what is read of the file of a scene.
#pragma once

#include <optional>
#include <string>

#include "core/math/place.h"

namespace core {

struct SceneMoment {
  std::optional<double> time_seconds = 0;  ///< animation time; empty: the rest pose
  /// If positive, the shutter is open for this long from time_seconds on (core/scene_io/shutter.h).
  double shutter_seconds = 0;
  std::optional<std::string>
      variant;  ///< KHR_materials_variants by name; unknown: kInvalidArgument at "/variant"
  /// Point from which positions count; empty: far_origin() of the scene (gltf_origin.h). Scenes at
  /// several times of one picture share the first one's, and are not framed on their own.
  std::optional<Place> origin;
  /// Reads only positions, cameras and names: no images and no tangents.
  bool geometry_only = false;
};

}  // namespace core
