/// SceneData: the parts of a built scene that the integrators read. Plain and immutable.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/accel/accel.h"
#include "core/geometry/mesh.h"
#include "core/geometry/surface_point.h"
#include "core/lights/light.h"
#include "core/lights/light_tree.h"
#include "core/materials/material.h"
#include "core/math/vec.h"
#include "core/textures/texture.h"

namespace core {

/// SceneData::light_groups.
inline constexpr std::uint32_t kEnvironmentGroup = 0;

class SceneData {
 public:
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<Material> materials;
  std::vector<MeshData> meshes;
  std::vector<PlacedMesh> placed;  ///< first those of the top level, then per instance
  /// Of `placed`, what was added for the model to stand on.
  std::optional<std::uint32_t> ground;
  std::vector<PlacedInstance> instances;
  std::unique_ptr<Accel> accel;
  std::vector<TriangleLight> triangle_lights;
  std::vector<PunctualLight> punctual_lights;
  std::vector<std::shared_ptr<const IesProfile>> profiles;  ///< of punctual lights
  LightTree light_tree;  ///< over triangle lights, then point and spot lights
  Vec3 center;           ///< bounding sphere
  float radius_m = 0;
  bool has_alpha = false;
  bool has_volumes = false;
  bool has_clear = false;
  bool has_scattering = false;  ///< inside of a solid
  /// Names of groups of lights; the first is the environment's.
  std::vector<std::string> light_groups;
  std::vector<std::uint32_t> object_mattes;    ///< of matte_id(), by the object's id
  std::vector<std::uint32_t> material_mattes;  ///< by number

  /// Of light number `light` (LightSample::light).
  std::uint32_t group_of_light(std::uint32_t light) const noexcept {
    if (light < triangle_lights.size()) {
      return placed[triangle_lights[light].placed].group;
    }
    light -= static_cast<std::uint32_t>(triangle_lights.size());
    return light < punctual_lights.size() ? punctual_lights[light].group : kEnvironmentGroup;
  }
  const PlacedMesh& placed_mesh(const RawHit& hit) const noexcept {
    return placed[hit.instance == kNoInstance
                      ? hit.geometry
                      : instances[hit.instance].first_placed + hit.geometry];
  }
  /// The point where `ray` meets the triangle of `hit`.
  SurfacePoint surface_point(const RawHit& hit, const Ray& ray) const noexcept;
  /// The same point by the triangle's vertices and their weights.
  struct CornerWeights {
    std::array<std::uint32_t, 3> vertices{};
    Vec3 weights;
  };
  CornerWeights corner_weights(const RawHit& hit, const Ray& ray) const noexcept;
  /// First set of texture coordinates at the point; zero without one.
  Vec2 uv(const RawHit& hit, const Ray& ray) const noexcept;
  /// Coverage at the point: 1 for OPAQUE, 0 or 1 for MASK, alpha for BLEND.
  float coverage(const RawHit& hit, const Ray& ray) const noexcept;
};

}  // namespace core
