#include "core/scene_io/builtin_scenes.h"

#include <algorithm>
#include <array>

#include "core/scene_io/builtin_list.h"

namespace core {
namespace {

constexpr std::array kScenes = {
    BuiltinScene{"still-life", "Tea for two by a window: glazed clay, brass, fruit and flowers.",
                 &make_still_life},
    BuiltinScene{"cornell-box", "The measured Cornell box, diffuse, lit by one panel.",
                 &make_cornell_box},
    BuiltinScene{
        "furnace",
        "White furnace test: lossless spheres under a white sky; every pixel should be exactly 1.",
        &make_furnace},
    BuiltinScene{"veach-mis", "Glossy plates and spherical lights of equal power, after Veach.",
                 &make_veach_mis},
    BuiltinScene{"many-lights", "A thousand coloured lanterns over dunes and stones.",
                 &make_many_lights},
    BuiltinScene{"glass", "Caustics of a glass sphere, a tinted block and a goblet.", &make_glass},
    BuiltinScene{"interior", "A room lit only through a half-open door.", &make_interior},
    BuiltinScene{"keyhole", "A dark room lit through a keyhole, by a light that faces away.",
                 &make_keyhole},
    BuiltinScene{"caustic-pool", "Caustics under the waves of a pool, seen through them.",
                 &make_caustic_pool},
};

}  // namespace

std::span<const BuiltinScene> builtin_scenes() { return kScenes; }

const BuiltinScene* find_builtin_scene(std::string_view name) {
  const auto* const it = std::find_if(kScenes.begin(), kScenes.end(),
                                      [name](const BuiltinScene& s) { return s.name == name; });
  return it == kScenes.end() ? nullptr : it;
}

}  // namespace core
