/// MeanEmission: the mean radiance of triangles that emit, by which lights are chosen.
#pragma once

#include <map>
#include <utility>

#include "core/lights/light.h"
#include "core/scene/scene_data.h"
#include "core/textures/marked_blocks.h"

namespace core {

class MeanEmission {
 public:
  /// Meshes, materials and instances of the scene must be complete when of() is called.
  explicit MeanEmission(const SceneData& scene) : scene_(scene) {}

  /// Returns TriangleLight::radiance. All other members of the light must be set.
  Rgb of(const TriangleLight& light);

 private:
  struct Corners;
  float coverage(const TriangleLight& light, const Material& material, const Corners& at);
  const MarkedBlocks& colored(const Texture& texture);
  const MarkedBlocks& opaque(const Texture& texture, float least);

  const SceneData& scene_;
  std::map<const Texture*, MarkedBlocks> colored_;
  std::map<std::pair<const Texture*, float>, MarkedBlocks> opaque_;
};

}  // namespace core
