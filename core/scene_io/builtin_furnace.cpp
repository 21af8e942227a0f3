// Bodies without absorption or emission: under the white sky of scenes without lights, radiance is
// 1 everywhere, so any structure in the image is a renderer error.
#include <array>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {

Bytes make_furnace() {
  SceneDescription scene;
  constexpr float kRadius = 0.45F;
  constexpr int kSegments = 96;
  const std::array materials = {diffuse_material("white diffuse", Rgb(1)),
                                plastic_material("coated, roughness 0.05", Rgb(1), 0.05F),
                                plastic_material("coated, roughness 0.3", Rgb(1), 0.3F),
                                plastic_material("coated, roughness 1", Rgb(1), 1),
                                metal_material("metal, roughness 0.05", Rgb(1), 0.05F),
                                metal_material("metal, roughness 0.3", Rgb(1), 0.3F),
                                metal_material("metal, roughness 0.6", Rgb(1), 0.6F),
                                metal_material("metal, roughness 1", Rgb(1), 1),
                                glass_material("clear glass", Rgb(1), 0)};
  const PrimitiveDescription body = sphere(kRadius, kSegments);
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const auto column = static_cast<float>(i % 3) - 1;
    const auto row = 1 - static_cast<float>(i / 3);
    add_object(scene, materials[i].name, body, add_material(scene, materials[i]),
               translation({column, row, 0}));
  }
  add_camera(scene, {0, 0, 7}, {0, 0, 0}, 0.45F);
  return write_glb(scene);
}

}  // namespace core
