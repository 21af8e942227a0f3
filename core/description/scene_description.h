/// SceneDescription: plain data that a loader fills and core::Scene is built from.
///
/// Metres, y up, right-handed. Indices name other parts; -1 is "none". Nothing here is checked:
/// build_scene() refuses what does not fit. Formulas: glTF 2.0 and its KHR extensions.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/color/rgb.h"
#include "core/description/moved_vertices.h"
#include "core/image_io/image.h"
#include "core/math/bounds.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

class IesProfile;

enum class TextureWrap : std::uint8_t { kRepeat, kMirroredRepeat, kClampToEdge };

/// A sampled image as a material sees it.
struct TextureDescription {
  int image = -1;  ///< into SceneDescription::images; -1: no texture, the factor alone counts
  int uv_set = 0;  ///< 0 or 1: into PrimitiveDescription::uv
  TextureWrap wrap_u = TextureWrap::kRepeat;
  TextureWrap wrap_v = TextureWrap::kRepeat;
  bool nearest = false;  ///< magnification filter NEAREST
  /// KHR_texture_transform as rows of a 2x3 matrix: u' = m[0] u + m[1] v + m[2], v' = m[3] ...
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// Factors multiply their textures. Defaults are glTF's.
struct MaterialDescription {
  std::string name;
  std::array<int, 2> uv_sets = {0, 1};  ///< the file's TEXCOORD_n that uv_set 0 and 1 stand for
  Rgb base_color = {1, 1, 1};
  float base_alpha = 1;
  TextureDescription base_color_texture;  ///< sRGB, RGBA
  float metallic = 1;
  float roughness = 1;                            ///< perceptual: alpha = roughness^2
  TextureDescription metallic_roughness_texture;  ///< linear; G roughness, B metallic
  TextureDescription normal_texture;              ///< linear, tangent space
  float normal_scale = 1;
  TextureDescription
      occlusion_texture;  ///< linear R; read for completeness, a path tracer has no use
  float occlusion_strength = 1;
  Rgb emissive = {0, 0, 0};  ///< factor times KHR_materials_emissive_strength; W/(m^2 sr)
  TextureDescription emissive_texture;  ///< sRGB
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  bool unlit = false;
  float ior = 1.5F;  ///< 0: infinitely reflective (KHR_materials_ior)
  float specular = 1;
  TextureDescription specular_texture;  ///< A
  Rgb specular_color = {1, 1, 1};
  TextureDescription specular_color_texture;  ///< sRGB
  float transmission = 0;
  TextureDescription transmission_texture;  ///< R
  float thickness = 0;                      ///< 0: thin-walled; above: the mesh bounds a volume
  TextureDescription thickness_texture;
  float attenuation_distance = 0;  ///< metres; 0 or less: infinite
  Rgb attenuation_color = {1, 1, 1};
  Rgb multiscatter_color = {0, 0, 0};  ///< of a deep medium under diffuse light; 0: it absorbs only
  float scatter_anisotropy = 0;        ///< mean cosine of the angle of scattering
  float clearcoat = 0;
  TextureDescription clearcoat_texture;  ///< R
  float clearcoat_roughness = 0;
  TextureDescription clearcoat_roughness_texture;  ///< G
  TextureDescription clearcoat_normal_texture;
  float clearcoat_normal_scale = 1;
  Rgb sheen_color = {0, 0, 0};
  TextureDescription sheen_color_texture;  ///< sRGB
  float sheen_roughness = 0;
  TextureDescription sheen_roughness_texture;  ///< A
  float iridescence = 0;
  TextureDescription iridescence_texture;  ///< R
  float iridescence_ior = 1.3F;
  float iridescence_thickness_min_nm = 100;
  float iridescence_thickness_max_nm = 400;
  TextureDescription iridescence_thickness_texture;  ///< G
  float anisotropy = 0;
  float anisotropy_rotation_rad = 0;
  TextureDescription anisotropy_texture;  ///< RG direction, B strength
  float dispersion = 0;                   ///< 20 / Abbe number; 0: none
  float diffuse_transmission = 0;
  TextureDescription diffuse_transmission_texture;  ///< A
  Rgb diffuse_transmission_color = {1, 1, 1};
  TextureDescription diffuse_transmission_color_texture;  ///< sRGB
};

/// Triangles of one material. All attribute arrays are empty or as long as positions.
struct PrimitiveDescription {
  std::vector<Vec3> positions;          ///< object space
  std::vector<Vec3> normals;            ///< empty: flat, made from the triangles
  std::vector<Vec4> tangents;           ///< w: handedness of the bitangent, cross(n, t) * w
  std::array<std::vector<Vec2>, 2> uv;  ///< v = 0 at the top row
  std::vector<Vec4> colors;             ///< linear RGBA
  std::vector<std::uint32_t> indices;   ///< three a triangle; never empty, each < positions.size()
  /// Of each vertex its number in the file, where tangents split some; empty: the same.
  std::vector<std::uint32_t> file_vertices;
  int material = -1;     ///< -1: glTF's default material
  std::uint32_t id = 0;  ///< 1 + its number among the primitives of all meshes of the file; 0: of
                         ///< those here
  /// Where the vertices are at further, evenly spaced times of an open shutter, its end the last:
  /// world space. Pre: one instance has the mesh. Empty: it stays.
  std::vector<MovedVertices> later = {};
};

struct MeshDescription {
  std::string name;
  std::vector<PrimitiveDescription> primitives;
};

/// A mesh placed in the world; meshes named by several instances are stored once.
struct InstanceDescription {
  int mesh = -1;
  Transform to_world;
  std::string group = {};      ///< of lights, if it shines; empty: the mesh's name
  std::uint32_t object = 0;    ///< ObjectDescription::id; 0: an object of its own
  std::uint32_t instance = 0;  ///< of the object's range; 0: the object's own
  bool is_ground = false;      ///< added to the model (core/scene/ground.h), outside of its bounds
};

/// A node of the file that shows a mesh. Ids follow from the file alone, so that all views,
/// variants and times of a scene have the same ones.
struct ObjectDescription {
  std::uint32_t id = 0;              ///< 1 + the node's number
  std::string name;                  ///< of the node, or of its mesh; may be empty
  std::uint32_t first_instance = 0;  ///< ids of its instances begin here, at 1 for the first node
  std::uint32_t instances = 1;       ///< several: EXT_mesh_gpu_instancing
};

enum class PunctualType : std::uint8_t { kDirectional, kPoint, kSpot, kProfile };

/// KHR_lights_punctual, or EXT_lights_ies (kProfile). Shines along -z of to_world. Units: one
/// candela is 1 W/sr, one lux 1 W/m^2.
struct PunctualLightDescription {
  std::string name;
  std::string group;  ///< of lights; empty: its name
  PunctualType type = PunctualType::kPoint;
  Rgb intensity = {1, 1, 1};  ///< color * intensity: W/sr (point, spot), W/m^2 (directional); of
                              ///< the profile color * multiplier
  float range_m = 0;          ///< 0: infinite
  float inner_cone_rad = 0;
  float outer_cone_rad = 0.7853982F;
  int profile = -1;  ///< into SceneDescription::profiles
  Transform to_world;
};

struct CameraDescription {
  std::string name;
  bool orthographic = false;
  float vertical_fov_rad = 0.7853982F;  ///< perspective
  float aspect_ratio = 0;               ///< 0: the film's
  float x_magnification = 1;            ///< orthographic: half the width in metres
  float y_magnification = 1;            ///< orthographic: half the height in metres
  Transform to_world;                   ///< looks along -z, y up
  std::vector<Transform> later = {};    ///< as of PrimitiveDescription; empty: it stays
};

struct SceneDescription {
  std::string name;
  std::vector<std::shared_ptr<const Image>> images;
  std::vector<MaterialDescription> materials;
  std::vector<MeshDescription> meshes;
  std::vector<InstanceDescription> instances;
  std::vector<ObjectDescription> objects;      ///< by id; empty: one for each instance
  std::vector<std::uint32_t> mesh_primitives;  ///< of each mesh of the file; empty: of `meshes`
  std::vector<PunctualLightDescription> lights;
  std::vector<std::shared_ptr<const IesProfile>> profiles;
  /// The scene's own light from all around, as Environment::create() takes it: RGB floats; or null.
  std::shared_ptr<const Image> environment;
  std::vector<CameraDescription> cameras;
  std::vector<std::string> variants;
  std::vector<std::string> animations;
  std::vector<std::string> extensions;  ///< extensionsUsed
  std::vector<std::string> warnings;
  bool has_emissive_strength =
      false;  ///< some material's KHR_materials_emissive_strength is above 1
};

}  // namespace core
