/// The built-in scenes, generated as GLB files and read by the ordinary loader.
#pragma once

#include <span>
#include <string_view>

#include "core/scene_io/gltf_load.h"

namespace core {

struct BuiltinScene {
  std::string_view name;     ///< as in the job request
  std::string_view summary;  ///< one line of description
  Bytes (*make_glb)();
};

/// cornell-box, furnace, veach-mis, many-lights, glass, interior, keyhole, caustic-pool.
std::span<const BuiltinScene> builtin_scenes();
const BuiltinScene* find_builtin_scene(std::string_view name);

}  // namespace core
