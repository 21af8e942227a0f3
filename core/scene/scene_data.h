/// SceneData: the parts of a built scene that integrators read. Plain and immutable.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/accel/accel.h"
#include "core/geometry/mesh.h"
#include "core/geometry/surface_point.h"
#include "core/geometry/triangle_math.h"
#include "core/lights/light.h"
#include "core/lights/light_tree.h"
#include "core/materials/material.h"
#include "core/math/place.h"
#include "core/math/vec.h"
#include "core/media/medium_stack.h"
#include "core/textures/texture.h"

namespace core {

/// Index into SceneData::light_groups.
inline constexpr std::uint32_t kEnvironmentGroup = 0;

/// The planes of the surfaces that come close to the triangles of a mesh.
struct NearPlanes {
  struct Plane {
    Vec3 normal;  ///< unit; zero: near everything
    float offset_m = 0;
  };
  std::vector<std::uint32_t> first;  ///< by triangle, into `planes`; then their number
  std::vector<Plane> planes;

  /// Returns whether all planes of a triangle are farther than this from a point. False if they are
  /// unknown.
  bool are_beyond(float distance_m, std::uint32_t triangle, Vec3 point) const noexcept {
    return !first.empty() &&
           std::all_of(planes.begin() + first[triangle], planes.begin() + first[triangle + 1],
                       [&](const Plane& plane) {
                         return std::fabs(dot(plane.normal, point) + plane.offset_m) > distance_m;
                       });
  }
};

class SceneData {
 public:
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<Material> materials;
  std::vector<MeshData> meshes;
  std::vector<PlacedMesh> placed;  ///< first those of the top level, then those of instances
  /// Index into `placed` of the added ground.
  std::optional<std::uint32_t> ground;
  std::vector<PlacedInstance> instances;
  std::vector<Solid> solids;
  std::unique_ptr<Accel> accel;
  std::vector<TriangleLight> triangle_lights;
  std::vector<PunctualLight> punctual_lights;
  std::vector<std::shared_ptr<const IesProfile>> profiles;  ///< referenced by punctual lights
  LightTree light_tree;  ///< over triangle lights, then point and spot lights
  Place origin;          ///< SceneDescription::origin
  Vec3 center;           ///< bounding sphere
  float radius_m = 0;
  bool has_alpha = false;
  bool has_volumes = false;
  bool has_clear = false;
  bool has_shared_space = false;  ///< solids may touch or overlap
  bool has_open_solids = false;
  bool has_solid_holes = false;  ///< surfaces of solids may have holes
  bool has_scattering = false;   ///< of the interior of a solid
  /// By placed mesh, of those that bound solids. On their triangles, only points within
  /// edge_margin_m of an edge or of a near plane lie on other surfaces too. Empty: unknown.
  std::vector<NearPlanes> near_planes;
  float edge_margin_m = 0;
  /// Names of light groups; the first is that of the environment.
  std::vector<std::string> light_groups;
  std::vector<std::uint32_t> object_mattes;    ///< matte_id() by object id
  std::vector<std::uint32_t> material_mattes;  ///< by material index

  /// Returns the group of light number `light` (LightSample::light).
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
  /// Returns the instance of a hit; null if its mesh is in world space.
  const PlacedInstance* instance_of(const RawHit& hit) const noexcept {
    return hit.instance == kNoInstance ? nullptr : &instances[hit.instance];
  }
  /// Returns the solid that the triangle of `hit` bounds; null if none.
  const Solid* solid_of(const RawHit& hit) const noexcept {
    const std::uint32_t solid = placed_mesh(hit).solid;
    return solid == kNoSolid ? nullptr : &solids[solid];
  }
  /// Returns the hit of a triangle light by a ray.
  RawHit hit_of(const TriangleLight& light) const noexcept {
    const std::uint32_t first =
        light.instance == kNoInstance ? 0 : instances[light.instance].first_placed;
    return {0, light.instance, light.placed - first, light.triangle};
  }
  /// Returns the point where `ray` hits the triangle of `hit`.
  SurfacePoint surface_point(const RawHit& hit, const Ray& ray) const noexcept;
  /// Returns the vertices of the triangle of `hit`, at time 0.
  Corners<Vec3> corners(const RawHit& hit) const noexcept;
  /// Returns whether `point` on the triangle of `hit`, if it is not close to an edge, is known to
  /// lie on no other surface.
  bool is_single_face_within(const RawHit& hit, Vec3 point) const noexcept;
  /// Returns whether `point` on the triangle of `hit` is known to lie on no other surface.
  bool is_single_face(const RawHit& hit, Vec3 point) const noexcept;
  /// The hit point as vertices of its triangle and their weights.
  struct CornerWeights {
    std::array<std::uint32_t, 3> vertices{};
    Vec3 weights;
  };
  CornerWeights corner_weights(const RawHit& hit, const Ray& ray) const noexcept;
  /// Returns the first texture coordinates at the point; zero if there are none.
  Vec2 uv(const RawHit& hit, const Ray& ray) const noexcept;
  /// Returns the coverage at the point: 1 for OPAQUE, 0 or 1 for MASK, alpha for BLEND.
  float coverage(const RawHit& hit, const Ray& ray) const noexcept;
};

}  // namespace core
