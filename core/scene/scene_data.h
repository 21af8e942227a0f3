/// SceneData: the parts of a built scene that the integrators read. Plain and immutable.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/accel/accel.h"
#include "core/bsdf/bsdf.h"
#include "core/color/rgb.h"
#include "core/lights/light.h"
#include "core/lights/light_tree.h"
#include "core/math/frame.h"
#include "core/math/transform.h"
#include "core/scene/scene_description.h"
#include "core/textures/texture.h"

namespace core {

/// A texture as a material uses it; texture null: the factor alone.
struct TextureSlot {
  const Texture* texture = nullptr;
  TextureDescription description;
};

/// What shading needs of a material, textures resolved.
struct Material {
  MaterialDescription factors;
  BsdfParameters plain;  ///< as the factors alone give them
  TextureSlot base_color;
  TextureSlot metallic_roughness;
  TextureSlot normal;
  TextureSlot emissive;
  TextureSlot specular;
  TextureSlot specular_color;
  TextureSlot transmission;
  TextureSlot anisotropy;
  TextureSlot clearcoat;
  TextureSlot clearcoat_roughness;
  TextureSlot clearcoat_normal;
  TextureSlot sheen_color;
  TextureSlot sheen_roughness;
  TextureSlot iridescence;
  TextureSlot iridescence_thickness;
  TextureSlot diffuse_transmission;
  TextureSlot diffuse_transmission_color;
  bool has_texture = false;   ///< any of the above
  bool has_layers = false;    ///< clearcoat, sheen, iridescence or diffuse transmission
  bool is_emissive = false;
  bool has_alpha = false;     ///< MASK or BLEND: hits may be holes
  bool is_volume = false;     ///< bounds a solid (thickness > 0)
  bool transmits = false;     ///< thin or solid, clear or diffuse
  bool is_clear = false;      ///< may let light straight through: Bsdf::straight() tells where
  Rgb sigma_a;                ///< absorption inside [1/m]
};

/// One mesh primitive in memory. Buffers belong to Embree too.
struct MeshData {
  std::vector<Vec3> positions;  ///< one more than there are vertices: Embree reads past the end
  std::vector<std::uint32_t> indices;
  std::vector<Vec3> normals;
  std::vector<Vec4> tangents;
  std::array<std::vector<Vec2>, 2> uv;
  std::vector<Vec4> colors;
  std::uint32_t material = 0;
  bool in_world_space = false;

  std::size_t triangle_count() const noexcept { return indices.size() / 3; }
  std::size_t bytes() const noexcept;
};

inline constexpr std::uint32_t kNoLight = 0xffffffffU;

/// A mesh where a ray can meet it: in the top level, or through an instance.
struct PlacedMesh {
  std::uint32_t mesh = 0;
  std::uint32_t first_light = kNoLight;  ///< light of triangle 0; the others follow
};

struct PlacedInstance {
  Transform to_world;
  std::uint32_t first_placed = 0;  ///< into placed; geometry g of the group is placed[first + g]
};

/// A hit point, from the vertices. World space.
struct SurfacePoint {
  Vec3 position;
  Vec3 normal_geometric;  ///< unit, on the front side (counter-clockwise)
  Vec3 normal_shading;    ///< unit, interpolated, normal map not applied
  std::array<Vec2, 2> uv;
  Vec4 color = {1, 1, 1, 1};
  bool has_color = false;
  Vec3 tangent;          ///< unit along +u of the normal map's set; zero when there is none
  float tangent_sign = 1;
  /// A way on the surface is dot(way, to_edge1) edges from vertex 0 to 1 and dot(way, to_edge2) from 0 to 2, which the
  /// uv_edges are in the sets of coordinates. Zero unless the material has a texture.
  Vec3 to_edge1;
  Vec3 to_edge2;
  std::array<Vec2, 2> uv_edge1;
  std::array<Vec2, 2> uv_edge2;
  /// Height above the triangle, on the ray's side, of the round surface that its normals speak of; 0 where that is
  /// flat or hollow.
  float bulge_m = 0;
  std::uint32_t material = 0;
  std::uint32_t light = kNoLight;
};

class SceneData {
 public:
  std::vector<std::shared_ptr<const Texture>> textures;
  std::vector<Material> materials;
  std::vector<MeshData> meshes;
  std::vector<PlacedMesh> placed;        ///< first those of the top level, then per instance
  std::vector<PlacedInstance> instances;
  std::unique_ptr<Accel> accel;
  std::vector<TriangleLight> triangle_lights;
  std::vector<PunctualLight> punctual_lights;
  LightTree light_tree;  ///< over triangle lights, then point and spot lights
  Vec3 center;           ///< bounding sphere
  float radius_m = 0;
  bool has_alpha = false;
  bool has_volumes = false;
  bool has_clear = false;

  const PlacedMesh& placed_mesh(const RawHit& hit) const noexcept {
    return placed[hit.instance == kNoInstance ? hit.geometry
                                              : instances[hit.instance].first_placed + hit.geometry];
  }
  /// The point where `ray` meets the triangle of `hit`.
  SurfacePoint surface_point(const RawHit& hit, const Ray& ray) const noexcept;
  /// Coverage at the point: 1 for OPAQUE, 0 or 1 for MASK, alpha for BLEND.
  float coverage(const RawHit& hit, const Ray& ray) const noexcept;
};

}  // namespace core
